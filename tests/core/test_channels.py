import re
from collections.abc import Iterable, Mapping
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from benchbot.core import channels
from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES, OBSERVATIONS, Observations, check_argument
from benchbot.core.declarations.schema import schema
from benchbot.core.errors import BenchbotError, FailureClass

STRUCTURED = {
    "image_rgb_info": "CameraModel",
    "image_depth_info": "CameraModel",
    "image_segment": "Segmentation",
    "image_segment_info": "CameraModel",
    "laser": "LaserScan",
    "lidar": "LidarScan",
    "imu": "InertialMeasurement",
    "joint_states": "JointStates",
    "poses": "FramePose",
}


def test_a_robot_may_connect_exactly_what_is_defined() -> None:
    offered = [name for name in OBSERVATIONS if name not in GIVEN_BY_EPISODES]
    assert schema("robot")["properties"]["connections"]["propertyNames"]["enum"] == [*offered, *ACTIONS]


def test_a_task_may_ask_for_exactly_what_is_defined() -> None:
    properties = schema("task")["properties"]
    assert properties["observations"]["items"]["enum"] == list(OBSERVATIONS)
    assert properties["actions"]["items"]["enum"] == list(ACTIONS)


def test_every_channel_has_a_type() -> None:
    assert list(Observations.__annotations__) == list(OBSERVATIONS)


@pytest.mark.parametrize("channel", [name for name in OBSERVATIONS if name not in STRUCTURED])
def test_a_plain_channel_has_the_type_that_it_is_said_to_have(channel: str) -> None:
    (dtype,) = re.findall(r"^u?(?:int|float)\d+", OBSERVATIONS[channel].value)
    assert f"np.{dtype}]" in str(Observations.__annotations__[channel])


@pytest.mark.parametrize(("channel", "name"), STRUCTURED.items())
def test_a_structured_channel_has_the_keys_and_types_that_it_is_said_to_have(channel: str, name: str) -> None:
    kind = getattr(channels, name)
    annotation = Observations.__annotations__[channel]
    assert kind in (annotation, *get_args(annotation))
    said = dict(_entries(OBSERVATIONS[channel].value))
    assert list(said) == list(kind.__annotations__)
    for key, dtype in said.items():
        if dtype:
            assert re.search(rf"\b{dtype}\b", str(kind.__annotations__[key])), key


def _entries(value: str) -> Iterable[tuple[str, str]]:
    """Yield keys and dtypes of `{frame_id, matrix: float64 (3, 3)}`, as the table of channels has it."""
    without_shapes = re.sub(
        r" \([^)]*\)", "", value.replace("{name: id}", "dict").replace("[text]", "list").replace("{frame: {", "{")
    )
    for mapping in re.findall(r"{([^}]*)}", without_shapes):
        for entry in mapping.split(", "):
            key, _, dtype = entry.partition(": ")
            if key.isidentifier():
                yield key, "" if dtype.startswith("'") else dtype


class WithSonar(Observations, total=False):
    sonar_m: NDArray[np.float32]


class Submarine:
    """A platform with a channel of its own, typed, and at once a platform of the standard channels."""

    def observe(self, names: Iterable[str]) -> WithSonar:
        return {"sonar_m": np.zeros(3, np.float32), "goal": "wreck"}


def test_a_platform_may_have_channels_of_its_own() -> None:
    seen = Submarine().observe(["sonar_m", "goal"])
    standard: Observations = seen
    anything: Mapping[str, Any] = standard
    assert seen["sonar_m"].dtype == np.float32
    assert standard["goal"] == "wreck"
    assert list(anything) == ["sonar_m", "goal"]


@pytest.mark.parametrize(
    ("action", "arguments"),
    [
        ("move_joints", {"positions": [0.1, -2, 0.0]}),
        ("move_end_effector", {"pose": (0.5, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0)}),
        ("move_gripper", {"width": 0.05}),
    ],
)
def test_arguments_of_an_arm_are_numbers_or_lists_of_them(action: str, arguments: Mapping[str, Any]) -> None:
    check_argument(action, arguments)


@pytest.mark.parametrize(
    ("action", "arguments", "why"),
    [
        ("move_joints", {"positions": 0.1}, "a list of finite numbers, as many as the arm has joints, in rad"),
        ("move_joints", {"positions": []}, "as many as"),
        ("move_joints", {}, "as many as"),
        ("move_joints", {"positions": [0.1, float("nan")]}, "finite"),
        ("move_joints", {"positions": [0.1, True]}, "numbers"),
        ("move_end_effector", {"pose": [0.5, 0.0, 0.9]}, "a list of finite numbers, 7"),
        ("move_gripper", {"width": [0.05]}, "a finite number, in m"),
        ("move_gripper", {"metres": 0.05}, "Its argument: width"),
    ],
)
def test_other_arguments_of_an_arm_are_refused(action: str, arguments: Mapping[str, Any], why: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        check_argument(action, arguments)
    assert why in caught.value.why
    assert caught.value.failure is FailureClass.AGENT
