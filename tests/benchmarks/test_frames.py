"""Frame times are taken of the checkout that was asked for, in turn, and by processes that say when they cannot."""

import argparse
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import bench_frames
from benchmarks.bench_frames import OTHER, OURS, ROOT, Row, ask, checkout, lines, measure, server

ANSWERS = """
import json, sys
name, count = sys.argv[1], 0
for line in sys.stdin:
    asked = json.loads(line)
    open(sys.argv[2], "a").write(f"{name} {asked}\\n")
    count += 1
    print(json.dumps([10.0, 20.0] if asked else [count, 2 * count]), flush=True)
"""


def process(*arguments: str) -> bench_frames.Server:
    return subprocess.Popen(
        [sys.executable, "-c", *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def test_rounds_are_taken_in_turn_and_medians_leave_out_the_first_picture(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with process(ANSWERS, OURS, str(log)) as ours, process(ANSWERS, OTHER, str(log)) as other:
        rows = list(measure("arena:1", 4, {OURS: ours, OTHER: other}, rounds=3))
        for server in (ours, other):
            server.communicate()
    assert rows == [Row("arena:1", 4, of, 10.0, 20.0, 3.0, 6.0) for of in (OURS, OTHER)]
    assert log.read_text().splitlines() == [
        f"{of} {asked}" for asked in ("['arena:1', 4]", None, None, None) for of in (OURS, OTHER)
    ]


def test_ratios_are_the_others_time_over_ours() -> None:
    ours = Row("arena:1", 4, OURS, 9.0, 10.0, 0.1, 0.2)
    first, second = lines([ours, Row("arena:1", 4, OTHER, 9.0, 10.0, 0.3, 0.4)])
    assert first.split() == ["arena:1", "4", OURS, "9.0", "10.0", "100.0", "200.0"]
    assert second.split()[-2:] == ["3.00", "2.00"]


def test_a_process_that_dies_is_an_error() -> None:
    with process("") as dead:
        dead.wait()
        with pytest.raises(RuntimeError, match="died"):
            bench_frames.answer(dead)


def test_a_folder_is_a_checkout_itself(tmp_path: Path) -> None:
    with checkout(str(tmp_path)) as root:
        assert root == tmp_path.resolve()


def test_pictures_are_taken_with_the_sources_of_the_checkout(tmp_path: Path, kernel_cache: Path) -> None:
    options = argparse.Namespace(device="cpu", robot="carter_lowres", threads=1)
    with server(ROOT, kernel_cache, options) as ours:
        wall_s, processor_s = ask(ours, ["miniroom:1", 0])
        again_s, _ = ask(ours, None)
        ours.communicate()
    assert wall_s > 0
    assert processor_s > again_s > 0
    with pytest.raises(RuntimeError, match="would be taken by"), server(tmp_path, kernel_cache, options):
        pass
