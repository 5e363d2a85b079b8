"""What a bridge tells of its robot once: frames, description and map."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.platform import Scene
from benchbot_robot_ros2.bridge.description import urdf
from benchbot_robot_ros2.bridge.occupancy_map import read
from benchbot_robot_ros2.bridge.pace import SimulatedTime
from benchbot_robot_ros2.bridge.robot import BridgedRobot, find_scene
from benchbot_robot_ros2.bridge.transforms import mounts
from benchbot_robot_ros2.bridge.world import World
from plugins.robot_ros2.tests.bridge.bridged import CATALOG, simulator

CARTER = CATALOG.get("robots", "carter").data
SAMPLE = CATALOG.get("robots", "sample_robot").data


def mounted(robot: BridgedRobot) -> dict[str, Pose]:
    """Return the mounts of a robot that stands somewhere in the arena."""
    world = World(simulator("arena:1"), SimulatedTime(0.05), {})
    world.load(find_scene(CATALOG, SAMPLE, "arena:1"), seed=0)
    world.place(Pose.planar(0.3, 0.2, 0.4))
    return mounts(robot, world)


def test_every_frame_that_sensors_name_is_mounted_whether_its_pose_is_reported_or_not() -> None:
    frames = {"camera": {"xyz": [0, 0, 9]}, "mast": {"xyz": [0.1, 0, 1], "rpy_deg": [0, 0, 90]}}
    found = mounted(BridgedRobot({**SAMPLE, "frames": frames}, "", {}, "unused"))

    assert found.keys() == {"base_footprint", "camera", "lidar", "mast"}
    assert found["mast"] == Pose.from_xyz_rpy_deg((0.1, 0, 1), (0, 0, 90))
    # The simulator knows better than the declaration where its camera is.
    assert found["camera"].translation_xyz[2] < 1
    assert np.allclose(found["lidar"].matrix(), np.eye(4))


def test_all_frames_begin_with_the_prefix() -> None:
    robot = BridgedRobot(SAMPLE, "tb1", {}, "unused", "tb1/")
    assert set(mounted(robot)) == {"tb1/base_footprint", "tb1/camera", "tb1/lidar"}
    assert (robot.map_frame, robot.odometry_frame, robot.base_frame) == ("tb1/map", "tb1/odom", "tb1/base_link")
    assert [robot.sensor_frame(channel) for channel in ("image_rgb", "laser", "imu")] == [
        "tb1/camera",
        "tb1/lidar",
        "tb1/base_link",
    ]


@pytest.mark.parametrize(
    ("namespace", "prefix", "topics"),
    [
        ("", "", ("/tf", "/tf_static")),
        ("tb1", "tb1/", ("/tf", "/tf_static")),
        ("tb1", "", ("tf", "tf_static")),
        ("", "tb1/", ("/tf", "/tf_static")),
    ],
)
def test_a_tree_is_shared_unless_its_frames_would_collide(namespace: str, prefix: str, topics: tuple[str, str]) -> None:
    assert BridgedRobot(CARTER, namespace, {}, "unused", prefix).transform_topics == topics


def test_the_description_has_the_body_and_the_mounts() -> None:
    pose = Pose.from_xyz_rpy_deg((0.11, 0.06, 1.05), (-90, 0, -90))
    root = ET.fromstring(urdf(BridgedRobot(CARTER, "", {}, "unused", "tb1/"), {"tb1/camera_left": pose}))

    assert root.get("name") == "carter"
    assert [link.get("name") for link in root.findall("link")] == ["tb1/base_link", "tb1/camera_left"]
    cylinder = root.find("link/collision/geometry/cylinder")
    assert cylinder is not None
    assert cylinder.attrib == {"radius": "0.3", "length": "1.07"}
    origin = root.find("joint/origin")
    assert origin is not None
    assert Pose.from_xyz_rpy_deg(
        [float(value) for value in origin.attrib["xyz"].split()],
        [float(np.rad2deg(float(value))) for value in origin.attrib["rpy"].split()],
    ).matrix() == pytest.approx(pose.matrix(), abs=1e-8)


def test_a_robot_whose_height_is_not_declared_has_a_description_without_a_body() -> None:
    root = ET.fromstring(urdf(BridgedRobot({**SAMPLE, "footprint": {"radius_m": 0.2}}, "", {}, "unused"), {}))
    assert root.find("link/collision") is None


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """A scene with a map of 3 x 2 cells: occupied, unknown and free in its upper row, free below."""
    (tmp_path / "environments").mkdir()
    maps = tmp_path / "maps"
    maps.mkdir()
    Image.fromarray(np.array([[0, 205, 254], [254, 254, 254]], np.uint8)).save(maps / "hall_1.pgm")
    describe(maps / "hall_1.yaml")
    return Scene({"name": "hall", "variant": 1, "start_pose": [1, 0, 0, 0, 0, 0, 0]}, tmp_path / "environments")


def describe(path: Path, **changes: Any) -> None:
    values = {
        "image": "hall_1.pgm",
        "resolution": 0.05,
        "origin": [-1.5, 2, 0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    } | changes
    path.write_text("\n".join(f"{key}: {value}" for key, value in values.items()))


def test_a_map_begins_at_its_lowest_corner(scene: Scene) -> None:
    grid = read(scene)

    assert (grid.info.width, grid.info.height) == (3, 2)
    assert grid.info.resolution == pytest.approx(0.05)
    assert (grid.info.origin.position.x, grid.info.origin.position.y, grid.info.origin.orientation.w) == (-1.5, 2, 1)
    assert list(grid.data) == [0, 0, 0, 100, -1, 0]


def test_a_turned_map_is_published_turned(scene: Scene) -> None:
    describe(scene.folder.parent / "maps" / "hall_1.yaml", origin=[0, 0, 0.3])
    turn = read(scene).info.origin.orientation
    assert (turn.z, turn.w) == pytest.approx((np.sin(0.15), np.cos(0.15)))


def test_an_environment_may_name_its_map(scene: Scene) -> None:
    describe(scene.folder / "other.yaml", image="../maps/hall_1.pgm", resolution=0.1, negate=1)
    named = Scene({**scene.environment, "occupancy_map": "other.yaml"}, scene.folder)
    grid = read(named)
    assert grid.info.resolution == pytest.approx(0.1)
    assert list(grid.data)[3:] == [0, 100, 100]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"image": "none.pgm"}, "No such file"),
        ({"mode": "raw"}, "Its mode is 'raw'"),
        ({"origin": [0, 0]}, "Its origin is the pose of the lower left corner"),
        ({"resolution": 0}, "Its resolution is 0"),
        ({"free_thresh": "some"}, "could not convert"),
    ],
)
def test_a_map_that_cannot_be_read_is_explained(scene: Scene, changes: dict[str, Any], words: str) -> None:
    describe(scene.folder.parent / "maps" / "hall_1.yaml", **changes)
    with pytest.raises(BenchbotError, match="There is no map of hall:1 to publish") as caught:
        read(scene)
    assert words in caught.value.why


def test_a_scene_without_a_map_says_how_to_make_one(scene: Scene) -> None:
    (scene.folder.parent / "maps" / "hall_1.yaml").write_text("- no map\n")
    with pytest.raises(BenchbotError) as caught:
        read(scene)
    assert "benchbot map hall:1" in caught.value.fix


def test_what_of_a_robot_is_not_presented_is_known() -> None:
    arm = CATALOG.get("robots", "carter_arm").data
    assert set(BridgedRobot(arm, "", {}, "unused").unpresented) == {
        *("joint_states", "move_joints", "move_end_effector", "move_gripper")
    }
    assert BridgedRobot(CARTER, "", {}, "unused").unpresented == ()
