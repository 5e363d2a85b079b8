from pathlib import Path
from typing import Unpack

import numpy as np
import pytest
from PIL import Image

from benchbot.core.channels import Observations
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.core.progress import ActionResult, Progress, State, Step


def step(**observations: Unpack[Observations]) -> Step:
    return Step(observations, ActionResult.SUCCESS, (), State.CLEAN, 0)


IMAGE = np.zeros((40, 60, 3), np.uint8)
IMAGE[:, 30:] = (200, 100, 50)


def test_every_frame_becomes_a_file(tmp_path: Path) -> None:
    recording = load().record("recorders", "frames").create(tmp_path)
    recording.reset()
    recording.step(None, {}, step(image_rgb=IMAGE), Progress())
    recording.step("move_next", {}, step(image_rgb=IMAGE), Progress(frames=2))
    recording.close()
    recording.close()
    paths = sorted(tmp_path.iterdir())
    assert [path.name for path in paths] == ["00000.jpg", "00001.jpg"]
    seen = np.asarray(Image.open(paths[1])).astype(int)
    assert seen.shape == IMAGE.shape
    assert np.abs(seen[:, 40] - (200, 100, 50)).max() < 8


def test_a_reset_starts_over(tmp_path: Path) -> None:
    recording = load().record("recorders", "frames").create(tmp_path / "frames")
    for number in range(1, 4):
        recording.step(None, {}, step(image_rgb=IMAGE), Progress(frames=number))
    recording.reset()
    recording.step(None, {}, step(image_rgb=IMAGE), Progress())
    recording.close()
    assert [path.name for path in (tmp_path / "frames").iterdir()] == ["00000.jpg"]


def test_a_frame_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    recording = load().record("recorders", "frames").create(tmp_path / "frames")
    (tmp_path / "frames").rmdir()
    recording.step(None, {}, step(image_rgb=IMAGE), Progress())
    with pytest.raises(BenchbotError, match=r"frames cannot be written"):
        recording.close()


def test_a_task_without_a_camera_leaves_no_frames(tmp_path: Path) -> None:
    recording = load().record("recorders", "frames").create(tmp_path)
    recording.step(None, {}, step(goal=np.zeros(2)), Progress())
    assert list(tmp_path.iterdir()) == []
