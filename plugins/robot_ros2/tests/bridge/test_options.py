"""The options of `benchbot bridge ros2`, and what it says when other nodes do not fit to it."""

import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Any

import pytest
from tf2_msgs.msg import TFMessage

from benchbot.core.declarations import schema
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.messages import message_type
from plugins.robot_ros2.tests.bridge.bridged import DEADLINE_S, SAMPLE, Listener, bridge, listener, until
from tests.conftest import SAMPLE_PLUGIN
from tests.plugin_factory import DECLARES, PluginFactory

pytestmark = pytest.mark.xdist_group("robots 1")

ODOMETRY = ("/odom", "nav_msgs/msg/Odometry")
TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


class Said:
    """The lines that a bridge prints, as they come."""

    def __init__(self, process: Any) -> None:
        self._lines: Queue[str] = Queue()
        Thread(target=self._read, args=(process.stderr,), daemon=True).start()

    def _read(self, stream: Any) -> None:
        for line in stream:
            self._lines.put(line)

    def line_with(self, words: str, meanwhile: Callable[[], None] = lambda: None) -> str:
        """Wait for a line with these words, and do something again and again meanwhile."""
        deadline_s = time.monotonic() + DEADLINE_S
        while time.monotonic() < deadline_s:
            meanwhile()
            with suppress(Empty):
                if words in (line := self._lines.get(timeout=0.1)):
                    return line
        raise AssertionError(f"nothing said of: {words}")

    @property
    def nothing_more(self) -> bool:
        return self._lines.empty()


def moves(robot: Listener) -> bool:
    return bool(robot.newer(*ODOMETRY).twist.twist.linear.x > 0)


def stamped(linear_mps: float, sec: int = 0) -> Any:
    message = message_type(STAMPED)()
    message.twist.linear.x, message.header.stamp.sec = linear_mps, sec
    return message


@pytest.fixture
def publishing(domain: int) -> Iterator[Listener]:
    with listener() as robot:
        yield robot


@pytest.mark.parametrize(
    ("option", "ours", "theirs", "fix"),
    [((), TWIST, STAMPED, "with --stamped"), (("--stamped",), STAMPED, TWIST, "without --stamped")],
)
def test_a_velocity_of_the_other_type_is_told_once_with_node_types_and_fix(
    publishing: Listener, option: tuple[str, ...], ours: str, theirs: str, fix: str
) -> None:
    with bridge(*SAMPLE, *option) as process:
        said = Said(process)
        publishing.node.create_publisher(message_type(theirs), "/cmd_vel", 1)
        line = said.line_with("cmd_vel")
        assert f"The node /listener publishes {theirs} on /cmd_vel, and this bridge obeys {ours}" in line
        assert f"Start the bridge {fix}, or let the node publish {ours}" in line
        publishing.node.create_subscription(message_type("sensor_msgs/msg/PointCloud2"), "/scan", print, 1)
        # What is told after it shows that the graph was looked at once more.
        line = said.line_with("/scan")
        assert "The node /listener expects sensor_msgs/msg/PointCloud2 on /scan" in line
        assert "publishes sensor_msgs/msg/LaserScan" in line
        publishing.node.create_subscription(message_type("sensor_msgs/msg/Imu"), "/camera/color/image_raw", print, 1)
        said.line_with("/camera/color/image_raw")
        assert said.nothing_more


def test_a_stamped_bridge_obeys_what_is_stamped_now_and_says_what_is_not(publishing: Listener) -> None:
    with bridge(*SAMPLE, "--stamped") as process:
        said = Said(process)
        publisher = publishing.node.create_publisher(message_type(STAMPED), "/cmd_vel", 1)
        until(publisher.get_subscription_count, "somebody obeys")

        # The time of a computer's clock, as of a node that does not use simulated time.
        late = partial(publisher.publish, stamped(0.2, sec=1_800_000_000))
        line = said.line_with("A velocity is not obeyed", meanwhile=late)
        assert "after the robot's time" in line
        assert "use_sim_time: true" in line
        assert not moves(publishing)

        until(lambda: publisher.publish(stamped(0.2)) or moves(publishing), "a velocity without a stamp is obeyed")


