"""Whatever happens to the bytes of a recording, it is replayed as it was or refused in words."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.plugin import BenchbotError
from benchbot_record_mcap.recording import McapRecording
from benchbot_replay import recordings
from plugins.record_mcap.tests.bags import sample_session, steps_to_the_end

BYTES = st.tuples(st.floats(0, 1, exclude_max=True), st.binary(min_size=1, max_size=8))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("recorded") / "run"
    session = sample_session(McapRecording(folder))
    assert len(list(steps_to_the_end(session))) > 2
    session.close()
    return recordings.file_of(folder).read_bytes()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path


def replayable(file: Path) -> bool:
    try:
        recordings.read(file)
    except BenchbotError as error:
        return not ("cannot be replayed" in error.title and error.fix)
    return True


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(BYTES, min_size=1, max_size=3))
def test_changed_bytes_are_refused_or_do_no_harm(
    recorded: bytes, cache: Path, changes: list[tuple[float, bytes]]
) -> None:
    data = bytearray(recorded)
    for share, new in changes:
        place = int(share * (len(data) - len(new)))
        data[place : place + len(new)] = new
    file = cache / "changed.mcap"
    file.write_bytes(data)
    replayable(file)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0, 1, exclude_max=True))
def test_a_file_that_lacks_its_end_is_refused(recorded: bytes, cache: Path, share: float) -> None:
    file = cache / "cut.mcap"
    file.write_bytes(recorded[: int(share * len(recorded))])
    assert not replayable(file)


def test_the_whole_file_is_replayed(recorded: bytes, cache: Path) -> None:
    file = cache / "whole.mcap"
    file.write_bytes(recorded)
    assert replayable(file)
