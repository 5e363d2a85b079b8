"""Evidence: with depth, a frame sees an object only where something of it is in sight."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.plugin import Pose
from benchbot.viewing import Box, Camera
from benchbot_view.evidence import Recorded, View, folder_of, prepare, prepared

# At the origin, looking along x: its z is the robot's x, its x the robot's -y, its y the robot's -z.
MOUNT = Pose.from_xyz_rpy_deg((0, 0, 1), (-90, 0, -90))
CAMERA = Camera(MOUNT, 160, 120, 80, 80, 80, 60)
IN_SIGHT, BEHIND_THE_WALL, BEHIND_THE_ROBOT = (
    Box.of((2.95, 0, 1), (0.2, 1, 1)),
    Box.of((5, 0, 1), (1, 1, 1)),
    Box.of((-3, 0, 1), (1, 1, 1)),
)


def wall(_: Path) -> Iterator[Mapping[str, Any]]:
    """A wall 3 m ahead, twice: depth, and classes with one name."""
    for shade in (50, 200):
        yield {
            "image_rgb": np.full((120, 160, 3), shade, np.uint8),
            "image_depth": np.full((120, 160), 3.0, np.float32),
            "image_segment": {"class_segment_img": np.ones((120, 160), np.uint8), "class_ids": {"wall": 1}},
        }


@pytest.fixture
def found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Recorded:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "recording").mkdir()
    (tmp_path / "recording" / "a.bin").write_bytes(b"1")
    return Recorded({}, (tmp_path / "recording", wall))


def test_a_wall_hides_what_is_behind_it(found: Recorded) -> None:
    boxes = [(0, IN_SIGHT), (0, BEHIND_THE_WALL), (0, BEHIND_THE_ROBOT), (1, IN_SIGHT), (0, None)]
    view = View(CAMERA, [(0, Pose()), (0, Pose.planar(0, 0, 3.14159))])
    assert prepared(found, boxes) is None

    evidence = prepare(found, view, boxes)

    assert evidence["measured"]
    seen = [[number for number, _ in frames] for frames in evidence["seen"]]
    assert seen == [[0], [], [1], [], []]
    assert prepared(found, boxes) == json.loads(json.dumps(evidence))
    assert prepared(found, boxes[:1]) is None
    names = sorted(path.name for path in folder_of(found, boxes).iterdir())
    assert names == [
        "00000-classes.png", "00000-depth.png", "00000.jpg", "00001-classes.png", "00001-depth.png", "00001.jpg",
        "cloud.json", "evidence.json",
    ]  # fmt: skip


def test_the_cloud_holds_the_wall_where_it_is(found: Recorded) -> None:
    view = View(CAMERA, [(0, Pose()), (0, Pose())])
    prepare(found, view, [(0, IN_SIGHT)])
    cloud = json.loads((folder_of(found, [(0, IN_SIGHT)]) / "cloud.json").read_text("utf-8"))

    import base64

    points = np.frombuffer(base64.b64decode(cloud["points"]), "<u2").reshape(-1, 3) * cloud["scale_m"] + cloud["low"]
    assert len(points) > 200
    assert points[:, 0] == pytest.approx(3.0, abs=0.01)
    assert np.ptp(points[:, 1]) == pytest.approx(6.0, abs=0.3)
    assert points[:, 2].max() < 2.2
    assert set(np.frombuffer(base64.b64decode(cloud["frames"]), "<u2").tolist()) == {0}


def test_without_depth_it_is_only_where_the_camera_looked(found: Recorded, tmp_path: Path) -> None:
    (tmp_path / "00000.jpg").write_bytes(b"")
    frames = {0: tmp_path / "00000.jpg"}
    boxes = [(0, IN_SIGHT), (0, BEHIND_THE_ROBOT)]

    evidence = prepare(Recorded(frames, None), View(CAMERA, [(0, Pose())]), boxes)

    assert not evidence["measured"]
    assert [len(seen) for seen in evidence["seen"]] == [1, 0]
