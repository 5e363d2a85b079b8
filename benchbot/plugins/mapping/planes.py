"""Floor and walls in a cloud of points: what a detector without a class for them has to leave out."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchbot.plugins.mapping.lens import Doubles

Mask = NDArray[np.bool_]

CELL_M, LAYER_M = 0.05, 0.1
LARGEST_GAP_M = 0.25
_ANGLES = 180


def floor_height_m(points: ArrayLike, lowest_m: float = -0.15, highest_m: float = 0.15) -> float:
    """Return the height z of the floor: that of the fullest layer of points (N, 3) between two heights, metres.

    It is 0 in simulation, and about 0 on a real robot, whose camera may be a degree or a centimetre off. Give it the
    points of several frames, as there may be no floor in one. Without points at these heights it is 0.
    """
    z = np.asarray(points, np.float64).reshape(-1, 3)[:, 2]
    z = np.sort(z[(z >= lowest_m) & (z <= highest_m)])
    if not len(z):
        return 0.0
    # The window of 2 cm that holds most points; their median is finer than any bin.
    ends = np.searchsorted(z, z + 0.02, side="right")
    start = int(np.argmax(ends - np.arange(len(z))))
    return float(np.median(z[start : ends[start]]))


def on_floor(points: ArrayLike, height_m: float = 0.0, tolerance_m: float = 0.03) -> Mask:
    """Say which points (N, 3) are on the floor, or below it, as reflections are."""
    return np.asarray(np.asarray(points, np.float64).reshape(-1, 3)[:, 2] <= height_m + tolerance_m)


def on_walls(
    points: ArrayLike, least_height_m: float = 1.2, least_length_m: float = 1.0, tolerance_m: float = 0.06
) -> Mask:
    """Say which points (N, 3) are on large vertical planes, of which so much was seen upwards and along.

    A wall is a straight line on the floor plan, without wide gaps, of columns that are filled over `least_height_m`;
    lines are found the longest first (Hough, "Method and means for recognizing complex patterns", US patent 3069654,
    1962). The front of a tall cupboard is one as well.
    """
    given = np.asarray(points, np.float64).reshape(-1, 3)
    found = np.zeros(len(given), bool)
    columns = _tall_columns(given, least_height_m)
    normals_rad = np.arange(_ANGLES) * (np.pi / _ANGLES)
    normals = np.stack([np.cos(normals_rad), np.sin(normals_rad)])
    while len(columns) * CELL_M >= least_length_m:
        offsets = np.rint(columns @ normals / tolerance_m).astype(np.int64)
        lowest = offsets.min()
        votes = np.zeros((_ANGLES, int(offsets.max() - lowest) + 1), np.int64)
        np.add.at(votes, (np.broadcast_to(np.arange(_ANGLES), offsets.shape), offsets - lowest), 1)
        angle, offset = np.unravel_index(int(votes.argmax()), votes.shape)
        if votes[angle, offset] * CELL_M < least_length_m:
            break
        normal, distance = _fitted(columns[offsets[:, angle] == offset + lowest])
        direction = np.array([-normal[1], normal[0]])
        on_line = np.abs(columns @ normal - distance) <= tolerance_m
        on_plane = np.abs(given[:, :2] @ normal - distance) <= tolerance_m
        reach = given[:, :2] @ direction
        for start, end in _runs(columns[on_line] @ direction, least_length_m):
            found |= on_plane & (reach >= start - CELL_M) & (reach <= end + CELL_M)
        # A line that is none of a wall, but crosses several, is not looked at again either.
        columns = columns[~(on_line | (offsets[:, angle] == offset + lowest))]
    return found


def _runs(along: Doubles, least_length_m: float) -> list[tuple[float, float]]:
    """Return where stretches of places on a line begin and end that have no wide gap and are long enough."""
    along = np.sort(along)
    breaks = np.flatnonzero(np.diff(along) > LARGEST_GAP_M)
    ends = [*along[breaks].tolist(), float(along[-1])] if len(along) else []
    starts = [float(along[0]), *along[breaks + 1].tolist()] if len(along) else []
    return [(start, end) for start, end in zip(starts, ends, strict=True) if end - start + CELL_M >= least_length_m]


def _tall_columns(points: Doubles, least_height_m: float) -> Doubles:
    """Return the middles (M, 2) of the columns of cells that are filled over a height.

    Filled, as a table below a ceiling reaches as high as a wall.
    """
    if not len(points):
        return np.zeros((0, 2))
    scale = np.array([CELL_M, CELL_M, LAYER_M])
    filled = np.unique(np.floor(points / scale), axis=0)
    cells, layers = np.unique(filled[:, :2], axis=0, return_counts=True)
    return np.asarray((cells[layers * LAYER_M >= least_height_m - 1e-9] + 0.5) * CELL_M)


def _fitted(points: Doubles) -> tuple[Doubles, float]:
    """Return the unit normal and the distance from the origin of the line through points (N, 2) by least squares."""
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=len(points) < 2)[2][-1]
    return normal, float(middle @ normal)
