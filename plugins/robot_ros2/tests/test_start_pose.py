import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import Scene
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.guard.link import Guard
from benchbot_robot_ros2.start_pose import return_to_start

if TYPE_CHECKING:
    from rclpy.node import Node

DECLARED = """\
name: cart
type: ros2
global_frame: map
robot_frame: base_link
poses: [base_link]
footprint: {radius_m: 0.2}
connections:
  move_next: {connection: api_to_ros, ros_topic: /cmd_vel, ros_type: geometry_msgs/msg/Twist}
driver:
  odometry: {ros_topic: /odom, ros_type: nav_msgs/msg/Odometry}
"""
# At x = 1.2, y = 1.5, and turned by 90° to the right.
SCENE = {"name": "lab", "variant": 2, "start_pose": [0.70710678, 0, 0, -0.70710678, 1.2, 1.5, 0]}


def cart(wait_s: float = 30.0, **return_to_start: Any) -> Ros2Robot:
    document = yaml.safe_load(DECLARED)
    document["driver"] |= {"return_to_start": return_to_start, "timing": {"wait_s": wait_s}}
    return Ros2Robot.from_declaration(document)


def scene(name: str = "lab") -> Scene:
    return Scene(SCENE | {"name": name}, Path())


class Standing:
    """A guard of a robot that stands still: it notes what it is asked."""

    tripped: str | None = None

    def command(self, linear_mps: float, angular_radps: float) -> None:
        raise BenchbotError("Stopped.", str(self.tripped), "", ends_run=True)

    def stop(self, why: str) -> None:
        self.tripped = why


@dataclass
class Servers:
    """What the robot's process said; `until` waits for it to say something with a key, and returns that."""

    process: subprocess.Popen[str]
    said: list[dict[str, Any]] = field(default_factory=list)

    def until(self, key: str) -> Any:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append(json.loads(line))
            if key in self.said[-1]:
                return self.said[-1][key]
        raise AssertionError(f"the robot's process ended before it said {key}: {self.said}")


