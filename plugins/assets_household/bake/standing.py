"""Where things can stand on a model: the largest free rectangle of each of its horizontal faces."""

from typing import Any

import numpy as np
import numpy.typing as npt

_CELL_M = 0.02
_STEP_M = 0.012
_LEAST_HEADROOM_M = 0.12
_LEAST_SIDE_M = 0.14
_OPEN_HEADROOM_M = 1.5
_SAMPLES_PER_M2 = 60_000


def standing_places(triangles: npt.NDArray[np.float64]) -> list[dict[str, Any]]:
    """Surfaces of the catalogue (z_m, low_m, high_m, headroom_m), lowest first; `triangles` (T, 3, 3), z up."""
    edges = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(edges, axis=1) / 2
    upward = edges[:, 2] > 0.97 * 2 * np.maximum(areas, 1e-12)
    points, from_upward = _sampled(triangles, areas, upward)
    low = points[:, :2].min(axis=0)
    cells = np.floor((points[:, :2] - low) / _CELL_M).astype(int)
    shape = tuple(cells.max(axis=0) + 1)
    places = []
    for z in _levels(points[from_upward, 2]):
        is_floor = from_upward & (np.abs(points[:, 2] - z) < _STEP_M)
        floor, blocked = np.zeros(shape, bool), np.zeros(shape, bool)
        floor[tuple(cells[is_floor].T)] = True
        above = (points[:, 2] > z + _STEP_M) & (points[:, 2] < z + _LEAST_HEADROOM_M)
        blocked[tuple(cells[above].T)] = True
        first, last = _largest_rectangle(floor & ~blocked)
        if (np.subtract(last, first) * _CELL_M).min() < _LEAST_SIDE_M:
            continue
        inside = np.all((cells >= first) & (cells < last), axis=1) & (points[:, 2] > z + _LEAST_HEADROOM_M)
        headroom = min(points[inside, 2].min() - z, _OPEN_HEADROOM_M) if inside.any() else _OPEN_HEADROOM_M
        places.append(
            {
                "z_m": round(float(z), 4),
                "low_m": [round(float(side), 3) for side in low + np.multiply(first, _CELL_M)],
                "high_m": [round(float(side), 3) for side in low + np.multiply(last, _CELL_M)],
                "headroom_m": round(float(headroom), 3),
            }
        )
    return places


def _sampled(
    triangles: npt.NDArray[np.float64], areas: npt.NDArray[np.float64], upward: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Points (P, 3) spread evenly over the triangles, and whether each lies on an upward one."""
    generator = np.random.default_rng(0)
    owner = np.repeat(np.arange(len(triangles)), np.ceil(areas * _SAMPLES_PER_M2).astype(int) + 1)
    a, b = generator.random((2, len(owner), 1))
    fold = a + b > 1
    a, b = np.where(fold, 1 - a, a), np.where(fold, 1 - b, b)
    first, second, third = triangles[owner].transpose(1, 0, 2)
    return first + a * (second - first) + b * (third - first), upward[owner]


def _levels(heights: npt.NDArray[np.float64]) -> list[float]:
    """Heights where many upward points lie together."""
    if not len(heights):
        return []
    counts = np.bincount(np.floor((heights - heights.min()) / _STEP_M).astype(int))
    least = _LEAST_SIDE_M**2 * _SAMPLES_PER_M2 / 2
    peaks = [i for i, count in enumerate(counts) if count > least and count == counts[max(i - 1, 0) : i + 2].max()]
    levels = []
    for peak in peaks:
        middle = heights.min() + (peak + 0.5) * _STEP_M
        levels.append(float(np.median(heights[np.abs(heights - middle) < _STEP_M])))
    return levels


def _largest_rectangle(free: npt.NDArray[np.bool_]) -> tuple[tuple[int, int], tuple[int, int]]:
    """The first and the one-past-last cell of the largest rectangle of True, by the histogram method."""
    best, corners = 0, ((0, 0), (0, 0))
    depth = np.zeros(free.shape[1], int)
    for row in range(free.shape[0]):
        depth = np.where(free[row], depth + 1, 0)
        stack: list[tuple[int, int]] = []
        for column, height in enumerate([*depth.tolist(), 0]):
            start = column
            while stack and stack[-1][1] >= height:
                start, tall = stack.pop()
                if tall * (column - start) > best:
                    best, corners = tall * (column - start), ((row + 1 - tall, start), (row + 1, column))
            stack.append((start, height))
    return corners
