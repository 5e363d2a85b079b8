"""Contact is predicted where the footprint would come by, and nowhere else."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from benchbot.core.channels import LaserScan, LidarScan
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig
from benchbot_robot_ros2.clearance import contact_ahead, obstacle_points
from benchbot_robot_ros2.footprint import Footprint
from benchbot_robot_ros2.ramp import Velocity

RADIUS_M = 0.3
DISC = Footprint(RADIUS_M, (0.0, 1.0))
# A delivery robot: longer than wide, its wheels in front.
BOX = Footprint(0.7, (0.0, 1.0), ((0.2, 0.25), (0.2, -0.25), (-0.6, -0.25), (-0.6, 0.25)))
MOTION = MotionConfig(linear_acceleration_mps2=2.0, angular_acceleration_radps2=3.0)
forwards = st.floats(0.05, 1.5)
turns = st.floats(-1.0, 1.0)


def ahead(
    points: list[tuple[float, float]] | NDArray[np.float64],
    command: tuple[float, ...],
    velocity: tuple[float, ...] | None = None,
    horizon_s: float = 0.05,
    footprint: Footprint = DISC,
    motion: MotionConfig = MOTION,
) -> bool:
    now, wanted = Velocity(*(command if velocity is None else velocity)), Velocity(*command)
    return contact_ahead(np.array(points, np.float64).reshape(-1, 2), footprint, now, wanted, horizon_s, motion)


@given(st.floats(0.31, 1.0), st.floats(0.05, 0.5), st.floats(0.01, 0.5), st.sampled_from([1, -1]))
def test_a_holonomic_base_hits_what_is_beside_it(
    distance_m: float, lateral_mps: float, horizon_s: float, side: int
) -> None:
    holonomic = MotionConfig(linear_acceleration_mps2=2.0, lateral_limit_mps=0.5)
    wall = [(x, side * distance_m) for x in np.linspace(-1, 1, 201)]
    reach_m = RADIUS_M + lateral_mps * horizon_s + lateral_mps**2 / (2 * 2.0)
    assume(abs(reach_m - distance_m) > 1e-6)
    sideways = (0.0, 0.0, side * lateral_mps)
    assert ahead(wall, sideways, horizon_s=horizon_s, motion=holonomic) == (reach_m > distance_m)
    assert not ahead(wall, (0.0, 0.0, -side * lateral_mps), horizon_s=horizon_s, motion=holonomic)
    # What a base does not do is nothing that it is kept from.
    assert not ahead(wall, sideways, horizon_s=horizon_s)


@given(st.floats(0.31, 3.0), forwards, st.floats(0.01, 0.5))
def test_a_wall_ahead_is_hit_when_the_way_and_the_braking_way_reach_it(
    distance_m: float, linear_mps: float, horizon_s: float
) -> None:
    wall = [(distance_m, y) for y in np.linspace(-1, 1, 201)]
    reach_m = RADIUS_M + linear_mps * horizon_s + linear_mps**2 / (2 * 2.0)
    assume(abs(reach_m - distance_m) > 1e-6)
    assert ahead(wall, (linear_mps, 0.0), horizon_s=horizon_s) == (reach_m > distance_m)


@given(st.floats(-2, -0.01), st.floats(-2, 2), forwards, st.floats(0.01, 1.0))
def test_driving_straight_away_is_never_contact(x: float, y: float, linear_mps: float, horizon_s: float) -> None:
    assert not ahead([(x, y)], (linear_mps, 0.0), horizon_s=horizon_s)


@given(st.floats(0.02, 0.29), forwards)
def test_a_robot_against_a_wall_may_leave_it_and_not_press_on(distance_m: float, linear_mps: float) -> None:
    wall = [(distance_m, y) for y in np.linspace(-1, 1, 201)]
    assert ahead(wall, (linear_mps, 0.0), velocity=(0.0, 0.0))
    assert not ahead(wall, (-linear_mps, 0.0), velocity=(0.0, 0.0))


@given(
    st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=20),
    st.floats(-0.6, 1.5),
    st.floats(0.01, 0.5),
    st.floats(0.0, 0.5),
)
def test_looking_further_ahead_never_hides_a_contact(
    points: list[tuple[float, float]], linear_mps: float, horizon_s: float, more_s: float
) -> None:
    command = (linear_mps, 0.0)
    assert ahead(points, command, horizon_s=horizon_s + more_s) or not ahead(points, command, horizon_s=horizon_s)


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), max_size=20), turns)
def test_a_disc_that_turns_on_the_spot_touches_nothing(points: list[tuple[float, float]], angular_radps: float) -> None:
    assert not ahead(points, (0.0, angular_radps), horizon_s=3.0)


@given(st.floats(0.2, 1.0), st.floats(0.3, 1.0), st.floats(0.2, 1.5))
def test_a_steady_arc_passes_within_the_radius_of_points_on_its_circle(
    linear_mps: float, angular_radps: float, turned_rad: float
) -> None:
    circle_m, horizon_s = linear_mps / angular_radps, turned_rad / angular_radps
    x, y = circle_m * math.sin(turned_rad), circle_m * (1 - math.cos(turned_rad))
    # Beyond the arc's own disc on the outside of the curve, at the arc's end.
    outwards = (math.sin(turned_rad), -math.cos(turned_rad))
    for offset_m, touched in ((RADIUS_M - 0.005, True), (RADIUS_M + 0.005, False)):
        point = (x + offset_m * outwards[0], y + offset_m * outwards[1])
        assume(math.hypot(*point) > RADIUS_M)
        # Half a turn behind is far enough from everything but the end; braking leads further on, and not outwards.
        if touched:
            assert ahead([point], (linear_mps, angular_radps), horizon_s=horizon_s)
        elif horizon_s < 0.2:
            assert not ahead([point], (linear_mps, angular_radps), horizon_s=0.001)


def test_a_moving_robot_needs_its_braking_way_whatever_is_commanded() -> None:
    # 1.5² / (2 · 2) = 0.5625 m
    assert ahead([(0.85, 0.0)], (0.0, 0.0), velocity=(1.5, 0.0))
    assert not ahead([(0.87, 0.0)], (0.0, 0.0), velocity=(1.5, 0.0))


def test_a_command_beyond_the_limits_is_looked_at_as_it_will_be_driven() -> None:
    assert ahead([(0.85, 0.0)], (9.0, 0.0), velocity=(1.5, 0.0), horizon_s=0.0)
    assert not ahead([(0.87, 0.0)], (9.0, 0.0), velocity=(1.5, 0.0), horizon_s=0.0)


@pytest.mark.parametrize(("point", "touched"), [((0.5, 0.5), True), ((0.5, -0.5), False)])
def test_a_curve_leads_to_one_side(point: tuple[float, float], touched: bool) -> None:
    assert ahead([point], (0.5, 1.0), horizon_s=1.0) is touched


def test_without_obstacles_nothing_is_touched() -> None:
    assert not ahead([], (1.5, 0.0))


def scan(*ranges_m: float, range_min: float = 0.1, range_max: float = 10.0) -> LaserScan:
    angles_rad = np.linspace(-np.pi, np.pi, len(ranges_m), endpoint=False)
    return {"scans": np.stack([np.array(ranges_m), angles_rad], 1), "range_min": range_min, "range_max": range_max}


def test_a_scan_becomes_points_around_the_base() -> None:
    mount = Pose.planar(0.5, 0.0, math.pi / 2, z=0.6)
    # Beams at -180°, -90°, 0° and 90° of a scanner that is turned to the left.
    points = obstacle_points(scan(1.0, 2.0, 3.0, 4.0), mount, (0.03, 1.1))
    np.testing.assert_allclose(points, [(0.5, -1.0), (2.5, 0.0), (0.5, 3.0), (-3.5, 0.0)], atol=1e-12)


def test_invalid_ranges_are_no_obstacles_but_too_near_is() -> None:
    points = obstacle_points(scan(math.nan, math.inf, -math.inf, 0.0, 11.0), Pose(), (0.0, 1.0))
    assert np.hypot(*points.T) == pytest.approx([0.1])


INTRINSICS = np.array([[100.0, 0.0, 49.5], [0.0, 100.0, 39.5], [0.0, 0.0, 1.0]])
FORWARD_CAMERA = Pose.from_xyz_rpy_deg((0.1, 0.0, 1.0), (-90.0, 0.0, -90.0))


def test_depth_shows_obstacles_between_two_heights_only() -> None:
    # A wall 2 m ahead of the camera; the picture reaches from 0.2 m to 1.8 m above the floor there.
    depth_m = np.full((80, 100), 2.0, np.float32)
    points = obstacle_points(depth_m, FORWARD_CAMERA, (0.5, 1.1), INTRINSICS)
    np.testing.assert_allclose(points[:, 0], 2.1)
    assert points[:, 1].min() == pytest.approx(-0.99)
    assert points[:, 1].max() == pytest.approx(0.99)
    heights = 1.0 - (np.arange(80) - 39.5) / 100 * 2.0
    assert len(points) == 100 * ((heights >= 0.5) & (heights <= 1.1)).sum()


def test_the_floor_is_no_obstacle() -> None:
    rows = (np.arange(80) - 39.5) / 100
    with np.errstate(divide="ignore"):
        floor_m = np.where(rows > 0, 1.0 / rows, np.inf)
    depth_m = np.repeat(floor_m[:, None], 100, 1).astype(np.float32)
    assert len(obstacle_points(depth_m, FORWARD_CAMERA, (0.03, 1.1), INTRINSICS)) == 0


def test_depth_that_says_nothing_is_no_obstacle_but_too_near_is() -> None:
    depth_m = np.full((80, 100), np.nan, np.float32)
    depth_m[0] = np.inf
    assert len(obstacle_points(depth_m, FORWARD_CAMERA, (0.03, 1.1), INTRINSICS)) == 0
    depth_m[40, 50] = -np.inf
    points = obstacle_points(depth_m, FORWARD_CAMERA, (0.03, 1.1), INTRINSICS)
    assert points == pytest.approx(np.array([(0.1, 0.0)]))
    assert ahead(points, (0.5, 0.0), velocity=(0.0, 0.0))


def test_a_large_picture_is_thinned_out() -> None:
    depth_m = np.full((540, 960), 2.0, np.float32)
    points = obstacle_points(depth_m, FORWARD_CAMERA, (0.0, 2.0), INTRINSICS)
    assert 0 < len(points) <= 9000


def test_depth_needs_the_camera() -> None:
    with pytest.raises(ValueError, match="intrinsics"):
        obstacle_points(np.zeros((2, 2), np.float32), Pose(), (0.0, 1.0))


@pytest.mark.parametrize(
    ("point", "command", "touched"),
    [
        ((0.4, 0.0), (0.5, 0.0), False),  # well before it: half a metre a second takes 6 cm and the tick
        ((0.28, 0.24), (0.5, 0.0), True),  # a corner comes by
        ((0.28, 0.28), (0.5, 0.0), False),  # the side does not
        ((-0.55, 0.3), (0.0, 1.0), False),  # turning to the left, the tail swings to the right
        ((-0.55, -0.3), (0.0, 1.0), True),
        ((-0.55, 0.3), (0.0, -1.0), True),
        ((-0.63, 0.0), (-0.3, 0.0), True),
        ((-0.63, 0.0), (0.3, 0.0), False),
    ],
)
def test_a_polygon_touches_where_it_is_and_swings(
    point: tuple[float, float], command: tuple[float, float], touched: bool
) -> None:
    assert ahead([point], command, footprint=BOX) is touched


@given(st.floats(-0.55, 0.15), st.floats(-0.2, 0.2), forwards)
def test_what_is_inside_a_polygon_may_be_left(x: float, y: float, linear_mps: float) -> None:
    corners = np.array([(0.25, y), (x - 0.9, 0.0)])
    assert not ahead(corners[1:], (linear_mps, 0.0), velocity=(0.0, 0.0), footprint=BOX)
    # A wall just inside the front: it can be driven away from, not pressed on.
    wall = [(0.19, side) for side in np.linspace(-0.2, 0.2, 21)]
    assert not ahead(wall, (-linear_mps, 0.0), velocity=(0.0, 0.0), footprint=BOX)
    assert ahead(wall, (linear_mps, 0.0), velocity=(0.0, 0.0), footprint=BOX)


@given(
    st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5)), max_size=10),
    st.floats(-0.6, 1.5),
    turns,
    st.floats(0.01, 0.5),
)
def test_a_polygon_meets_nothing_that_its_disc_would_not(
    points: list[tuple[float, float]], linear_mps: float, angular_radps: float, horizon_s: float
) -> None:
    outside = [point for point in points if math.hypot(*point) > BOX.radius_m + 0.02]
    disc = Footprint(BOX.radius_m + 0.02, BOX.z_m)
    command = (linear_mps, angular_radps)
    if ahead(outside, command, horizon_s=horizon_s, footprint=BOX):
        assert ahead(outside, command, horizon_s=horizon_s, footprint=disc)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.booleans())
def test_the_distance_from_a_rectangle_is_that_of_its_formula(x: float, y: float, turned: bool) -> None:
    corners = BOX.polygon[::-1] if turned else BOX.polygon
    footprint = Footprint(BOX.radius_m, BOX.z_m, corners)
    off_x, off_y = abs(x + 0.2) - 0.4, abs(y) - 0.25
    expected_m = math.hypot(max(off_x, 0.0), max(off_y, 0.0)) + min(max(off_x, off_y), 0.0)
    assert footprint.distance_m(np.array([(x, y)]))[0] == pytest.approx(expected_m, abs=1e-9)


@pytest.mark.parametrize(
    ("polygon", "why"),
    [
        (((0.1, 0.0), (0.0, 0.1)), "at least 3 corners"),
        (((0.3, 0.3), (0.3, -0.3), (-0.3, 0.0)), "reaches 0.424 m"),
        (((0.1, 0.1), (-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1)), "cross or touch"),
        (((0.1, 0.1), (0.1, 0.1), (-0.1, 0.1)), "no length"),
    ],
)
def test_an_outline_that_is_none_is_explained(polygon: tuple[tuple[float, float], ...], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        Footprint(0.3, (0.0, 1.0), polygon)


def test_a_lidar_shows_what_is_between_two_heights_and_what_is_too_near() -> None:
    # Rings 45° down and level, beams ahead and to the left; the lidar is 1 m above the floor.
    lidar: LidarScan = {
        "frame_id": "lidar",
        "ranges_m": np.array([[math.sqrt(0.5), math.sqrt(2.0)], [3.0, math.nan]], np.float32),
        "elevations_rad": np.array([-math.pi / 4, 0.0]),
        "azimuths_rad": np.array([0.0, math.pi / 2]),
    }
    mount = Pose.planar(0.2, 0.0, 0.0, z=1.0)
    np.testing.assert_allclose(obstacle_points(lidar, mount, (0.03, 0.9)), [(0.7, 0.0)], atol=1e-6)
    np.testing.assert_allclose(obstacle_points(lidar, mount, (0.03, 1.2)), [(0.7, 0.0), (3.2, 0.0)], atol=1e-6)
    lidar["ranges_m"][1, 1] = -math.inf
    assert (0.2, 0.0) in {tuple(point) for point in obstacle_points(lidar, mount, (0.03, 1.2)).round(6)}
    lidar["ranges_m"][:] = math.inf
    assert len(obstacle_points(lidar, mount, (0.03, 1.2))) == 0
