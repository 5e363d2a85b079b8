"""When the diagnosis of a robot has seen enough: at once when all is well, and never before a fault shows."""

import pytest
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger

from benchbot.core.findings import Level
from benchbot_robot_ros2 import ros
from benchbot_robot_ros2.declaration_keys import Timing, Topic
from benchbot_robot_ros2.doctor.live_watch import Stream, Use
from benchbot_robot_ros2.doctor.settled import steady
from plugins.robot_ros2.tests.doctor.cart import TICK_S, Cart, broken, examine, tell_mounts, worst

SECOND = 1_000_000_000
SCAN = Topic(ros_topic="/scan", ros_type="sensor_msgs/msg/LaserScan")
LONG_S, LOOK_S = 30.0, 4.0


def is_steady(
    times_s: list[float], ages_s: list[float] | None = None, *, now_s: float = 1.0, role: str = "laser", hz: float = 5.0
) -> bool:
    """Judge messages that came at these times, a quarter of the look being over."""
    ages = ages_s or [0.01] * len(times_s)
    arrivals = [(int(at * SECOND), int((at - age) * SECOND)) for at, age in zip(times_s, ages, strict=True)]
    stream = Stream(Use(role, SCAN, rate_hz=hz or None), [(at, stamp) for at, stamp in arrivals])
    return steady(stream, Timing(), int(now_s * SECOND), 3.0, simulated=False)


TENTHS = [number / 10 for number in range(10)]


def test_what_comes_often_enough_and_is_fresh_is_steady() -> None:
    assert is_steady(TENTHS)
    assert is_steady([0.0, 0.4, 0.8], hz=0.0)
    assert is_steady([0.0], hz=0.0, role="battery")


@pytest.mark.parametrize(
    ("times_s", "hz"),
    [
        ([], 5.0),
        (TENTHS[:5], 5.0),
        ([0.0, 0.4], 0.0),
        ([number / 10 for number in range(6)], 7.0),
        ([*(number / 100 for number in range(20)), 0.5, 0.9], 5.0),
        ([number / 50 for number in range(20)], 0.0),
        ([0.0, 0.05, 0.1, 0.15, 0.2, 0.55, 0.95], 5.0),
    ],
    ids=["nothing", "too few", "too few pictures", "late", "a burst", "stopped pictures", "slowing down"],
)
def test_what_says_too_little_or_changes_is_not_steady(times_s: list[float], hz: float) -> None:
    assert not is_steady(times_s, hz=hz)


@pytest.mark.parametrize(
    ("age_s", "growth", "hz"),
    [(0.01, 0.2, 5.0), (0.01, 0.6, 0.0), (0.01, -0.05, 5.0), (0.3, 0.0, 5.0), (-0.1, 0.0, 0.0)],
    ids=["feedback gets old", "pictures get old", "drifts ahead", "old already", "ahead already"],
)
def test_stamps_that_are_off_or_will_be_at_the_looks_end_are_not_steady(age_s: float, growth: float, hz: float) -> None:
    assert not is_steady(TENTHS, [age_s + growth * at for at in TENTHS], hz=hz)


def test_an_age_that_changes_and_stays_fine_is_steady() -> None:
    assert is_steady(TENTHS, [0.01 + 0.02 * at for at in TENTHS])


@pytest.fixture
def well(domain: int) -> Cart:
    """A robot that nothing is wrong with: its transforms are published."""
    cart = Cart()
    cart.transforms = True
    return cart


def test_a_robot_that_is_well_is_not_looked_at_for_longer_than_that_takes(well: Cart) -> None:
    with well.running():
        found = examine(seconds=LONG_S)
        ticks = well.ticks
    assert broken(found) == []
    assert [name for name, group in found.items() if worst(group).level is not Level.OK] == ["dead-man switch"]
    assert found["topic /odom"][0].detail.startswith("odometry, ")
    assert ticks * TICK_S < 0.9 * LONG_S


def test_a_topic_that_stops_is_told(well: Cart) -> None:
    well.later[12] = lambda _: well.silent.add("/odom")
    with well.running():
        found = examine(seconds=LOOK_S)
    assert "and not in the last" in worst(found["topic /odom"]).detail
    assert worst(found["topic /scan"]).level is Level.OK


def test_a_topic_that_gets_slow_is_told(well: Cart) -> None:
    well.later[12] = lambda _: well.every.update({"/odom": 20})
    with well.running():
        found = examine(seconds=1.5 * LOOK_S)
    assert "is too slow for odometry" in worst(found["topic /odom"]).detail


@pytest.mark.parametrize(("drift", "says"), [(-0.3, "old"), (0.1, "in the future"), (-1.0, "old")])
def test_stamps_that_drift_or_stand_still_are_told(well: Cart, drift: float, says: str) -> None:
    well.stamp_drift = drift
    with well.running():
        found = examine(seconds=LOOK_S)
    finding = worst(found["topic /odom"])
    assert finding.level is not Level.OK
    assert says in finding.detail


def test_a_button_that_says_nothing_until_it_is_pressed_is_heard(well: Cart) -> None:
    well.silent, well.pressed = {"/e_stop"}, True
    well.later[40] = lambda _: well.silent.clear()
    with well.running():
        found = examine(seconds=1.5 * LOOK_S)
    assert found["e-stop"][0].detail == "it is pressed"


def test_another_robot_that_is_discovered_a_little_later_is_told(well: Cart) -> None:
    with well.running(), ros.running_node("intruder") as other:
        well.later[10] = lambda _: other.create_publisher(LaserScan, "/scan", 1)
        found = examine(seconds=LOOK_S)
    assert "/cart and /intruder publish it" in worst(found["topic /scan"]).detail


def test_what_is_missing_at_first_is_waited_for(well: Cart) -> None:
    well.services, well.transforms = [], False
    well.later[30] = lambda node: node.create_service(Trigger, "/reset", lambda _, response: response)
    well.later[35] = tell_mounts
    with well.running():
        found = examine(seconds=LONG_S)
        ticks = well.ticks
    assert found["return to start"][0].detail == "service /reset"
    assert found["frame lidar"][0].level is Level.OK
    assert ticks * TICK_S < 0.9 * LONG_S
