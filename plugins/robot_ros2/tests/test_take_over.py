"""A person takes the robot over in the middle of an action, and gives it back."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot_robot_ros2.driver import Ros2Driver
from plugins.robot_ros2.tests.system.chain import has_passed
from plugins.robot_ros2.tests.unicycle import BY_TRUTH, Unicycle, act, declaration, driver, scene, unicycle, until

pytestmark = pytest.mark.usefixtures("domain")

JOYSTICK = {"ros_topic": "/joy", "ros_type": "sensor_msgs/msg/Joy", "button": 1, "timeout_s": 3.0}
HELD_S = 10.0


def robot(**driver: Any) -> dict[str, Any]:
    safety = {"take_over": JOYSTICK} | driver.pop("safety", {})
    return declaration(safety=safety, **driver)


@contextmanager
def in_the_middle(there: Unicycle, *phases: dict[str, Any], held_s: float = 6.0) -> Iterator[None]:
    """Let a person take the robot over once it has come 0.3 m, for as long in each phase, and give it back."""

    def takes() -> None:
        until(lambda: there.state["x"] > 0.3)
        try:
            for phase in phases:
                there.set(**phase)
                until(has_passed(there, held_s / len(phases)))
        finally:
            there.set(hand=None)

    person = threading.Thread(target=takes)
    person.start()
    try:
        yield
    finally:
        person.join()


def walk(platform: Ros2Driver, declared: dict[str, Any], distance_m: float) -> Outcome:
    """Walk, with less time for it than a person has the robot."""
    config = replace(MotionConfig.from_robot(declared, "ground_truth"), phase_timeout_s=HELD_S - 0.5)
    return execute(platform, "move_distance", {"distance": distance_m}, None, config)


def test_the_action_waits_and_goes_on_to_the_same_goal_and_its_time_does_not_run_out(tmp_path: Path) -> None:
    declared = robot(localisation=BY_TRUTH)
    with unicycle() as there, driver(declared, tmp_path) as platform:
        platform.load(scene(), 0)
        with in_the_middle(there, {"hand": (-0.3, 0.0)}, {"hand": (0.0, 0.0)}, held_s=HELD_S):
            assert walk(platform, declared, 1.2) is Outcome.REACHED
        assert there.state["x"] == pytest.approx(1.2, abs=0.02)
        assert there.state["backwards_m"] > 0.2
        assert there.state["heard_under_hand"] == 0
        (held_s,) = platform.taken_over_s()
        assert held_s > HELD_S - 0.5
        assert platform.clock() < held_s + HELD_S
        assert platform.taken_over_s() == ()


def test_a_robot_that_was_carried_is_believed_where_it_is_now(tmp_path: Path) -> None:
    declared = robot(localisation=BY_TRUTH)
    with unicycle() as there, driver(declared, tmp_path) as platform:
        platform.load(scene(), 0)
        # Its wheels have not turned for the metre that it is ahead: a jump that would stop it at any other time.
        with in_the_middle(there, {"hand": (0.0, 0.0)}, {"place_off_m": 1.0}):
            assert act(platform, declared, "move_distance", distance=2.0) is Outcome.REACHED
        assert platform.pose().translation_xyz[0] == pytest.approx(2.0, abs=0.02)
        assert there.state["x"] == pytest.approx(1.0, abs=0.02)


def test_what_a_person_touches_is_no_collision_of_the_episode(tmp_path: Path) -> None:
    bumper = {"ros_topic": "/hazards", "ros_type": "irobot_create_msgs/msg/HazardDetectionVector"}
    declared = robot(safety={"collision": bumper | {"field": "detections[].type", "equals": [1]}})
    with unicycle() as there, driver(declared, tmp_path) as platform:
        platform.load(scene(), 0)

        with in_the_middle(there, {"hand": (-0.3, 0.0)}, {"hazards": [1]}, {"hazards": [], "hand": (0.0, 0.0)}):
            assert act(platform, declared, "move_distance", distance=0.8) is Outcome.REACHED
        assert not platform.collided


def test_a_joystick_that_falls_silent_while_it_is_held_stops_the_robot_for_good(tmp_path: Path) -> None:
    with unicycle() as there, driver(robot(), tmp_path) as platform:
        platform.load(scene(), 0)
        there.set(hand=(0.0, 0.0))

        def falls_silent() -> None:
            there.set(silent=["/joy"])

        silence = threading.Timer(1.0, falls_silent)
        silence.start()
        with pytest.raises(BenchbotError, match="stopped for safety") as caught:
            act(platform, robot(), "move_distance", distance=1.0)
        silence.join()
        assert "The take-over switch fell silent" in caught.value.why
        assert caught.value.ends_run


def test_a_stop_ends_the_wait(tmp_path: Path) -> None:
    with unicycle() as there, driver(robot(), tmp_path) as platform:
        platform.load(scene(), 0)
        there.set(hand=[0.0, 0.0])
        stopping = threading.Timer(3.0, lambda: platform.halt("Enough."))
        stopping.start()
        with pytest.raises(BenchbotError, match="stopped for safety"):
            act(platform, robot(), "move_distance", distance=2.0)
        stopping.join()
        assert there.state["x"] < 0.5


def begin_and_walk(platform: Ros2Driver, declared: dict[str, Any]) -> None:
    platform.load(scene(), 0)
    act(platform, declared, "move_distance", distance=0.5)


def test_a_joystick_without_the_button_stops_the_robot_and_is_no_switch_that_is_never_held(tmp_path: Path) -> None:
    declared = robot(safety={"take_over": JOYSTICK | {"button": 7}})
    with unicycle(), driver(declared, tmp_path) as platform, pytest.raises(BenchbotError) as caught:
        begin_and_walk(platform, declared)
    assert "its switch is button 7, of 2" in caught.value.why


def test_a_joystick_that_is_not_there_is_missed_before_the_robot_moves(tmp_path: Path) -> None:
    with (
        unicycle(absent=["/joy"]),
        driver(robot(timing={"wait_s": 1.0}), tmp_path) as platform,
        pytest.raises(BenchbotError, match="has no take-over switch"),
    ):
        platform.load(scene(), 0)
