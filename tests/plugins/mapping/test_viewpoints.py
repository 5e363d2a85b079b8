import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.channels import CameraModel
from benchbot.core.geometry import Pose
from benchbot.mapping import OccupancyGrid, Sight, best_viewpoint, look
from tests.plugins.mapping.casting import Box, scan

SIGHT = Sight(math.pi / 2, near_m=0.3, far_m=3.0)
SCREEN: Box = (0, (1.0, -1.5, 0.0), (1.1, 1.5, 1.0))


def room() -> OccupancyGrid:
    """A closed room, 6 m x 4 m, with a screen in it, scanned from both sides."""
    walls: list[Box] = [
        (0, (-3.1, -2.1, 0), (-3, 2.1, 1)),
        (0, (3, -2.1, 0), (3.1, 2.1, 1)),
        (0, (-3, -2.1, 0), (3, -2, 1)),
        (0, (-3, 2, 0), (3, 2.1, 1)),
    ]
    grid = OccupancyGrid((0, 0), size_m=8)
    for x in (0.0, 2.0):
        lidar = Pose.planar(x, 0, 0, z=0.5)
        grid.add_laser(scan([*walls, SCREEN], lidar, beams=720), lidar.record("map"))
    return grid


def test_the_camera_sees_ahead_and_not_through_walls() -> None:
    grid = room()
    look(grid, (0, 0), 0.0, SIGHT)

    assert grid.looked_at[grid.cell((0.9, 0))]
    assert not grid.looked_at[grid.cell((1.5, 0))]
    assert not grid.looked_at[grid.cell((-0.9, 0))]
    assert not grid.looked_at[grid.cell((0.1, 0))], "that is below the image"


def test_the_best_viewpoint_shows_what_is_new() -> None:
    grid = room()
    for heading in np.arange(0, 2 * np.pi, np.pi / 2):
        look(grid, (0, 0), heading, SIGHT)
    chosen = best_viewpoint(grid, grid.drivable(0.3, (0, 0)), grid.cell((0, 0)), SIGHT, least_gain=50)
    assert chosen is not None

    before = np.count_nonzero(grid.looked_at)
    look(grid, grid.center(chosen.cell), chosen.heading_rad, SIGHT)
    shown = np.count_nonzero(grid.looked_at) - before
    assert 0.6 * chosen.gain < shown < 1.6 * chosen.gain


def test_looking_where_one_is_sent_comes_to_an_end() -> None:
    grid = room()
    drivable = grid.drivable(0.3, (0, 0))
    for _ in range(40):
        chosen = best_viewpoint(grid, drivable, grid.cell((0, 0)), SIGHT, least_gain=50)
        if chosen is None:
            break
        look(grid, grid.center(chosen.cell), chosen.heading_rad, SIGHT)

    assert chosen is None
    before_the_screen = grid.free & (np.arange(grid.cells) < grid.cell((0.9, 0))[0])[:, None]
    assert np.count_nonzero(grid.looked_at & before_the_screen) > 0.9 * np.count_nonzero(before_the_screen)


def test_a_robot_that_cannot_move_has_nowhere_to_go() -> None:
    grid = OccupancyGrid((0, 0), size_m=4)

    assert best_viewpoint(grid, grid.free, grid.cell((0, 0)), SIGHT, least_gain=1) is None


SCREENS: list[Box] = [(0, (1.0, -1.0, 0.0), (1.3, 1.0, 1.0)), (0, (-1.5, 0.5, 0.0), (-1.2, 1.8, 1.0))]


@cache
def screens() -> OccupancyGrid:
    """Two screens in the open, scanned from all around."""
    grid = OccupancyGrid((0, 0), size_m=8)
    for x, y in ((0, -1.4), (2.2, 1.4), (-2.2, 1.4), (0, 1.4)):
        lidar = Pose.planar(x, y, 0, z=0.5)
        grid.add_laser(scan(SCREENS, lidar, beams=1440), lidar.record("map"))
    return grid