def test_localisation_is_left_to_others(publishing: Listener) -> None:
    links: list[tuple[str, str]] = []

    def hear(message: Any) -> None:
        links.extend((transform.header.frame_id, transform.child_frame_id) for transform in message.transforms)

    with bridge(*SAMPLE, "--no-map-transform"):
        publishing.node.create_subscription(TFMessage, "/tf", hear, 100)
        until(lambda: len(links) > 20, "transforms")
    assert set(links) == {("odom", "base_link")}


def test_frames_without_prefix_in_a_namespace_are_a_tree_there(publishing: Listener) -> None:
    heard: list[Any] = []
    with bridge(*SAMPLE, "--namespace", "tb1", "--frame-prefix", ""):
        publishing.node.create_subscription(TFMessage, "/tb1/tf", heard.append, 100)
        publishing.node.create_subscription(TFMessage, "/tb1/tf_static", heard.append, qos.latched())
        until(lambda: len(heard) > 5, "transforms")
        assert publishing.node.count_publishers("/tf") == 0
    frames = {transform.child_frame_id for message in heard for transform in message.transforms}
    assert frames >= {"odom", "base_link"}


@pytest.fixture
def halls(plugin_factory: PluginFactory) -> str:
    """A plug-in with two variants of the arena, hall:1 and hall:2, each with a map of its own; the path to it."""
    arena = Path(SAMPLE_PLUGIN) / "benchbot_sample" / "environments" / "arena_1.yaml"
    data = schema.read(arena)
    place = {**data, "name": "hall", "map_path": str((arena.parent / data["map_path"]).resolve())}
    about = {"image": "hall.pgm", "resolution": 2, "origin": [-3, -2, 0], "occupied_thresh": 0.65, "free_thresh": 0.196}
    made = {"maps/hall.pgm": "P2 3 2 255 0 205 254 254 254 254\n"}
    for variant, negate in ((1, 0), (2, 1)):
        made[f"environments/hall_{variant}.yaml"] = json.dumps({**place, "variant": variant})
        made[f"maps/hall_{variant}.yaml"] = json.dumps({**about, "negate": negate})
    plugin_factory.make("halls", DECLARES.format(kind="environments"), made)
    return os.pathsep.join([str(plugin_factory.folder), os.environ["PYTHONPATH"]])


def test_a_map_is_there_for_who_comes_late_by_topic_and_by_service(publishing: Listener, halls: str) -> None:
    from nav_msgs.srv import GetMap

    grids: list[Any] = []
    with bridge("--robot", "sample_robot", "--env", "hall:1", "--map", PYTHONPATH=halls):
        kind = message_type("nav_msgs/msg/OccupancyGrid")
        publishing.node.create_subscription(kind, "/map", grids.append, qos.latched())
        until(lambda: grids, "the map")
        assert (grids[0].header.frame_id, list(grids[0].data)) == ("map", [0, 0, 0, 100, -1, 0])
        assert publishing.call(GetMap, "/map_server/map", GetMap.Request()).map == grids[0]
        # In another scene there is another map, and none where the scene has none: the robot stays.
        assert publishing.reset(environment="hall:2").success
        until(lambda: len(grids) > 1, "the other map")
        assert list(grids[1].data) == [100, 100, 100, 0, 100, 100]
        answer = publishing.reset(environment="arena:1")
        assert "There is no map of arena:1 to publish." in answer.message
        assert publishing.call(GetMap, "/map_server/map", GetMap.Request()).map.data == grids[1].data


def test_a_scene_without_a_map_is_refused_in_words(domain: int) -> None:
    with pytest.raises(AssertionError, match="There is no map of arena:1 to publish"), bridge(*SAMPLE, "--map"):
        pass


def test_where_no_declared_robot_fits_it_is_said_how_to_make_one(domain: int) -> None:
    with bridge(*SAMPLE) as process:
        said = Said(process)
        assert "No installed robot of type ros2 fits it" in said.line_with("No installed")
        assert "benchbot show robot carter_ros2 > my_robot.yaml" in said.line_with("Make one")
