"""What `benchbot doctor --robot` finds in single messages."""

import math
from typing import Any

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, LaserScan

from benchbot.core.channels import LaserScan as Scan
from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot_robot_ros2.declaration_keys import Timing, Topic
from benchbot_robot_ros2.doctor import message_checks
from benchbot_robot_ros2.doctor.live_watch import Stream, Use

SECOND = 1_000_000_000


def stream(*, hz: float = 10.0, age_s: float = 0.01, role: str = "laser", wanted_hz: float | None = None) -> Stream:
    use = Use(role, Topic(ros_topic="/scan", ros_type="sensor_msgs/msg/LaserScan"), "lidar", wanted_hz)
    times = [int(100 * SECOND + number * SECOND / hz) for number in range(20)]
    return Stream(use, [(time, time - int(age_s * SECOND)) for time in times])


def only(findings: Any) -> Finding:
    finding: Finding
    (finding,) = findings
    assert finding.level is Level.OK or finding.fix, "whatever is wrong comes with a fix"
    return finding


def test_a_fresh_and_fast_topic_is_fine() -> None:
    finding = only(message_checks.freshness(stream(), Timing(), simulated=False))
    assert finding.level is Level.OK
    assert "10.0 Hz" in finding.detail
    assert "10 ms" in finding.detail


@pytest.mark.parametrize(
    ("what", "level", "says"),
    [
        ({"hz": 2.0, "wanted_hz": 5.0}, Level.WARNING, "2.0 Hz is too slow for laser"),
        ({"age_s": 0.4, "wanted_hz": 5.0}, Level.WARNING, "400 ms old"),
        ({"age_s": 1.5}, Level.WARNING, "1500 ms old"),
        ({"age_s": 30.0}, Level.BROKEN, "30.00 s old"),
        ({"age_s": -0.05}, Level.WARNING, "50 ms in the future"),
        ({"age_s": -3600.0}, Level.BROKEN, "in the future"),
    ],
)
def test_slow_late_and_skewed_topics_are_named(what: dict[str, float], level: Level, says: str) -> None:
    finding = only(message_checks.freshness(stream(**what), Timing(), simulated=False))  # type: ignore[arg-type]
    assert finding.level is level
    assert says in finding.detail


@pytest.mark.parametrize(
    ("age_s", "wanted_hz", "simulated", "level"),
    [
        (3.0, None, True, Level.WARNING),
        (3.0, None, False, Level.BROKEN),
        (3.0, 5.0, True, Level.BROKEN),
        (11.0, None, True, Level.BROKEN),
        (-3.0, None, True, Level.BROKEN),
    ],
)
def test_only_what_the_driver_would_not_take_is_broken(
    age_s: float, wanted_hz: float | None, simulated: bool, level: Level
) -> None:
    seen = stream(age_s=age_s, wanted_hz=wanted_hz)
    assert only(message_checks.freshness(seen, Timing(), simulated=simulated)).level is level


def test_a_topic_that_came_regularly_and_stopped_is_told() -> None:
    ended_ns = 102 * SECOND
    assert message_checks.stopped(stream(), ended_ns) is None
    finding = message_checks.stopped(stream(), ended_ns + 3 * SECOND)
    assert finding is not None
    assert finding.level is Level.WARNING
    assert "not in the last 3.1 s" in finding.detail


def test_what_comes_by_event_has_not_stopped() -> None:
    later_ns = 200 * SECOND
    assert message_checks.stopped(stream(role="e_stop"), later_ns) is None
    assert message_checks.stopped(stream(role="dead_man", wanted_hz=2.0), later_ns) is not None
    seldom = stream(hz=0.5)
    assert message_checks.stopped(seldom, seldom.arrivals_ns[-1][0] + 5 * SECOND) is None


def test_clocks_that_differ_are_mended_with_chrony() -> None:
    assert "chrony" in only(message_checks.freshness(stream(age_s=30), Timing(), simulated=False)).fix


def test_a_picture_may_take_its_time() -> None:
    assert only(message_checks.freshness(stream(age_s=0.4), Timing(), simulated=False)).level is Level.OK


def test_a_simulated_clock_ticks_so_its_stamps_may_be_a_tick_ahead() -> None:
    assert only(message_checks.freshness(stream(age_s=-0.05), Timing(), simulated=True)).level is Level.OK


def test_a_wrong_frame_says_what_to_declare() -> None:
    scan = stream()
    scan.last = LaserScan()
    scan.last.header.frame_id = "laser_link"
    finding = only(message_checks.frame(scan, "base_link"))
    assert finding.level is Level.BROKEN
    assert "'laser_link'" in finding.detail
    assert "laser.frame: laser_link" in finding.fix


def test_odometry_must_be_of_the_base() -> None:
    odometry = stream(role="odometry")
    odometry.last = Odometry(child_frame_id="base_footprint")
    assert "robot_frame: base_footprint" in only(message_checks.frame(odometry, "base_link")).fix
    odometry.last.child_frame_id = "base_link"
    assert not list(message_checks.frame(odometry, "base_link"))


