"""The free space of a scene: the distance from every cell of the floor to the nearest obstacle."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.slab import project_slab, rasterise

Bools = npt.NDArray[np.bool_]
CELL_M = 0.05
# Obstacles are drawn finer than the cells that are asked about.
SUBCELLS = 4
BORDER_CELLS = 4
# A floor may be a little uneven, and have cracks and holes that a wheel does not fall into.
FLOOR_BAND_M = (-0.10, 0.03)
FLOOR_GAP_M = 0.25


@dataclass(frozen=True)
class FreeSpace:
    """Clearances on a grid: `clearance_m` (columns along x, rows along y), from each cell's centre to what is nearest.

    Never overstated, and at most 2 cm understated; 0 in what blocks and where there is no floor. `low_m` is the outer
    corner of cell (0, 0) in the map frame; `is_blocked` says which cells something stands in, `has_floor` which have
    ground to stand on.
    """

    low_m: tuple[float, float]
    cell_m: float
    clearance_m: npt.NDArray[np.float32]
    is_blocked: Bools
    has_floor: Bools

    @property
    def shape(self) -> tuple[int, int]:
        """Number of columns and rows."""
        columns, rows = self.clearance_m.shape
        return columns, rows

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """The cell that a point lies in, which may be outside the grid."""
        return math.floor((x - self.low_m[0]) / self.cell_m), math.floor((y - self.low_m[1]) / self.cell_m)

    def centre(self, column: int, row: int) -> tuple[float, float]:
        """The middle of a cell in the map frame."""
        return self.low_m[0] + (column + 0.5) * self.cell_m, self.low_m[1] + (row + 0.5) * self.cell_m

    def clearance_at(self, x: float, y: float) -> float:
        """The clearance at any point, no more than it is: a distance changes by at most the way; 0 off the grid."""
        column, row = self.cell(x, y)
        if not (0 <= column < self.shape[0] and 0 <= row < self.shape[1]):
            return 0.0
        return max(0.0, float(self.clearance_m[column, row]) - math.dist((x, y), self.centre(column, row)))

    def region(self, start: tuple[float, float], radius_m: float) -> Bools:
        """The cells that a disc can reach from `start`; none when it does not fit within 10 cm of there."""
        labels, _ = ndimage.label(self.clearance_m >= radius_m)
        column, row = self.cell(*start)
        reach = math.ceil(0.10 / self.cell_m)
        near = [
            (abs(i) + abs(j), int(labels[column + i, row + j]))
            for i in range(-reach, reach + 1)
            for j in range(-reach, reach + 1)
            if 0 <= column + i < self.shape[0] and 0 <= row + j < self.shape[1] and labels[column + i, row + j]
        ]
        mask: Bools = labels == min(near)[1] if near else np.zeros(self.shape, bool)
        return mask

    def largest_region(self, radius_m: float) -> Bools:
        """The largest connected set of cells that a disc fits in; none when it fits nowhere."""
        labels, count = ndimage.label(self.clearance_m >= radius_m)
        if count == 0:
            return np.zeros(self.shape, bool)
        mask: Bools = labels == 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))
        return mask


def free_space(
    geometry: SceneGeometry, z_min_m: float, z_max_m: float, floor_z_m: float = 0.0, cell_m: float = CELL_M
) -> FreeSpace:
    """The clearances from a scene's triangles between two heights above the floor, for a robot that stands on it."""
    triangles = geometry.vertices[geometry.triangles].astype(np.float64)
    obstacles = project_slab(triangles, floor_z_m + z_min_m, floor_z_m + z_max_m)
    floor = project_slab(triangles, floor_z_m + FLOOR_BAND_M[0], floor_z_m + FLOOR_BAND_M[1])
    return from_polygons([obstacles], [floor], cell_m)


def from_polygons(
    obstacles: Sequence[npt.NDArray[np.float64]],
    floors: Sequence[npt.NDArray[np.float64]],
    cell_m: float = CELL_M,
) -> FreeSpace:
    """The clearances from what blocks and what carries: arrays of convex polygons (P, N, 2), metres, map frame."""
    corners = [polygons.reshape(-1, 2) for polygons in (*obstacles, *floors) if polygons.size]
    low, high = _bounds(corners, cell_m)
    shape = tuple(np.rint((high - low) / cell_m).astype(int).tolist())
    corner = (float(low[0]), float(low[1]))
    fine_m, fine = cell_m / SUBCELLS, (shape[0] * SUBCELLS, shape[1] * SUBCELLS)
    blocked, carried = np.zeros(fine, bool), np.zeros(fine, bool)
    for polygons in obstacles:
        blocked |= rasterise(polygons, corner, fine, fine_m)
    for polygons in floors:
        carried |= rasterise(polygons, corner, fine, fine_m)
    gap = round(FLOOR_GAP_M / fine_m / 2)
    near_floor = ndimage.distance_transform_edt(~carried) <= gap
    carried |= ndimage.distance_transform_edt(near_floor) > gap
    free = ~blocked & carried
    distance = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1]
    # From a fine cell's middle to the middle of the nearest one that blocks, less how far in that the obstacle may be.
    fine_clearance = np.maximum(0.0, (distance - math.sqrt(0.5)) * fine_m)
    # A cell's centre is a corner of four fine cells; a distance changes by at most the way.
    blocks = fine_clearance.reshape(shape[0], SUBCELLS, shape[1], SUBCELLS)
    middle = slice(SUBCELLS // 2 - 1, SUBCELLS // 2 + 1)
    clearance = np.maximum(0.0, blocks[:, middle, :, middle].max((1, 3)) - fine_m * math.sqrt(0.5))
    whole = (shape[0], SUBCELLS, shape[1], SUBCELLS)
    return FreeSpace(
        corner,
        cell_m,
        clearance.astype(np.float32),
        np.asarray(blocked.reshape(whole).any((1, 3))),
        np.asarray(carried.reshape(whole).any((1, 3))),
    )


def _bounds(
    corners: Sequence[npt.NDArray[np.float64]], cell_m: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    border = BORDER_CELLS * cell_m
    if not corners:
        return np.full(2, -border), np.full(2, border)
    points = np.concatenate(corners)
    low = np.floor(points.min(0) / cell_m) * cell_m - border
    high = np.ceil(points.max(0) / cell_m) * cell_m + border
    return low, high
