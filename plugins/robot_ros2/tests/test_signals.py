"""Topics that say yes or no, by a field of a message of any type."""

from pathlib import Path
from typing import Any

import pytest
from irobot_create_msgs.msg import HazardDetection, HazardDetectionVector
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Bool

from benchbot.core.errors import BenchbotError
from benchbot.core.motion import Outcome
from benchbot_robot_ros2.declaration_keys import Signal
from benchbot_robot_ros2.signals import says
from plugins.robot_ros2.tests.unicycle import act, declaration, driver, scene, unicycle, until

HAZARDS = "irobot_create_msgs/msg/HazardDetectionVector"
BUMPER = {"ros_topic": "/hazards", "ros_type": HAZARDS, "field": "detections[].type", "equals": [1]}


def hazards(*types: int) -> HazardDetectionVector:
    return HazardDetectionVector(detections=[HazardDetection(type=kind) for kind in types])


@pytest.mark.parametrize(
    ("field", "equals", "message", "yes"),
    [
        ("data", (), Bool(data=True), True),
        ("data", (), Bool(data=False), False),
        ("data", (False,), Bool(data=False), True),  # a button that opens its circuit
        ("detections[].type", (1, 3), hazards(0, 3), True),
        ("detections[].type", (1, 3), hazards(0, 2), False),
        ("detections[].type", (1, 3), hazards(), False),
        ("buttons[]", (), Joy(buttons=[0, 0, 1]), True),
        ("buttons[]", (), Joy(buttons=[0, 0]), False),
        ("header.frame_id", ("stuck",), JointState(), False),
    ],
)
def test_a_signal_says_yes_by_a_field(field: str, equals: tuple[Any, ...], message: Any, yes: bool) -> None:
    assert says(Signal(ros_topic="/t", ros_type="", field=field, equals=equals), message) is yes


@pytest.mark.parametrize(
    ("signal", "why"),
    [
        ({"field": "detection[].type"}, "there is no 'detection' among header, detections Did you mean 'detections'?"),
        ({"field": "detections.type"}, "'detections' is a list, and has no [] behind it"),
        ({"field": "header[].stamp"}, "'header' is no list, and has a [] behind it"),
        ({"field": "detections[]"}, "it is a irobot_create_msgs/msg/HazardDetection, which has parts"),
        ({"field": "detections[].type.kind"}, "'kind' is asked of a uint8, which has no parts"),
        ({"field": "data"}, "there is no 'data' among header, detections"),
    ],
)
def test_a_field_that_is_not_there_is_refused_before_anything_is_started(
    tmp_path: Path, signal: dict[str, Any], why: str
) -> None:
    robot = declaration(safety={"collision": BUMPER | signal})
    with pytest.raises(BenchbotError, match=r"wrong at 'driver\.safety\.collision'") as caught, driver(robot, tmp_path):
        pass
    assert why in caught.value.why


def test_a_type_that_is_not_installed_is_told_with_its_package(tmp_path: Path) -> None:
    robot = declaration(safety={"e_stop": BUMPER | {"ros_type": "kobuki_ros_interfaces/msg/BumperEvent"}})
    with pytest.raises(BenchbotError, match="kobuki_ros_interfaces is not installed"), driver(robot, tmp_path):
        pass


@pytest.mark.usefixtures("domain")
def test_a_bump_among_hazards_is_contact_and_a_backup_limit_is_none(tmp_path: Path) -> None:
    robot = declaration(safety={"collision": BUMPER})
    with unicycle(hazards=[0]) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        assert act(platform, robot, "move_distance", distance=0.2) is Outcome.REACHED
        # Its messages have no stamp: each counts all the same.
        there.set(hazards=[0, 1])
        until(lambda: platform.collided)
        assert act(platform, robot, "move_distance", distance=0.2) is Outcome.COLLIDED


@pytest.mark.usefixtures("domain")
def test_an_emergency_stop_of_another_type_stops_the_robot(tmp_path: Path) -> None:
    wheel_drop = BUMPER | {"equals": [4]}
    robot = declaration(safety={"e_stop": wheel_drop})
    with unicycle(hazards=[1]) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        assert act(platform, robot, "move_distance", distance=0.2) is Outcome.REACHED
        there.set(strike={"beyond_m": 0.05, "set": {"hazards": [1, 4]}})
        with pytest.raises(BenchbotError, match="stopped for safety") as caught:
            act(platform, robot, "move_distance", distance=3.0)
        assert caught.value.why == "The emergency stop is pressed."
        until(lambda: there.state["v"] == 0.0)
