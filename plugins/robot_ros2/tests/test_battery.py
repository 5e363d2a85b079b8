"""The battery: a trial does not begin when it is low, and a run's log says so while it is."""

import math
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import BatteryState

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.motion import Outcome
from benchbot_robot_ros2 import battery
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import Battery
from plugins.robot_ros2.tests.unicycle import act, declaration, driver, scene, unicycle, until

BATTERY = {"ros_topic": "/battery", "minimum": 0.3}


@pytest.mark.parametrize(
    ("percentage", "full", "why"),
    [
        (0.3, 1.0, None),
        (1.0, 1.0, None),
        (55.0, 100.0, None),
        (0.29, 1.0, "it has 29%, 12.0 V, and 30% is asked for"),
        (20.0, 100.0, "it has 20%"),
        (55.0, 1.0, "its percentage is 55, and 1 is full"),
        (-1.0, 1.0, "its percentage is -1"),
        (math.nan, 1.0, "it does not say how full it is"),
    ],
)
def test_what_is_wrong_with_a_battery(percentage: float, full: float, why: str | None) -> None:
    said = battery.problem(
        Battery(ros_topic="/battery", minimum=0.3, full=full), BatteryState(percentage=percentage, voltage=12.0)
    )
    assert said == why or (why is not None and said is not None and said.startswith(why))


@pytest.mark.parametrize(
    ("voltage", "why"), [(11.5, None), (11.4, "it has 11.4 V, and 11.5 V is asked for"), (math.nan, "it has nan V")]
)
def test_a_battery_that_tells_its_voltage_only(voltage: float, why: str | None) -> None:
    declared = Battery(ros_topic="/battery", minimum_v=11.5)
    said = battery.problem(declared, BatteryState(percentage=math.nan, voltage=voltage))
    assert said == why or (why is not None and said is not None and said.startswith(why))


def test_a_battery_without_a_minimum_is_refused() -> None:
    with pytest.raises(BenchbotError) as caught:
        Ros2Robot.from_declaration(declaration(safety={"battery": {"ros_topic": "/battery"}}))
    assert "It says neither minimum nor minimum_v" in caught.value.why


def robot(**safety: Any) -> dict[str, Any]:
    return declaration(safety={"battery": BATTERY, **safety})


@pytest.mark.usefixtures("domain")
def test_a_trial_does_not_begin_with_a_low_battery_and_one_under_way_is_not_ended(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with unicycle(charge=0.1) as there, driver(robot(), tmp_path) as platform:
        with pytest.raises(BenchbotError, match="does not start: its battery") as failure:
            platform.load(scene(), 0)
        assert failure.value.failure is FailureClass.PLATFORM
        assert not failure.value.ends_run
        assert "it has 10%" in failure.value.why
        assert "/battery" in failure.value.why

        there.set(charge=0.9)
        until(lambda: loads(platform))
        assert "The battery" not in capfd.readouterr().err
        there.set(charge=0.2)
        until(lambda: said(platform, capfd))
        assert act(platform, robot(), "move_distance", distance=0.2) is Outcome.REACHED


def loads(platform: Any) -> bool:
    try:
        platform.load(scene(), 0)
    except BenchbotError:
        return False
    return True


def said(platform: Any, capfd: pytest.CaptureFixture[str]) -> bool:
    platform.drive(0.0, 0.0, 0.05)
    return "The battery: it has 20%, 0.0 V, and 30% is asked for" in capfd.readouterr().err


@pytest.mark.usefixtures("domain")
def test_a_battery_that_says_nothing_is_missing_like_any_topic(tmp_path: Path) -> None:
    silent = declaration(safety={"battery": BATTERY}, timing={"wait_s": 1.0})
    with unicycle(silent=["/battery"]), driver(silent, tmp_path) as platform, pytest.raises(BenchbotError) as failure:
        platform.load(scene(), 0)
    assert "nothing came on /battery" in failure.value.title
