"""What goes wrong during a run, with a robot in another process; whatever does while it moves stops it for good."""

import os
import re
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot_robot_ros2.driver import Ros2Driver
from plugins.robot_ros2.tests.unicycle import BY_TRUTH, act, declaration, driver, scene, unicycle, until

pytestmark = pytest.mark.usefixtures("domain")

IMPATIENT = {"timing": {"feedback_timeout_s": 0.7}}


def _safety_stop(tmp_path: Path, fault: dict[str, Any], options: dict[str, Any] | None = None, **settings: Any) -> str:
    """Break the robot while it moves; it stops and stays stopped, and the words why are returned."""
    robot = declaration(**{**IMPATIENT, **settings})
    with unicycle(**(options or {})) as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        def breaks() -> None:
            until(lambda: there.state["x"] > 0.1)
            there.set(**fault)

        breaking = threading.Thread(target=breaks)
        breaking.start()
        with pytest.raises(BenchbotError) as failure:
            act(platform, robot, "move_distance", distance=4.0)
        breaking.join()

        error = failure.value
        assert (error.title, error.failure) == ("The robot was stopped for safety.", FailureClass.PLATFORM)
        assert error.ends_run
        until(lambda: there.state["v"] == 0.0)
        assert there.state["x"] < 3.0
        with pytest.raises(BenchbotError) as again:
            platform.drive(0.1, 0.0, 0.05)
        assert again.value.ends_run
        with pytest.raises(BenchbotError):
            platform.load(scene(), 0)
        return error.why


@pytest.mark.parametrize("topic", ["/odom", "/scan"])
def test_feedback_that_falls_silent(tmp_path: Path, topic: str) -> None:
    why = _safety_stop(tmp_path, {"silent": [topic]})

    assert f"Nothing new came on {topic} for" in why
    assert "the node /unicycle publishes it, but sends nothing" in why


def test_localisation_whose_stamps_stand_still(tmp_path: Path) -> None:
    why = _safety_stop(tmp_path, {"stale": ["/truth"]}, localisation=BY_TRUTH)

    assert "Nothing new came on /truth for" in why
    assert "the stamps of its messages do not advance" in why


BY_TRANSFORMS = {"by": "tf"}


@pytest.mark.parametrize(("frame", "parent"), [("odom", "map"), ("base_link", "odom")])
def test_a_link_of_the_transform_tree_that_falls_silent(tmp_path: Path, frame: str, parent: str) -> None:
    why = _safety_stop(tmp_path, {"untold": [frame]}, {"transforms": True}, localisation=BY_TRANSFORMS)

    assert f"Nothing new was said of where '{frame}' is in '{parent}' for" in why


@pytest.mark.parametrize("localisation", [BY_TRUTH, BY_TRANSFORMS], ids=["topic", "tf"])
@pytest.mark.parametrize("off_m", [1.0, -1.0])
def test_localisation_that_jumps(tmp_path: Path, localisation: dict[str, Any], off_m: float) -> None:
    why = _safety_stop(tmp_path, {"place_off_m": off_m}, {"transforms": True}, localisation=localisation)

    # Odometry of the same moment may come later, by a few centimetres of the way.
    assert re.search(r"Its localisation jumped by (1\.0|0\.9)\d m and 0°, from \(", why)
    assert "driver.localisation_bounds allow 0.5 m and 20°" in why


def test_localisation_that_jumps_while_the_robot_stands_ends_the_trial(tmp_path: Path) -> None:
    with unicycle() as there, driver(declaration(localisation=BY_TRUTH), tmp_path) as platform:
        platform.load(scene(), 0)
        there.set(place_off_m=0.3)
        until(lambda: platform.pose().translation_xyz[0] > 0.2)  # a correction
        there.set(place_off_m=-0.7)
        with pytest.raises(BenchbotError, match="cannot be trusted") as failure:
            until(lambda: platform.pose().translation_xyz[0] < -0.2)
        assert failure.value.failure is FailureClass.PLATFORM


def test_a_place_that_is_told_now_and_then_is_told_often_enough(tmp_path: Path) -> None:
    seldom = {**BY_TRUTH, "ros_type": "geometry_msgs/msg/PoseWithCovarianceStamped", "ros_topic": "/amcl_pose"}
    options = {"amcl": True}
    why = _safety_stop(
        tmp_path, {"silent": ["/amcl_pose"]}, options, localisation=seldom, localisation_bounds={"unseen_m": 0.5}
    )

    assert "Nothing new came on /amcl_pose for 0.5" in why


def test_a_clock_that_jumps_back(tmp_path: Path) -> None:
    why = _safety_stop(tmp_path, {"clock_offset_s": -20.0}, {"simulated": True}, use_sim_time=True)

    assert "jumped back by 19.9" in why or "jumped back by 20.0" in why


