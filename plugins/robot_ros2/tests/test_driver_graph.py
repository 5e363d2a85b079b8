"""Robots that are not as declared: each is refused in words before anything moves."""

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from plugins.robot_ros2.tests.unicycle import declaration, driver, scene, unicycle

pytestmark = pytest.mark.usefixtures("domain")

IMPATIENT = {"wait_s": 1.5, "feedback_timeout_s": 1.0}


def _refusal(tmp_path: Path, robot: dict[str, Any] | None = None, **options: Any) -> BenchbotError:
    with (
        unicycle(**options),
        driver(robot or declaration(timing=IMPATIENT), tmp_path) as platform,
        pytest.raises(BenchbotError) as failure,
    ):
        platform.load(scene(), 0)
    assert failure.value.failure is FailureClass.PLATFORM
    assert not failure.value.ends_run
    return failure.value


def test_every_missing_topic_is_named_with_its_reason(tmp_path: Path) -> None:
    robot = declaration(timing=IMPATIENT)
    robot["connections"]["laser"]["qos"] = {"reliability": "reliable"}
    error = _refusal(
        tmp_path,
        robot,
        absent=["/odom"],
        silent=["/camera_info"],
        compressed=True,
        reliability={"/scan": "best_effort"},
    )

    assert "nothing came on" in error.title
    assert sorted(error.why.splitlines()) == [
        "/camera_info: the node /unicycle publishes it, but sends nothing.",
        "/image: the node /unicycle publishes it as sensor_msgs/msg/CompressedImage, not as sensor_msgs/msg/Image.",
        "/odom: nobody publishes it.",
        "/scan: the node /unicycle publishes it with reliability best_effort, but reliability reliable is asked for.",
    ]
    assert "ROS_DOMAIN_ID" in error.fix


def test_a_bumper_that_nobody_publishes_is_missing_though_it_may_be_silent(tmp_path: Path) -> None:
    assert _refusal(tmp_path, absent=["/collision"]).why == "/collision: nobody publishes it."
    with unicycle(silent=["/collision"]), driver(declaration(), tmp_path) as platform:
        platform.load(scene(), 0)


def test_best_effort_is_heard_when_nothing_else_is_asked_for(tmp_path: Path) -> None:
    with unicycle(reliability={"/scan": "best_effort"}), driver(declaration(), tmp_path) as platform:
        platform.load(scene(), 0)
        assert platform.observe(["laser"])["laser"]["scans"].shape == (72, 2)


def test_a_simulated_clock_that_nobody_publishes(tmp_path: Path) -> None:
    error = _refusal(tmp_path, declaration(use_sim_time=True, timing=IMPATIENT))

    assert error.title == "The clock of the robot 'unicycle' does not run."
    assert "/clock" in error.why


def test_what_came_before_the_clock_is_of_no_time(tmp_path: Path) -> None:
    with (
        unicycle(simulated=True, clock_offset_s=100.0, silent=["/clock"]) as robot,
        driver(declaration(use_sim_time=True), tmp_path) as platform,
        ThreadPoolExecutor(1) as pool,
    ):
        loading = pool.submit(platform.load, scene(), 0)
        time.sleep(2.0)
        # The newest odometry is that of before for a while.
        robot.set(silent=["/odom"])
        time.sleep(1.0)
        assert not loading.done()
        robot.set(silent=[])
        loading.result(60)


@pytest.mark.parametrize(("offset_s", "where"), [(-5.0, "behind"), (5.0, "ahead")])
def test_clocks_that_differ(tmp_path: Path, offset_s: float, where: str) -> None:
    error = _refusal(tmp_path, stamp_offset_s={"/odom": offset_s})

    assert error.title in (
        f"The robot's clock and that of this computer differ by {s} s." for s in ("4.9", "5.0", "5.1")
    )
    assert f"/odom are {where}; driver.timing.skew_s allows 2 s" in error.why
    assert "chrony" in error.fix


def test_an_odometry_of_another_base(tmp_path: Path) -> None:
    robot = declaration()
    robot["robot_frame"] = "base_footprint"
    robot["poses"] = ["base_footprint"]
    error = _refusal(tmp_path, robot)

    assert error.title == "The robot's messages are in another frame than declared."
    assert "/odom" in error.why
    assert "child_frame_id 'base_link'" in error.why
    assert "'base_footprint'" in error.why
