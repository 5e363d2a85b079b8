"""An occupancy grid of drivable and of viewed floor, filled from laser and depth."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import FramePose, LaserScan
from benchbot.plugins.mapping.projection import Floats, rotation_matrix

Mask = NDArray[np.bool_]
Cell = tuple[int, int]
Point = tuple[float, float]

HIT, MISS, CERTAIN = 4, -1, 12
LASER_REACH_M = 10.0


class OccupancyGrid:
    """A square of the floor around `center`, in cells [i, j] along the map's x and y.

    The laser counts evidence for and against an obstacle in each cell (after Moravec and Elfes, "High resolution maps
    from wide angle sonar", ICRA 1985, with counts for log odds). What stands below or above the laser's plane is
    kept apart (`add_points`, `block`), for no beam can clear it.
    """

    def __init__(self, center: Point, size_m: float = 24.0, resolution_m: float = 0.05) -> None:
        self.resolution_m = resolution_m
        self.cells = round(size_m / resolution_m)
        self.looked_at: Mask = np.zeros((self.cells, self.cells), bool)
        self._lower = np.array(center) - size_m / 2
        self._evidence = np.zeros((self.cells, self.cells), np.int16)
        self._known = np.zeros((self.cells, self.cells), bool)
        self._obstacles = np.zeros((self.cells, self.cells), bool)

    @property
    def walls(self) -> Mask:
        """Cells with an obstacle in the laser's plane: what one cannot see past."""
        return self._evidence > 0

    @property
    def free(self) -> Mask:
        """Cells without an obstacle."""
        return self._known & ~self.walls & ~self._obstacles

    def drivable(self, radius_m: float, robot: Point) -> Mask:
        """Return where the middle of a robot can be: free cells that are `radius_m` from everything else.

        Around `robot`, where it evidently is, cells count as free.
        """
        # Most solutions that import this module drive nowhere, and scipy takes as long to import as all else.
        from scipy import ndimage

        free = self.free | (self._disc(robot, radius_m) & ~self.walls & ~self._obstacles)
        # Distances are worked out where something is free, and one cell around that.
        part = tuple(slice(max(extent.min() - 1, 0), extent.max() + 2) for extent in np.nonzero(free))
        drivable = self._disc(robot, 2 * self.resolution_m) & free
        drivable[part] |= ndimage.distance_transform_edt(free[part]) * self.resolution_m > radius_m
        return drivable

    def cell(self, point: Point) -> Cell:
        """Return the cell of a point; one outside of the grid has the nearest cell."""
        i, j = np.clip((np.array(point) - self._lower) / self.resolution_m, 0, self.cells - 1).astype(int)
        return int(i), int(j)

    def center(self, cell: Cell) -> Point:
        """Return the middle of a cell in the map frame."""
        x, y = self._lower + (np.array(cell) + 0.5) * self.resolution_m
        return float(x), float(y)

    def add_laser(self, laser: LaserScan, pose: FramePose) -> None:
        """Take in a scan: cells that beams cross are free, cells where they end are not. `pose` is the scanner's."""
        ranges_m, angles = laser["scans"][:, 0], laser["scans"][:, 1]
        valid = ~np.isnan(ranges_m) & (ranges_m >= laser["range_min"])
        ranges_m, angles = ranges_m[valid], angles[valid]
        directions = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], 1)
        directions = (directions @ rotation_matrix(pose["rotation_xyzw"]).T)[:, :2]
        origin = np.asarray(pose["translation_xyz"])[:2]

        hits = self._mask(origin + directions[ranges_m <= LASER_REACH_M] * ranges_m[ranges_m <= LASER_REACH_M, None])
        steps_m = np.arange(0, LASER_REACH_M, self.resolution_m / 2)
        beam, step = np.nonzero(steps_m < np.minimum(ranges_m, LASER_REACH_M)[:, None] - self.resolution_m)
        crossed = self._mask(origin + directions[beam] * steps_m[step, None]) & ~hits
        self._evidence += HIT * hits.astype(np.int16) + MISS * crossed.astype(np.int16)
        np.clip(self._evidence, -CERTAIN, CERTAIN, out=self._evidence)
        self._known |= hits | crossed

    def add_points(self, points: Floats) -> None:
        """Take in surface points (N, 3) in the map frame, of obstacles between the floor and the robot's top."""
        self._obstacles |= self._mask(points[:, :2])

    def block(self, point: Point, radius_m: float) -> None:
        """Note an obstacle that no sensor shows, of this radius."""
        self._obstacles |= self._disc(point, radius_m)

    def _disc(self, point: Point, radius_m: float) -> Mask:
        """Return a mask of the cells around a point."""
        i, j = self.cell(point)
        rows, columns = np.ogrid[: self.cells, : self.cells]
        disc: Mask = (rows - i) ** 2 + (columns - j) ** 2 <= (radius_m / self.resolution_m) ** 2
        return disc

    def _mask(self, points: NDArray[Any]) -> Mask:
        """Return a mask of the cells that hold points (N, 2); points outside of the grid are left out."""
        cells = np.floor((points - self._lower) / self.resolution_m).astype(np.int64)
        cells = cells[((cells >= 0) & (cells < self.cells)).all(axis=1)]
        mask = np.zeros((self.cells, self.cells), bool)
        mask[cells[:, 0], cells[:, 1]] = True
        return mask
