from pathlib import Path

import pytest

from benchbot.core import recording
from benchbot.core.errors import BenchbotError
from benchbot.core.plugins import load


def test_recordings_are_started_by_name(tmp_path: Path) -> None:
    (frames,) = recording.start(load(), {"frames": tmp_path / "frames"})
    frames.close()
    assert (tmp_path / "frames").is_dir()


def test_an_unknown_recorder_is_refused_before_any_is_started(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="'framse' is not an installed recorder"):
        recording.start(load(), {"frames": tmp_path / "frames", "framse": tmp_path / "other"})
    assert list(tmp_path.iterdir()) == []
