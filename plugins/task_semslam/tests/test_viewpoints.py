import math

import numpy as np

from benchbot.core.geometry import Pose
from benchbot_task_semslam.mapping.occupancy import OccupancyGrid
from benchbot_task_semslam.mapping.viewpoints import Sight, best_viewpoint, look
from plugins.task_semslam.tests.casting import Box, scan

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
