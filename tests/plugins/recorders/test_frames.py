from pathlib import Path

import numpy as np
from PIL import Image

from benchbot.core.plugins import load
from benchbot.core.progress import ActionResult, Progress, State, Step


def step(**observations: np.ndarray) -> Step:
    return Step(observations, ActionResult.SUCCESS, (), State.CLEAN, 0)


def test_every_frame_becomes_a_file_and_a_reset_starts_over(tmp_path: Path) -> None:
    recording = load().record("recorders", "frames").create(tmp_path / "frames")
    image = np.zeros((40, 60, 3), np.uint8)
    image[:, 30:] = (200, 100, 50)
    recording.reset()
    recording.step(None, {}, step(image_rgb=image), Progress())
    recording.step("move_next", {}, step(image_rgb=image), Progress())
    assert sorted(path.name for path in tmp_path.glob("frames/*")) == ["00000.jpg", "00001.jpg"]
    recording.reset()
    recording.step(None, {}, step(image_rgb=image), Progress())
    recording.close()
    (path,) = tmp_path.glob("frames/*")
    seen = np.asarray(Image.open(path)).astype(int)
    assert seen.shape == image.shape
    assert np.abs(seen[:, 40] - (200, 100, 50)).max() < 8


def test_a_task_without_a_camera_leaves_no_frames(tmp_path: Path) -> None:
    recording = load().record("recorders", "frames").create(tmp_path)
    recording.step(None, {}, step(poses=np.zeros(3)), Progress())
    assert list(tmp_path.iterdir()) == []