@pytest.fixture
def servers(domain: int) -> Iterator[Servers]:
    script = Path(__file__).with_name("returning_robot.py")
    with subprocess.Popen(
        [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            robot = Servers(process)
            robot.until("ready")
            yield robot
        finally:
            process.kill()


@pytest.fixture
def node(domain: int) -> "Iterator[Node]":
    with ros.running_node("benchbot") as node:
        yield node


@pytest.fixture
def back(node: "Node") -> Callable[..., Standing]:
    """Returns a robot to the start of a scene; returns its guard, or raises."""

    def back(robot: Ros2Robot, at: Scene | None = None, *, seed: int = 7, way_s: float = 30.0) -> Standing:
        guard = Standing()
        return_to_start(node, robot, at or scene(), seed, None, guard, way_s=way_s)
        return guard

    return back


def test_a_service_is_told_the_scene_and_called_and_its_failures_are_told_in_its_words(
    servers: Servers, back: Callable[..., Standing]
) -> None:
    back(cart(by="service", ros_service="/home/well", scene_node="/scenes"))
    servers.until("home")
    told = {name: value for line in servers.said for name, value in line.get("parameters", {}).items()}
    assert told == {"environment": "lab:2", "start_pose": SCENE["start_pose"], "seed": 7}

    with pytest.raises(BenchbotError, match="'cart' did not return") as caught:
        back(cart(by="service", ros_service="/home/refused"))
    assert caught.value.why == "The service /home/refused answered: the brake is on"
    assert caught.value.failure is FailureClass.PLATFORM

    with pytest.raises(BenchbotError, match=r"did not answer within 0\.5 s"):
        back(cart(by="service", ros_service="/home/silent"), way_s=0.5)

    with pytest.raises(BenchbotError, match="went away meanwhile"):
        back(cart(by="service", ros_service="/home/leaving"))

    with pytest.raises(BenchbotError, match="does not take environment = moon:2: no environment is called moon"):
        back(cart(by="service", ros_service="/home/well", scene_node="/scenes"), scene("moon"))


def test_navigation_is_sent_to_the_start_in_the_map_and_says_why_it_does_not_arrive(
    servers: Servers, back: Callable[..., Standing]
) -> None:
    guard = back(cart(by="navigation", ros_action="/go/well"))
    assert guard.tripped is None
    frame, *numbers = servers.until("goal")
    assert frame == "map"
    assert numbers == pytest.approx([1.2, 1.5, -0.7071068, 0.7071068])

    with pytest.raises(BenchbotError, match="refused the goal") as caught:
        back(cart(by="navigation", ros_action="/go/refused"))
    assert caught.value.failure is FailureClass.PLATFORM

    with pytest.raises(BenchbotError, match=r"was given up \(error 208: no path to the goal\)"):
        back(cart(by="navigation", ros_action="/go/given_up"))


def test_navigation_without_end_is_called_off_or_the_robot_stopped_for_good(
    servers: Servers, back: Callable[..., Standing]
) -> None:
    with pytest.raises(BenchbotError, match=r"still on its way after 0\.5 s") as caught:
        back(cart(by="navigation", ros_action="/go/for_ever"), way_s=0.5)
    assert servers.until("cancelled") == "for_ever"
    assert not caught.value.ends_run

    # The two know each other by now, so that a second is time enough.
    with pytest.raises(BenchbotError, match=r"still on its way .* Nav2 did not confirm") as caught:
        back(cart(wait_s=1, by="navigation", ros_action="/go/never_cancelled"), way_s=0.5)
    assert caught.value.ends_run

    with pytest.raises(BenchbotError, match=r"did not answer within 1 s\. Nav2 did not confirm") as caught:
        back(cart(wait_s=1, by="navigation", ros_action="/go/silent"))
    assert caught.value.ends_run


def test_a_safety_stop_calls_the_navigation_off(servers: Servers, node: "Node") -> None:
    robot = cart(by="navigation", ros_action="/go/for_ever")
    guard = Guard.start(robot, MotionConfig())
    try:

        def press() -> None:
            servers.until("goal")
            guard.stop("Somebody pressed the button.")

        person = threading.Thread(target=press)
        person.start()
        with pytest.raises(BenchbotError, match="Somebody pressed the button") as caught:
            return_to_start(node, robot, scene(), 0, None, guard)
        person.join()
        assert caught.value.ends_run
        assert servers.until("cancelled") == "for_ever"
    finally:
        guard.close()


@pytest.mark.parametrize(
    ("way", "missing"),
    [
        ({"by": "service", "ros_service": "/home"}, r"No service /home is there\. 0\.3 s"),
        ({"by": "service", "ros_service": "/home", "scene_node": "/me"}, "No service /me/set_parameters is there"),
        ({"by": "navigation"}, "No action server /navigate_to_pose is there"),
    ],
)
def test_a_missing_server_is_named(back: Callable[..., Standing], way: dict[str, Any], missing: str) -> None:
    with pytest.raises(BenchbotError, match=missing) as caught:
        back(cart(wait_s=0.3, **way))
    assert "benchbot doctor --robot cart" in caught.value.fix


def test_without_nav2_msgs_it_says_what_to_install(
    back: Callable[..., Standing], monkeypatch: pytest.MonkeyPatch
) -> None:
    # What Python finds when a package is not installed.
    monkeypatch.setitem(sys.modules, "nav2_msgs.action", None)
    with pytest.raises(BenchbotError, match="nav2_msgs") as caught:
        back(cart(by="navigation"))
    assert "ros-jazzy-nav2-msgs" in caught.value.fix


def test_an_operator_is_asked_in_metres_and_degrees(node: "Node") -> None:
    asked: list[str] = []
    return_to_start(node, cart(by="operator"), scene(), 0, asked.append, Standing())
    assert asked == [
        "Put cart at x = 1.20 m, y = 1.50 m, heading -90° in the map of lab:2, then say so with: benchbot ready"
    ]


def test_without_an_operator_it_says_what_there_was_to_do(back: Callable[..., Standing]) -> None:
    with pytest.raises(BenchbotError, match=r"x = 1\.20 m, y = 1\.50 m, heading -90°.* nobody is there") as caught:
        back(cart(by="operator"))
    assert caught.value.failure is FailureClass.PLATFORM
