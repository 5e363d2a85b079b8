import math
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.geometry import Pose
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.transforms import HISTORY_NS, TransformTree, interpolate, listen

SECOND = 1_000_000_000


def close(a: Pose, b: Pose) -> bool:
    return bool(np.allclose(a.matrix(), b.matrix(), atol=1e-6))


def turned_deg(a: Pose, b: Pose) -> float:
    return math.degrees(2 * math.acos(min(1.0, abs((a.inverse() @ b).rotation_xyzw[3]))))


def unit(values: Sequence[float]) -> tuple[float, float, float, float]:
    x, y, z, w = np.asarray(values) / np.linalg.norm(values)
    return (float(x), float(y), float(z), float(w))


coordinates = st.floats(-100, 100)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: float(np.linalg.norm(values)) > 0.1).map(unit)
poses = st.builds(Pose, st.tuples(coordinates, coordinates, coordinates), quaternions)


@pytest.fixture
def tree() -> TransformTree:
    """A robot that drives from x = 0 to x = 2 m in odometry within a second, and turns left by 90°."""
    tree = TransformTree()
    tree.set_transform("map", "odom", Pose.planar(10, 0, 0), 5 * SECOND)
    tree.set_transform("map", "odom", Pose.planar(10, 0, 0), 7 * SECOND)
    tree.set_transform("odom", "base_link", Pose.planar(0, 0, 0), 5 * SECOND)
    tree.set_transform("odom", "base_link", Pose.planar(2, 0, math.pi / 2), 6 * SECOND)
    tree.set_transform("base_link", "camera", Pose((0.1, 0, 1)), None)
    return tree


def test_a_chain_is_followed_through_static_and_moving_frames(tree: TransformTree) -> None:
    assert close(tree.lookup("map", "camera", 6 * SECOND), Pose.planar(12, 0.1, math.pi / 2, z=1))


def test_between_two_stamps_the_robot_is_half_way_and_half_turned(tree: TransformTree) -> None:
    assert close(tree.lookup("odom", "base_link", 5_500_000_000), Pose.planar(1, 0, math.pi / 4))


def test_without_a_time_it_is_the_newest_that_the_whole_chain_knows(tree: TransformTree) -> None:
    tree.set_transform("odom", "base_link", Pose.planar(4, 0, 0), 9 * SECOND)
    assert tree.newest_ns("map", "camera") == 7 * SECOND
    assert close(tree.lookup("map", "base_link"), tree.lookup("map", "base_link", 7 * SECOND))


def test_static_frames_are_known_at_any_time_and_have_no_newest(tree: TransformTree) -> None:
    assert tree.lookup("base_link", "camera", 123 * SECOND) == Pose((0.1, 0, 1))
    assert tree.newest_ns("camera", "base_link") is None


def test_a_frame_is_where_it_is_in_itself(tree: TransformTree) -> None:
    assert tree.lookup("camera", "camera", None) == Pose()


def test_frames_may_be_written_as_ros_1_did(tree: TransformTree) -> None:
    assert tree.lookup("/base_link", "/camera") == tree.lookup("base_link", "camera")


@pytest.mark.parametrize(("stamp_s", "says"), [(6.25, "0.250 s after"), (4.5, "0.500 s before")])
def test_outside_of_what_is_known_it_says_by_how_much(tree: TransformTree, stamp_s: float, says: str) -> None:
    with pytest.raises(LookupError, match=rf"'base_link' in 'odom' is known from 5\.000 s to 6\.000 s.* {says}"):
        tree.lookup("odom", "camera", int(stamp_s * SECOND))


def test_an_unknown_frame_is_named_with_the_nearest_known(tree: TransformTree) -> None:
    with pytest.raises(LookupError, match=r"'base_lnk'\. Did you mean 'base_link'\? Known: base_link, camera, map, od"):
        tree.lookup("map", "base_lnk")


def test_an_empty_tree_says_that_nothing_came() -> None:
    with pytest.raises(LookupError, match="nothing has been received"):
        TransformTree().lookup("map", "base_link")


def test_two_trees_are_named_by_their_roots(tree: TransformTree) -> None:
    tree.set_transform("world", "marker", Pose(), None)
    with pytest.raises(LookupError, match=r"where 'marker' is in 'camera'.*two trees, under 'world' and 'map'"):
        tree.lookup("camera", "marker")


def test_frames_that_go_round_in_a_circle_are_an_error_not_a_hang(tree: TransformTree) -> None:
    tree.set_transform("camera", "map", Pose(), 6 * SECOND)
    with pytest.raises(LookupError, match=r"round in a circle: .*'map' in 'camera'"):
        tree.lookup("odom", "camera")


def test_a_frame_with_a_new_parent_leaves_the_old_one_and_its_history(tree: TransformTree) -> None:
    tree.set_transform("map", "base_link", Pose.planar(3, 3, 0), 8 * SECOND)
    assert tree.lookup("map", "base_link") == Pose.planar(3, 3, 0)
    with pytest.raises(LookupError, match="before"):
        tree.lookup("map", "base_link", 6 * SECOND)


def test_a_frame_that_was_static_may_move(tree: TransformTree) -> None:
    tree.set_transform("base_link", "camera", Pose((0, 0, 2)), 6 * SECOND)
    assert tree.lookup("odom", "camera").translation_xyz[2] == 2


