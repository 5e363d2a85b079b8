import numpy as np
import pytest

from benchbot.core.geometry import Pose
from benchbot.plugins.mapping.occupancy import OccupancyGrid
from tests.plugins.mapping.casting import Box, scan

POST: Box = (0, (2.0, -0.2, 0.0), (2.4, 0.2, 1.0))


def scanned(boxes: list[Box], pose: Pose | None = None) -> OccupancyGrid:
    lidar = pose or Pose.planar(0, 0, 0, z=0.5)
    grid = OccupancyGrid((0, 0), size_m=8)
    grid.add_laser(scan(boxes, lidar), lidar.record("map"))
    return grid


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -3.0])
def test_beams_free_what_they_cross_and_end_at_walls(yaw_rad: float) -> None:
    grid = scanned([POST], Pose.planar(0, 0, yaw_rad, z=0.5))

    assert grid.free[grid.cell((1.5, 0))]
    assert grid.walls[grid.cell((2.01, 0))]
    assert not grid.free[grid.cell((3, 0))], "nobody knows what is behind"
    assert not grid.walls[grid.cell((3, 0))]


def test_what_moved_away_is_forgotten() -> None:
    grid = scanned([POST])
    lidar = Pose.planar(0, 0, 0, z=0.5)
    for _ in range(5):
        grid.add_laser(scan([], lidar), lidar.record("map"))

    assert grid.free[grid.cell((2.01, 0))]


def test_no_beam_clears_an_obstacle_below_it() -> None:
    grid = OccupancyGrid((0, 0), size_m=8)
    grid.add_points(np.array([[1, 0, 0.2], [99, 0, 0.2]], np.float32))
    lidar = Pose.planar(0, 0, 0, z=0.5)
    grid.add_laser(scan([], lidar), lidar.record("map"))

    assert not grid.free[grid.cell((1, 0))]
    assert not grid.walls[grid.cell((1, 0))], "one can see past it"


def test_invalid_beams_are_left_out() -> None:
    grid = OccupancyGrid((0, 0), size_m=8)
    scans = np.array([[np.nan, 0.0], [0.01, 0.1]])
    grid.add_laser({"scans": scans, "range_min": 0.1, "range_max": 20.0}, Pose.planar(0, 0, 0).record("map"))

    assert not grid.free.any()
    assert not grid.walls.any()


def test_the_robot_keeps_its_distance() -> None:
    grid = scanned([POST])
    drivable = grid.drivable(0.3, (0, 0))

    cells = np.argwhere(drivable)
    nearest_m = min(np.hypot(max(2.0 - x, 0), max(abs(y) - 0.2, 0)) for x, y in map(grid.center, map(tuple, cells)))
    assert nearest_m == pytest.approx(0.3, abs=0.08)
    assert drivable[grid.cell((0, 0))], "where it is, it can be"


def test_a_blocked_spot_is_an_obstacle() -> None:
    grid = scanned([])
    grid.block((1, 1), 0.1)

    assert not grid.free[grid.cell((1.05, 1))]
    assert grid.free[grid.cell((1.3, 1))]


def test_cells_and_points_agree() -> None:
    grid = OccupancyGrid((3, -2), size_m=4)

    assert grid.cell(grid.center((7, 9))) == (7, 9)
    assert grid.cell((99, -99)) == (grid.cells - 1, 0)