def info(**changes: Any) -> Any:
    message = CameraInfo(
        width=640,
        height=480,
        k=[500.0, 0, 320, 0, 500, 240, 0, 0, 1],
        p=[500.0, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0],
        d=[0.0] * 5,
        distortion_model="plumb_bob",
    )
    for key, value in changes.items():
        setattr(message, key, value)
    return message


def test_a_rectified_camera_is_fine() -> None:
    finding = only(message_checks.camera_info("/info", info(), (480, 640)))
    assert finding.level is Level.OK
    assert "65 degrees" in finding.detail


@pytest.mark.parametrize(
    ("changes", "size", "level", "says"),
    [
        ({"k": [0.0] * 9}, (480, 640), Level.BROKEN, "focal lengths are 0 and 0"),
        ({}, (240, 320), Level.BROKEN, "but they are 320x240"),
        ({"k": [500.0, 0, 900, 0, 500, 240, 0, 0, 1]}, None, Level.BROKEN, "outside the image"),
        ({"d": [0.1, 0.0, 0.0, 0.0, 0.0]}, None, Level.WARNING, "not rectified (plumb_bob"),
        ({"p": [0.0] * 12}, None, Level.WARNING, "P says fx=0.0"),
    ],
)
def test_a_camera_that_is_not_calibrated_is_named(
    changes: dict[str, Any], size: tuple[int, int] | None, level: Level, says: str
) -> None:
    finding = only(message_checks.camera_info("/info", info(**changes), size))
    assert finding.level is level
    assert says in finding.detail


@pytest.mark.parametrize(
    ("depth_m", "level", "says"),
    [
        (np.full((4, 4), 2.0), Level.OK, "median 2.00 m"),
        (np.full((4, 4), np.nan), Level.BROKEN, "no pixel is valid"),
        (np.where(np.arange(16).reshape(4, 4) < 12, np.nan, 2.0), Level.WARNING, "75% of the pixels"),
        (np.full((4, 4), 2000.0), Level.BROKEN, "another unit"),
    ],
)
def test_depth_is_looked_at(depth_m: Any, level: Level, says: str) -> None:
    finding = only(message_checks.depth("/depth", depth_m.astype(np.float32)))
    assert finding.level is level
    assert says in finding.detail


def scan(first_deg: float, last_deg: float, ranges_m: float = 2.0) -> Scan:
    angles = np.radians(np.arange(first_deg, last_deg, 1.0))
    return {"scans": np.column_stack([np.full(angles.size, ranges_m), angles]), "range_min": 0.1, "range_max": 10.0}


@pytest.mark.parametrize("yaw_deg", [0, 90, 180, -90])
def test_a_laser_all_around_sees_ahead_however_it_is_mounted(yaw_deg: float) -> None:
    mount = Pose.from_xyz_rpy_deg((0, 0, 0.2), (0, 0, yaw_deg))
    assert only(message_checks.laser("/scan", scan(-180, 180), mount)).level is Level.OK


def test_a_laser_that_looks_backwards_is_no_guard() -> None:
    backwards = Pose.from_xyz_rpy_deg((0, 0, 0.2), (0, 0, 180))
    assert only(message_checks.laser("/scan", scan(-90, 90), None)).level is Level.OK
    finding = only(message_checks.laser("/scan", scan(-90, 90), backwards))
    assert finding.level is Level.WARNING
    assert "does not see the 90 degrees ahead" in finding.detail


def test_a_blind_laser_is_named() -> None:
    assert only(message_checks.laser("/scan", scan(-180, 180, math.inf), None)).level is Level.BROKEN
    nearly = scan(-180, 180, math.inf)
    nearly["scans"][:20, 0] = 1.0
    assert "only 6%" in only(message_checks.laser("/scan", nearly, None)).detail


def test_a_mount_that_differs_comes_with_the_line_to_paste() -> None:
    declared = Pose.from_xyz_rpy_deg((0.1, 0, 1.0), (-90, 0, -90))
    assert message_checks.mount("camera", declared, declared).level is Level.OK
    measured = Pose.from_xyz_rpy_deg((0.1, 0.02, 1.0), (-90, 0, -93))
    finding = message_checks.mount("camera", declared, measured)
    assert finding.level is Level.WARNING
    assert "2.0 cm and 3.0 degrees" in finding.detail
    assert "camera: {xyz: [0.1000, 0.0200, 1.0000], rpy_deg: [-90.00, 0.00, -93.00]}" in finding.fix


def test_an_undeclared_mount_is_given_too() -> None:
    finding = message_checks.mount("camera", None, Pose.from_xyz_rpy_deg((0.1, 0, 1.0)))
    assert finding.fix.startswith("Add under frames: camera: {xyz: [0.1000, 0.0000, 1.0000]")