def test_ten_seconds_are_remembered() -> None:
    tree = TransformTree()
    for second in range(30):
        tree.set_transform("odom", "base_link", Pose((second, 0, 0)), second * SECOND)
    assert tree.lookup("odom", "base_link", 29 * SECOND - HISTORY_NS).translation_xyz[0] == 19
    with pytest.raises(LookupError):
        tree.lookup("odom", "base_link", 18 * SECOND)


def test_a_clock_that_was_set_back_starts_a_new_history(tree: TransformTree) -> None:
    tree.set_transform("odom", "base_link", Pose((1, 0, 0)), 100 * SECOND)
    tree.set_transform("odom", "base_link", Pose((2, 0, 0)), 3 * SECOND)
    assert tree.newest_ns("odom", "base_link") == 3 * SECOND


def test_clearing_leaves_the_mounts(tree: TransformTree) -> None:
    tree.clear()
    assert tree.lookup("base_link", "camera") == Pose((0.1, 0, 1))
    with pytest.raises(LookupError):
        tree.lookup("odom", "base_link")


@pytest.mark.parametrize(
    ("parent", "child", "pose"),
    [
        ("a", "a", Pose()),
        ("", "a", Pose()),
        ("a", "/", Pose()),
        ("a", "b", Pose((math.nan, 0, 0))),
        ("a", "b", Pose(rotation_xyzw=(0, 0, 0, 0))),
        ("a", "b", Pose(rotation_xyzw=(0, 0, 0.5, 0.5))),
    ],
)
def test_what_is_no_transform_is_refused(parent: str, child: str, pose: Pose) -> None:
    with pytest.raises(ValueError, match="transform from"):
        TransformTree().set_transform(parent, child, pose, None)


@given(st.lists(poses, min_size=1, max_size=6))
def test_a_chain_is_the_product_of_its_links(links: list[Pose]) -> None:
    tree = TransformTree()
    product = Pose()
    for number, link in enumerate(links):
        tree.set_transform(f"f{number}", f"f{number + 1}", link, SECOND if number % 2 else None)
        product = product @ link
    assert close(tree.lookup("f0", f"f{len(links)}"), product)


@given(st.data())
def test_in_any_tree_ways_compose_and_turn_round(data: st.DataObject) -> None:
    tree = TransformTree()
    count = data.draw(st.integers(2, 8))
    for child in range(1, count):
        parent = data.draw(st.integers(0, child - 1))
        tree.set_transform(f"f{parent}", f"f{child}", data.draw(poses), SECOND)
    a, b, c = (f"f{data.draw(st.integers(0, count - 1))}" for _ in range(3))
    assert close(tree.lookup(a, c), tree.lookup(a, b) @ tree.lookup(b, c))
    assert close(tree.lookup(a, b), tree.lookup(b, a).inverse())


@given(poses, poses, st.floats(0, 1))
def test_interpolation_turns_evenly_between_its_ends(start: Pose, end: Pose, fraction: float) -> None:
    assert close(interpolate(start, end, 0), start)
    assert close(interpolate(start, end, 1), end)
    between = interpolate(start, end, fraction)
    assert turned_deg(start, between) == pytest.approx(fraction * turned_deg(start, end), abs=1e-3)
    assert math.dist(start.translation_xyz, between.translation_xyz) == pytest.approx(
        fraction * math.dist(start.translation_xyz, end.translation_xyz), abs=1e-6
    )


@given(st.dictionaries(st.integers(0, 9 * SECOND), poses, min_size=1, max_size=8), st.randoms(use_true_random=False))
def test_the_order_of_arrival_does_not_matter(samples: dict[int, Pose], random: Any) -> None:
    shuffled = list(samples)
    random.shuffle(shuffled)
    tree = TransformTree()
    for stamp in shuffled:
        tree.set_transform("odom", "base_link", samples[stamp], stamp)
    for stamp, pose in samples.items():
        assert close(tree.lookup("odom", "base_link", stamp), pose)


def test_what_is_published_is_listened_to_also_before_one_listened(domain: int) -> None:
    from geometry_msgs.msg import TransformStamped
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from tf2_msgs.msg import TFMessage

    def message(parent: str, child: str, x: float, w: float = 1.0) -> Any:
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id = parent
        transform.header.stamp.sec, transform.header.stamp.nanosec = 3, 500_000_000
        transform.transform.translation.x, transform.transform.rotation.w = x, w
        return TFMessage(transforms=[transform])

    with ros.running_node("robot") as robot, ros.running_node("benchbot") as node:
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        robot.create_publisher(TFMessage, "/tf_static", latched).publish(message("base_link", "lidar", 0.25))
        moving = robot.create_publisher(TFMessage, "/tf", 10)
        tree = listen(node)
        assert tree is not None
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            # One without a rotation, as some drivers send, takes nothing else down.
            moving.publish(message("odom", "wheel", 1.0, w=0.0))
            moving.publish(message("odom", "base_link", 2.0))
            try:
                pose = tree.lookup("odom", "lidar")
                break
            except LookupError:
                time.sleep(0.02)
        assert pose.translation_xyz == (2.25, 0, 0)
        assert tree.newest_ns("odom", "lidar") == 3_500_000_000
        with pytest.raises(LookupError, match="wheel"):
            tree.lookup("odom", "wheel")


def test_without_tf2_msgs_there_is_no_tree(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # What Python finds when a package is not installed.
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", None)
    with ros.running_node("benchbot") as node:
        assert listen(node) is None