@settings(max_examples=60)
@given(
    x=st.floats(-2.5, 2.5),
    y=st.floats(-1.8, 1.8),
    heading_rad=st.floats(-math.pi, math.pi),
    width_rad=st.floats(0.3, 2.0),
    far_m=st.floats(1.0, 4.0),
)
def test_what_is_looked_at_can_be_seen_from_there(
    x: float, y: float, heading_rad: float, width_rad: float, far_m: float
) -> None:
    """By a line of sight that is drawn by itself: in view, within reach, and through no wall."""
    grid = screens()
    grid.looked_at[:] = False
    look(grid, (x, y), heading_rad, Sight(width_rad, near_m=0.3, far_m=far_m))

    origin = np.array(grid.center(grid.cell((x, y))))
    seen = np.array([grid.center((int(i), int(j))) for i, j in np.argwhere(grid.looked_at)]).reshape(-1, 2)
    away = seen - origin
    aside_rad = np.abs((np.arctan2(away[:, 1], away[:, 0]) - heading_rad + math.pi) % (2 * math.pi) - math.pi)
    # A ray ends in the cell whose middle is nearest, at most 0.71 cells aside, and reaches half a cell too far.
    slack_m = 1.25 * grid.resolution_m
    assert (np.hypot(*away.T) <= far_m + slack_m).all()
    assert (aside_rad <= width_rad / 2 + slack_m / np.maximum(np.hypot(*away.T), slack_m)).all()
    for _, low, high in SCREENS:
        # What hides is the outermost cell of a screen; a ray may cut off its corner.
        left, right, bottom, top = low[0] + 0.1, high[0] - 0.1, low[1] + 0.1, high[1] - 0.1
        if left - 0.2 < origin[0] < right + 0.2 and bottom - 0.2 < origin[1] < top + 0.2:
            continue
        for share in np.linspace(0, 1, 60):
            px, py = (origin + share * away).T
            assert not ((px > left) & (px < right) & (py > bottom) & (py < top)).any()


def test_the_sight_of_a_camera_is_that_of_its_model() -> None:
    matrix = np.array([[100.0, 0, 100], [0, 100, 50], [0, 0, 1]])
    info = CameraModel(
        frame_id="camera", width=200, height=100, matrix_intrinsics=matrix, matrix_projection=np.eye(3, 4)
    )
    sight = Sight.of(info, height_m=0.5)

    assert sight.field_of_view_rad == pytest.approx(math.pi / 2)
    assert sight.near_m == pytest.approx(1.0), "the lowest row looks down by as much as the camera is high"


def test_what_is_near_across_a_wall_is_far() -> None:
    """Two places are not looked at: one behind the screen, 1.2 m from the robot, and one 2.8 m ahead of it."""
    grid = room()
    grid.looked_at[:] = True
    for place in ((1.8, 0.0), (-2.2, 0.0)):
        i, j = grid.cell(place)
        grid.looked_at[i - 8 : i + 9, j - 8 : j + 9] = False
    robot = (0.6, 0.0)
    chosen = best_viewpoint(
        grid, grid.drivable(0.2, robot), grid.cell(robot), Sight(math.pi / 2, near_m=0.1, far_m=1.0), least_gain=50
    )

    assert chosen is not None
    assert grid.center(chosen.cell)[0] < robot[0]


@cache
def posts() -> OccupancyGrid:
    """A clear floor within two rings of posts, scanned from its middle."""
    posts: list[Box] = [
        (0, (x - 0.02, y - 0.02, 0.0), (x + 0.02, y + 0.02, 1.0))
        for radius_m, count in ((1.0, 40), (1.4, 70))
        for x, y in ((radius_m * math.cos(t), radius_m * math.sin(t)) for t in np.arange(count) * 2 * math.pi / count)
    ]
    grid = OccupancyGrid((0, 0), size_m=8)
    lidar = Pose.planar(0, 0, 0, z=0.5)
    grid.add_laser(scan(posts, lidar, beams=1440), lidar.record("map"))
    return grid


def test_a_look_shows_all_that_the_viewpoint_was_weighed_by() -> None:
    """What is looked at once is not chosen again, though it is seen through gaps between posts only."""
    grid = posts()
    drivable, robot = grid.drivable(0.2, (0, 0)), grid.cell((0, 0))
    chosen = set()
    while viewpoint := best_viewpoint(grid, drivable, robot, SIGHT, least_gain=1):
        assert (viewpoint.cell, viewpoint.heading_rad) not in chosen
        chosen.add((viewpoint.cell, viewpoint.heading_rad))
        look(grid, grid.center(viewpoint.cell), viewpoint.heading_rad, SIGHT)
    assert chosen
