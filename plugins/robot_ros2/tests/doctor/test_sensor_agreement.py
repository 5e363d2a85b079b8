"""What `benchbot doctor --robot` makes of a laser and a depth camera that look at the same wall."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from benchbot.core.channels import LaserScan
from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot_robot_ros2.doctor import sensor_agreement

LASER = Pose.from_xyz_rpy_deg((0.05, 0, 0.3))
CAMERA = Pose.from_xyz_rpy_deg((0.1, 0, 0.5), (-90, 0, -90))
FOCAL, WIDTH, HEIGHT = 64.0, 80, 96
INTRINSICS = np.array([[FOCAL, 0, (WIDTH - 1) / 2], [0, FOCAL, (HEIGHT - 1) / 2], [0, 0, 1]])
BEAMS = 360


def scan(wall_x_m: float, laser: Pose = LASER, *, nothing: float = 0.0) -> LaserScan:
    """Return the scan of a laser, where it really is, of a wall across x; a part of the beams returns nothing."""
    angles = -math.pi + np.arange(BEAMS) * 2 * math.pi / BEAMS
    matrix = laser.matrix()
    ahead = (matrix[:2, :2] @ np.stack([np.cos(angles), np.sin(angles)]))[0]
    with np.errstate(divide="ignore"):
        ranges = np.where(ahead > 1e-6, (wall_x_m - matrix[0, 3]) / ahead, np.inf)
    ranges[np.random.default_rng(0).random(BEAMS) < nothing] = np.inf
    return {"scans": np.stack([ranges, angles], 1), "range_min": 0.05, "range_max": 30.0}


def depth(wall_x_m: float) -> NDArray[np.float32]:
    return np.full((HEIGHT, WIDTH), wall_x_m - 0.1, np.float32)


def compared(seen: LaserScan, picture: NDArray[np.float32], laser: Pose = LASER) -> list[Finding]:
    return list(sensor_agreement.check(seen, laser, picture, CAMERA, INTRINSICS))


@given(wall_x_m=st.floats(0.5, 4.0), yaw_deg=st.floats(-180, 180))
def test_a_laser_that_is_where_it_is_declared_agrees_however_it_is_turned(wall_x_m: float, yaw_deg: float) -> None:
    laser = LASER @ Pose.from_xyz_rpy_deg((0, 0, 0), (0, 0, yaw_deg))
    (finding,) = compared(scan(wall_x_m, laser), depth(wall_x_m), laser)
    assert finding.level is Level.OK


def test_a_laser_upside_down_agrees_where_it_is_declared_so() -> None:
    laser = LASER @ Pose.from_xyz_rpy_deg((0, 0, 0), (180, 0, 0))
    (finding,) = compared(scan(2.0, laser), depth(2.0), laser)
    assert finding.level is Level.OK


@given(yaw_deg=st.floats(90, 270))
def test_a_laser_that_looks_elsewhere_is_broken(yaw_deg: float) -> None:
    really = LASER @ Pose.from_xyz_rpy_deg((0, 0, 0), (0, 0, yaw_deg))
    (finding,) = compared(scan(2.0, really), depth(2.0))
    assert finding.level is Level.BROKEN


@pytest.mark.parametrize(("yaw_deg", "hint"), [(180, "Turned by 180 degrees"), (90, "Correct the mount")])
def test_the_fix_says_when_turning_it_round_would_do(yaw_deg: float, hint: str) -> None:
    really = LASER @ Pose.from_xyz_rpy_deg((0, 0, 0), (0, 0, yaw_deg))
    (finding,) = compared(scan(2.0, really), depth(2.0))
    assert hint in finding.fix


def test_depth_of_another_scale_is_broken_though_it_is_plausible() -> None:
    (finding,) = compared(scan(4.0), depth(2.05))
    assert finding.level is Level.BROKEN
    assert "by depth" in finding.detail


def test_some_beams_through_glass_are_no_finding_and_half_of_them_are_worth_a_look() -> None:
    assert compared(scan(2.0, nothing=0.2), depth(2.0))[0].level is Level.OK
    assert compared(scan(2.0, nothing=0.5), depth(2.0))[0].level is Level.WARNING


def level_picture(height_m: float) -> NDArray[np.float32]:
    """Return what the camera sees of a level plane below it: a floor, or a table top."""
    rows = np.arange(HEIGHT)[:, None] - (HEIGHT - 1) / 2
    with np.errstate(divide="ignore"):
        picture = np.where(rows > 0, FOCAL * (0.5 - height_m) / rows, np.inf)
    return np.tile(picture, (1, WIDTH)).astype(np.float32)


@pytest.mark.parametrize(("height_m", "laser_m"), [(0.0, 0.0), (0.0, 0.1), (0.3, 0.3), (0.27, 0.3), (0.33, 0.3)])
def test_a_floor_and_a_table_top_near_the_lasers_plane_are_none_of_its_business(
    height_m: float, laser_m: float
) -> None:
    laser = Pose.from_xyz_rpy_deg((0.05, 0, laser_m))
    assert compared(scan(4.0, laser), level_picture(height_m), laser) == []


@pytest.mark.parametrize(
    ("seen", "picture", "laser"),
    [
        (scan(2.0), np.full((HEIGHT, WIDTH), np.nan, np.float32), LASER),
        ({**scan(2.0), "scans": np.empty((0, 2))}, depth(2.0), LASER),
        (scan(2.0), depth(2.0), LASER @ Pose.from_xyz_rpy_deg((0, 0, 0), (0, 20, 0))),
        (scan(30.0), depth(30.0), LASER),
    ],
    ids=["no depth", "no beams", "a laser that is not level", "too far away"],
)
def test_where_they_have_nothing_in_common_nothing_is_said(seen: Any, picture: Any, laser: Pose) -> None:
    assert compared(seen, picture, laser) == []
