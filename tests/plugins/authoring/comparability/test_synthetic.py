"""What is cast at the boxes of the golden room by hand agrees with it; what is done to it is named exactly."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.findings import Level
from benchbot.core.geometry import Pose
from benchbot.core.platform import Scene
from benchbot.plugins.authoring.comparability import golden_room
from benchbot.plugins.authoring.comparability.motion import check_contact
from benchbot.plugins.authoring.comparability.world import World
from benchbot.testing import Sight, as_text, check_laser, check_senses
from benchbot_scenes.gltf import load_scene

WIDTH, HEIGHT, FOCAL_PX, BEAMS = 48, 32, 24.0, 360
OPTICAL = Pose.from_xyz_rpy_deg((0.1, 0.05, 0.9), (-90, 0, -90))
LIDAR = Pose.from_xyz_rpy_deg((0.0, 0.0, 0.6))
ROBOT = {
    "frames": {
        "eye": {"xyz": [0.1, 0.05, 0.9], "rpy_deg": [-90, 0, -90]},
        "lidar": {"xyz": [0.0, 0.0, 0.6]},
    },
    "camera": {"frame": "eye"},
    "laser": {"frame": "lidar"},
}


def rendered(base: Pose) -> Sight:
    """What a robot observes in the golden room: depth and a laser, from their definitions."""
    camera, lidar = base @ OPTICAL, base @ LIDAR
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - WIDTH / 2) / FOCAL_PX, (v - HEIGHT / 2) / FOCAL_PX, np.ones((HEIGHT, WIDTH))], -1)
    depth_m, _ = golden_room.ROOM.cast(camera.matrix()[:3, 3], rays @ camera.matrix()[:3, :3].T)
    angles_rad = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
    beams = np.stack([np.cos(angles_rad), np.sin(angles_rad), np.zeros(BEAMS)], 1) @ lidar.matrix()[:3, :3].T
    ranges_m, _ = golden_room.ROOM.cast(lidar.matrix()[:3, 3], beams)
    matrix = np.array([[FOCAL_PX, 0, WIDTH / 2], [0, FOCAL_PX, HEIGHT / 2], [0, 0, 1]])
    observations: dict[str, Any] = {
        "image_depth": depth_m.astype(np.float32),
        "image_depth_info": {"height": HEIGHT, "width": WIDTH, "matrix_intrinsics": matrix},
        "laser": {"scans": np.stack([ranges_m, angles_rad], 1), "range_min": 0.1, "range_max": 20.0},
        "poses": {"camera": camera.record("map"), "lidar": lidar.record("map")},
    }
    return Sight(observations, base)


@pytest.fixture(scope="module")
def sights() -> list[Sight]:
    return [rendered(Pose.planar(0.1 * turn, 0.0, turn)) for turn in range(5)]


def changed(sights: Sequence[Sight], channel: str, change: Any) -> list[Sight]:
    return [Sight({**one.observations, channel: change(one.observations[channel])}, one.base) for one in sights]


def test_the_file_holds_the_boxes_where_the_world_has_them(tmp_path: Any) -> None:
    scene: Scene = golden_room.scene(tmp_path, Pose(), {"type": "sim_new"})
    geometry = load_scene(scene.folder / scene.environment["map_path"])
    assert {one.name: one.class_name for one in geometry.instances} == {
        box.name: box.class_name for box in golden_room.ROOM.boxes
    }
    for one in geometry.instances:
        corners = geometry.vertices[geometry.triangles[geometry.triangle_instance == one.index]].reshape(-1, 3)
        (box,) = (box for box in golden_room.ROOM.boxes if box.name == one.name)
        np.testing.assert_allclose((corners.min(0), corners.max(0)), (box.low, box.high), atol=1e-6)
    first, second, third = (geometry.vertices[geometry.triangles[:, corner]] for corner in range(3))
    outwards = np.cross(second - first, third - first)
    assert np.all(np.sum(outwards * geometry.normals[geometry.triangles[:, 0]], 1) > 0)


def test_what_is_there_agrees_with_the_room_and_with_itself(sights: list[Sight]) -> None:
    findings = [*check_senses(sights, ROBOT), *check_laser(sights, ROBOT)]
    assert {one.level for one in findings} == {Level.OK}, as_text(findings)
    assert len(findings) == 4


@settings(max_examples=4)
@given(right=st.integers(-4, 4), down=st.integers(-4, 4))
def test_any_shift_is_named_to_the_pixel(sights: list[Sight], right: int, down: int) -> None:
    findings = check_senses(changed(sights, "image_depth", lambda depth: np.roll(depth, (down, right), (0, 1))), ROBOT)
    (found,) = (one for one in findings if one.subject == "image_depth")
    wanted = [(right, "right" if right > 0 else "left"), (down, "bottom" if down > 0 else "top")]
    words = " and ".join(f"{abs(pixels)} px to the {way}" for pixels, way in wanted if pixels)
    assert (words or "100% of depths") in found.detail
    assert found.level is (Level.BROKEN if words else Level.OK)


@settings(max_examples=6)
@given(st.integers(50, 200).filter(lambda percent: abs(percent - 100) > 1))
def test_any_wrong_scale_is_named(sights: list[Sight], percent: int) -> None:
    findings = check_senses(changed(sights, "image_depth", lambda depth: depth * np.float32(percent / 100)), ROBOT)
    (found,) = (one for one in findings if one.subject == "image_depth")
    assert f"Depth is {percent / 100:.3g} times" in found.detail


@given(st.integers(-20, 400).filter(lambda through_cm: abs(through_cm - 5) > 1))
def test_a_robot_in_a_wall_is_told_and_one_before_it_is_not(through_cm: int) -> None:
    # The front of a panel on the wall is at 3.97 m, that of the robot 0.3 m before its centre.
    end_m = 3.97 - 0.3 + through_cm / 100
    way = [Pose.planar(x, 0.35, 0.0) for x in np.linspace(1.0, end_m, 300).tolist()]
    found = check_contact(way, collided=True, radius_m=0.3, world=golden_room.ROOM)
    assert found.level is (Level.BROKEN if through_cm > 5 else Level.OK)


def test_the_boxes_of_a_ground_truth_are_those_around_its_centroids() -> None:
    truth = {"objects": [{"class": "chair", "centroid": [1, 2, 0.5], "extent": [0.5, 0.5, 1.0]}]}
    (box,) = World.of_ground_truth(truth).boxes
    assert (box.low, box.high) == ((0.75, 1.75, 0.0), (1.25, 2.25, 1.0))
