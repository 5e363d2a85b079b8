from pathlib import Path
from typing import Unpack

import numpy as np
import pytest
from PIL import Image

from benchbot.core.channels import Observations, Segmentation
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


def test_depth_and_instances_that_the_task_observes_are_kept_small_and_without_loss(tmp_path: Path) -> None:
    depth_m = np.linspace(0.1, 9.0, 400 * 700, dtype=np.float32).reshape(400, 700)
    depth_m[1, 1:10] = [np.nan, np.inf, -np.inf, 70.0, 0.5, 0.5, 0.5, 0.5, 0.5]
    instances = np.arange(400 * 700, dtype=np.uint32).reshape(400, 700).astype(np.uint16)
    segments: Segmentation = {
        "class_segment_img": IMAGE[..., 0],
        "instance_segment_img": instances,
        "class_ids": {"chair": 1},
    }
    recording = load().record("recorders", "frames").create(tmp_path)
    for number in (1, 2):
        seen = step(image_rgb=IMAGE, image_depth=depth_m, image_segment=segments)
        recording.step(None, {}, seen, Progress(frames=number))
    recording.close()

    # Every third pixel: 700 wide is more than 320.
    kept = np.asarray(Image.open(tmp_path / "00001.depth.png"))
    assert kept.dtype == np.uint16
    assert kept.shape == (133, 233)
    assert kept[0, :4].tolist() == [0, 65535, 500, int(np.rint(depth_m[1, 10] * 1000))]
    np.testing.assert_array_equal(kept[1:], np.rint(depth_m[4::3, 1::3] * 1000))
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "00001.instances.png")), instances[1::3, 1::3])
    assert (tmp_path / "classes.json").read_text() == '{"chair": 1}'
    recording.reset()
    assert list(tmp_path.iterdir()) == []
