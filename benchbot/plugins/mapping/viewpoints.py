"""The choice of the next viewpoint: the one that shows most beyond the frontier for the length of the path to it.

A frontier is where what has been looked at ends and there is more to see (Yamauchi, "A frontier-based approach for
autonomous exploration", CIRA 1997). Viewpoints are weighed by what they would show and how far they are (González-Baños
and Latombe, "Navigation strategies for exploring indoor environments", IJRR 21, 2002).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import CameraModel
from benchbot.plugins.mapping.occupancy import Cell, Mask, OccupancyGrid, Point
from benchbot.plugins.mapping.paths import way_lengths

RAYS = 120
"""The rays all around of a viewpoint that is weighed."""
FINE_RAYS = 4 * RAYS
"""Those of a look, which are the same and more, so that it shows whatever the viewpoint was weighed by."""
SPACING_M = 0.25
DISCOUNT_PER_M = 0.35


@dataclass(frozen=True)
class Sight:
    """The useful view of the camera: its field of view, and the range of distances at which it shows the floor."""

    field_of_view_rad: float
    near_m: float
    far_m: float

    @classmethod
    def of(cls, info: CameraModel, height_m: float, far_m: float = 4.0) -> "Sight":
        """Return the sight of a level camera at a height: from where its lowest row meets the floor."""
        matrix = np.asarray(info["matrix_intrinsics"])
        near_m = height_m * matrix[1, 1] / (info["height"] - matrix[1, 2])
        return cls(2 * math.atan(info["width"] / 2 / matrix[0, 0]), min(float(near_m), far_m / 2), far_m)


@dataclass(frozen=True)
class Viewpoint:
    """A place to go to, the heading to look in, and how many cells that have not been looked at it should show."""

    cell: Cell
    heading_rad: float
    gain: int


def look(grid: OccupancyGrid, position: Point, heading_rad: float, sight: Sight) -> None:
    """Mark the cells that are seen from here as looked at."""
    angles = np.arange(FINE_RAYS) * (2 * math.pi / FINE_RAYS)
    aside_rad = np.abs((angles - heading_rad + math.pi) % (2 * math.pi) - math.pi)
    angles = angles[aside_rad <= sight.field_of_view_rad / 2]
    i, j, seen = _rays(grid, np.array([grid.cell(position)]), angles, sight)
    grid.looked_at[i[seen], j[seen]] = True


def best_viewpoint(grid: OccupancyGrid, drivable: Mask, robot: Cell, sight: Sight, least_gain: int) -> Viewpoint | None:
    """Return the best reachable viewpoint, or None when no frontier is left that is worth the way.

    One that is worth it shows `least_gain` new cells, and as many more for each metre to it.
    """
    ways_m = way_lengths(drivable, robot) * grid.resolution_m
    reachable = np.isfinite(ways_m) & drivable
    stride = max(1, round(SPACING_M / grid.resolution_m))
    on_raster = np.zeros_like(reachable)
    on_raster[robot[0] % stride :: stride, robot[1] % stride :: stride] = True
    candidates = np.argwhere(reachable & on_raster)
    if not len(candidates):
        return None
    angles = np.arange(RAYS) * (2 * math.pi / RAYS)
    i, j, seen = _rays(grid, candidates, angles, sight)
    # Rays spread: the farther away, the more cells each stands for.
    weight = np.arange(1, i.shape[-1] + 1) * (2 * math.pi / RAYS)
    new = ((seen & ~grid.looked_at[i, j]) * weight).sum(axis=-1)
    width = max(1, round(sight.field_of_view_rad / (2 * math.pi) * RAYS))
    gains = _circular_window(new, width)
    best = gains.max(axis=1)
    away_m = ways_m[tuple(candidates.T)]
    worth = np.where(best >= least_gain * (1 + away_m), best * np.exp(-DISCOUNT_PER_M * away_m), 0.0)
    chosen = int(np.argmax(worth))
    if worth[chosen] <= 0:
        return None
    heading = angles[int(np.argmax(gains[chosen]))] + (width - 1) / 2 * (2 * math.pi / RAYS)
    return Viewpoint((int(candidates[chosen, 0]), int(candidates[chosen, 1])), float(heading), int(best[chosen]))


def _rays(
    grid: OccupancyGrid, origins: NDArray[np.int64], angles: NDArray[np.floating], sight: Sight
) -> tuple[NDArray[np.int64], NDArray[np.int64], Mask]:
    """Return the cells (origins, angles, steps) along rays, and which of them are seen: up to the first wall."""
    steps = np.arange(1, round(sight.far_m / grid.resolution_m) + 1)
    offsets = np.stack([np.cos(angles), np.sin(angles)])[:, :, None] * steps
    i = np.rint(origins[:, 0, None, None] + offsets[0]).astype(np.int64)
    j = np.rint(origins[:, 1, None, None] + offsets[1]).astype(np.int64)
    within = (i >= 0) & (i < grid.cells) & (j >= 0) & (j < grid.cells)
    i, j = np.clip(i, 0, grid.cells - 1), np.clip(j, 0, grid.cells - 1)
    walls = grid.walls[i, j]
    behind = np.cumsum(walls, axis=-1) - walls
    return i, j, within & (behind == 0) & (steps * grid.resolution_m >= sight.near_m)


def _circular_window(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Return the sums of `width` values in a row (N, RAYS), beginning at each, around the circle."""
    twice = np.cumsum(np.concatenate([np.zeros((len(values), 1)), values, values], axis=1), axis=1)
    sums: NDArray[np.float64] = twice[:, width : width + RAYS] - twice[:, :RAYS]
    return sums