def test_a_scan_from_another_frame(tmp_path: Path) -> None:
    why = _safety_stop(tmp_path, {"frames": {"/scan": "lidar_2"}})

    assert "'lidar_2'" in why


def test_a_robot_that_dies(tmp_path: Path) -> None:
    robot = declaration(**IMPATIENT)
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        def kills() -> None:
            until(lambda: there.state["x"] > 0.1)
            os.kill(there.process.pid, signal.SIGKILL)

        killing = threading.Thread(target=kills)
        killing.start()
        with pytest.raises(BenchbotError, match="stopped for safety") as failure:
            act(platform, robot, "move_distance", distance=4.0)
        killing.join()
        assert failure.value.ends_run


def test_halt_from_another_thread(tmp_path: Path) -> None:
    robot = declaration(**IMPATIENT)
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)

        def halts() -> None:
            until(lambda: there.state["x"] > 0.1)
            platform.halt("The solution hung up.")

        halting = threading.Thread(target=halts)
        halting.start()
        with pytest.raises(BenchbotError) as failure:
            act(platform, robot, "move_distance", distance=4.0)
        halting.join()

        assert failure.value.why == "The solution hung up."
        assert failure.value.ends_run
        until(lambda: there.state["v"] == 0.0)
        with pytest.raises(BenchbotError, match="stopped for safety"):
            platform.observe(["poses"])


def test_closing_stops_a_moving_robot(tmp_path: Path) -> None:
    with unicycle() as there, driver(declaration(), tmp_path) as platform:
        platform.load(scene(), 0)
        while there.state["x"] < 0.05:
            platform.drive(0.5, 0.0, 0.05)
        platform.close()
        until(lambda: there.state["v"] == 0.0)
        assert there.state["x"] < 1.0


def _observe_on(platform: Ros2Driver) -> None:
    # Pictures that were taken before may still be good.
    for _ in range(3):
        platform.observe(["image_rgb", "laser"])


@pytest.mark.parametrize(
    ("fault", "title", "why"),
    [
        (
            {"silent": ["/image"]},
            "The robot does not tell everything: nothing came on /image.",
            "/image: the node /unicycle publishes it, but sends nothing.",
        ),
        (
            {"stale": ["/image"]},
            "The robot does not tell everything: nothing came on /image.",
            "/image: the node /unicycle publishes it, but the stamps of its messages do not advance.",
        ),
        (
            {"frames": {"/image": "lens"}},
            "The robot's messages are in another frame than declared.",
            "The messages on /image have the frame_id 'lens'",
        ),
        (
            {"stamp_offset_s": {"/image": 4.0}},
            "The robot's clock and that of this computer differ by",
            "/image are ahead",
        ),
        ({"stamp_offset_s": {"/image": 1.9}}, "The robot's sensors do not fit together in time.", "/scan +0.000 s."),
    ],
    ids=["silent", "stale", "frame", "skew", "apart"],
)
def test_a_camera_that_fails_between_actions(tmp_path: Path, fault: dict[str, Any], title: str, why: str) -> None:
    robot = declaration(timing={"wait_s": 4.0})
    with unicycle() as there, driver(robot, tmp_path) as platform:
        platform.load(scene(), 0)
        platform.observe(["image_rgb", "laser"])

        there.set(**fault)
        with pytest.raises(BenchbotError) as failure:
            _observe_on(platform)
        assert title in failure.value.title
        assert why in failure.value.why
        assert failure.value.failure is FailureClass.PLATFORM
        assert not failure.value.ends_run

        there.set(**{name: type(value)() for name, value in fault.items()})
        if "stamp_offset_s" not in fault:
            assert set(platform.observe(["image_rgb"])) == {"image_rgb"}


@pytest.mark.parametrize(("simulated", "delay_s"), [(False, 1.5), (True, 3.0)], ids=["real", "simulated"])
def test_a_picture_that_comes_late_is_waited_for(tmp_path: Path, simulated: bool, delay_s: float) -> None:
    late = {"stamp_offset_s": {"/image": -delay_s}}
    with (
        unicycle(simulated=simulated, **late),
        driver(declaration(use_sim_time=simulated), tmp_path) as platform,
    ):
        platform.load(scene(), 0)

        assert set(platform.observe(["image_rgb", "laser"])) == {"image_rgb", "laser"}


def test_a_picture_that_comes_too_late_is_of_another_clock(tmp_path: Path) -> None:
    with unicycle(stamp_offset_s={"/image": -3.0}), driver(declaration(), tmp_path) as platform:
        platform.load(scene(), 0)
        with pytest.raises(BenchbotError, match=r"differ by 3\.\d s") as failure:
            platform.observe(["image_rgb"])

    assert "/image are behind; driver.timing.skew_s allows 2 s" in failure.value.why
