"""The map of a scene from labelled points of many frames: voxels with class probabilities, and the objects in them."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from benchbot.mapping import CLASS_LIST, MappedObject, clusters
from benchbot_baselines.segmenter import Sighting, softmax

RESOLUTION_M = 0.05
TOUCHING = 1.8
"""Voxels touch at faces, edges and corners: their centres are up to so many edges apart."""
FEWEST_POINTS = 100
"""Of an object, in all frames together, whose pictures are 320 pixels wide."""
LEAST_PROBABILITY = 1e-3
"""A single view that is sure of another class does not rule a class out."""
NEAREST_M = 0.5
LEAST_LENGTH_M: Mapping[str, float] = {
    "bottle": 0.13,
    "cup": 0.07,
    "knife": 0.13,
    "bowl": 0.1,
    "wine glass": 0.1,
    "fork": 0.09,
    "spoon": 0.08,
    "banana": 0.1,
    "apple": 0.05,
    "orange": 0.04,
    "cake": 0.07,
    "potted plant": 0.14,
    "mouse": 0.06,
    "keyboard": 0.17,
    "laptop": 0.19,
    "cell phone": 0.09,
    "book": 0.14,
    "clock": 0.1,
    "chair": 0.5,
    "table": 0.3,
    "couch": 0.7,
    "bed": 1.28,
    "toilet": 0.47,
    "tv": 0.32,
    "microwave": 0.27,
    "toaster": 0.18,
    "refrigerator": 0.9,
    "oven": 0.54,
    "sink": 0.62,
    "person": 0.79,
}
"""The longest side that an object of a class has at least: 0.6 of the smallest of the models that places are furnished
with. What is shorter is a fragment, such as the leg of a table that was taken for a chair's."""

BACKGROUND = CLASS_LIST[-1]

# A voxel's three indices, counted from where the first point was, in one integer.
_BITS = 21
_HALF = 1 << (_BITS - 1)
_MASK = (1 << _BITS) - 1
_FEWEST_WAITING = 200_000


class ClassMap:
    """A sparse grid of cubes in the map frame; every point in one says how likely it is of which class.

    A voxel's probabilities are the geometric mean of its points', weighted by nearness, and normalised. A mean, as
    views of one surface are far from independent.
    """

    def __init__(self, class_list: Sequence[str]) -> None:
        self.class_list = tuple(class_list)
        self._voxels = _none(len(self.class_list))
        self._waiting: list[_Rows] = []
        self._origin: NDArray[np.float64] | None = None

    def add(self, seen: Sighting) -> None:
        """Take in the points of a frame."""
        if not len(seen.points):
            return
        near = 1 / np.maximum(seen.depth_m, NEAREST_M)
        evidence = np.log(np.maximum(seen.label_probs, LEAST_PROBABILITY)) * near[:, None]
        indices = np.floor(seen.points / RESOLUTION_M)
        if self._origin is None:
            self._origin = indices[0]
        i, j, k = (indices - self._origin).astype(np.int64).T + _HALF
        sums = np.column_stack([np.ones_like(near), near, evidence]).astype(np.float32)
        self._waiting.append(_joined([(i << 2 * _BITS | j << _BITS | k, sums, seen.points, seen.points)]))
        # Sorting the whole map for each frame would cost more than all else.
        if sum(len(rows[0]) for rows in self._waiting) > max(_FEWEST_WAITING, len(self._voxels[0])):
            self._settle()

    def _settle(self) -> None:
        self._voxels, self._waiting = _joined([self._voxels, *self._waiting]), []

    def objects(self, fewest_points: int = FEWEST_POINTS) -> list[MappedObject]:
        """Return the objects: touching voxels of one most likely class, that are no fragments.

        A box just holds the points in its voxels; its class probabilities are their mean, weighted by points.
        """
        self._settle()
        keys, sums, lower, upper = self._voxels
        if not len(keys):
            return []
        centers = np.stack([keys >> 2 * _BITS, keys >> _BITS & _MASK, keys & _MASK], axis=1) - _HALF + 0.5
        points = sums[:, 0]
        likely = softmax(sums[:, 2:] / sums[:, 1:2])
        best = likely.argmax(axis=1)
        found: list[MappedObject] = []
        for number, name in enumerate(self.class_list):
            if name == BACKGROUND:
                continue
            chosen = np.flatnonzero(best == number)
            groups = clusters(centers[chosen].astype(np.float32), TOUCHING)
            for group in range(int(groups.max(initial=-1)) + 1):
                members = chosen[groups == group]
                low, high = lower[members].min(axis=0), upper[members].max(axis=0)
                count = int(points[members].sum())
                if count < fewest_points or (high - low).max() < LEAST_LENGTH_M.get(name, 0.0):
                    continue
                mean = np.average(likely[members].astype(np.float64), axis=0, weights=points[members])
                named = dict(zip(self.class_list, (mean / mean.sum()).tolist(), strict=True))
                found.append(MappedObject(named, low, high, count))
        return found


_Rows = tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
"""Keys (M,) of voxels; sums (M, 2 + K): points, weights, and weighted logarithms of probabilities; corners (M, 3)."""


def _none(classes: int) -> _Rows:
    corners = np.zeros((0, 3), np.float32)
    return np.zeros(0, np.int64), np.zeros((0, 2 + classes), np.float32), corners, corners


def _joined(parts: Sequence[_Rows]) -> _Rows:
    """Return the rows of several maps with one row for each voxel, in the order of their keys."""
    keys, sums, lower, upper = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    starts = np.flatnonzero(np.diff(keys, prepend=-1))
    if not len(starts):
        return keys, sums, lower, upper
    return (
        keys[starts],
        np.add.reduceat(sums[order], starts),
        np.minimum.reduceat(lower[order], starts),
        np.maximum.reduceat(upper[order], starts),
    )
