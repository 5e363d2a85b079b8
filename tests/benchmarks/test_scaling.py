"""What is told of a batch's workers while all of them work."""

import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.bench_scaling import Row, show, steady_rate


def write(folder: Path, **finished_s: list[float]) -> Path:
    for name, times_s in finished_s.items():
        told = [{"what": "started", "time_s": 0.0}, *({"what": "finished", "time_s": each} for each in times_s)]
        (folder / f"{name}.jsonl").write_text("".join(f"{json.dumps(entry)}\n" for entry in told), "utf-8")
    return folder


def test_the_time_of_starting_and_ending_does_not_count(tmp_path: Path) -> None:
    # A slow start, then an episode every 2 s, and one every 4 s; the second worker goes on alone in the end.
    events = write(tmp_path, one=[50.0, 52.0, 54.0, 56.0], two=[48.0, 52.0, 56.0, 60.0, 64.0], driver=[])
    assert steady_rate(events, 2) == pytest.approx(1 / 2 + 1 / 4)


@pytest.mark.parametrize(
    "times_s",
    [{"one": [5.0, 9.0]}, {"one": [5.0, 9.0], "two": [7.0]}, {"one": [1.0, 2.0], "two": [3.0, 4.0]}, {}],
)
def test_where_workers_never_work_together_nothing_is_steady(times_s: dict[str, list[float]], tmp_path: Path) -> None:
    assert steady_rate(write(tmp_path, **times_s), 2) is None


@given(st.integers(1, 8), st.floats(0.5, 20.0), st.integers(3, 9))
def test_equal_workers_have_the_rate_of_one_times_their_number(workers: int, period_s: float, episodes: int) -> None:
    times_s = [period_s * number for number in range(1, episodes + 1)]
    with tempfile.TemporaryDirectory() as folder:
        events = write(Path(folder), **{f"worker_{number}": times_s for number in range(workers)})
        assert steady_rate(events, workers) == pytest.approx(workers / period_s)


def test_the_table_shows_efficiency_against_the_first_row(capsys: pytest.CaptureFixture[str]) -> None:
    show([Row(1, 64, 128.0, 128.0, 0.5), Row(16, 64, 10.0, 160.0, 6.4)])
    *_, last, summary = capsys.readouterr().out.splitlines()
    assert last.split() == ["16", "64", "10.0", "160.0", "2.50", "0.80", "0.80"]
    assert summary == "16 workers: 12.8 times as many episodes an hour as 1, each at 1.25 times the processor time"
