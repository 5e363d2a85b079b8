"""A map of voxels: points of many views with colours and class probabilities, and the objects that they make up."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchbot.plugin import BenchbotError, FailureClass
from benchbot.plugins.formats.object_map import BACKGROUND
from benchbot.plugins.mapping.objects import FEWEST_POINTS, MappedObject
from benchbot.plugins.mapping.projection import Floats

# A voxel's three indices in one integer, each from -2^20 to 2^20.
_BITS = 21
_HALF = 1 << (_BITS - 1)
_MASK = (1 << _BITS) - 1


@dataclass(frozen=True)
class Voxels:
    """The occupied voxels of a map, in the order of their places.

    `centers` (M, 3) metres; `counts` (M,) points that fell into each; `colors` uint8 (M, 3), the mean of theirs;
    `label_probs` (M, K), the mean of theirs, over the map's `class_list`.
    """

    centers: Floats
    counts: NDArray[np.int64]
    colors: NDArray[np.uint8]
    label_probs: NDArray[np.float64]


class VoxelMap:
    """A sparse grid of cubes in the map frame, filled with points in any order."""

    def __init__(self, class_list: Sequence[str] = (), resolution_m: float = 0.05) -> None:
        self.class_list = tuple(class_list)
        self.resolution_m = resolution_m
        self._keys = np.zeros(0, np.int64)
        # Of each voxel: the number of points, the sums of red, green and blue, and those of the probabilities.
        self._sums = np.zeros((0, 4 + len(self.class_list)))
        # The corners of the box around its points.
        self._lower, self._upper = np.zeros((0, 3)), np.zeros((0, 3))

    def add(
        self, points: ArrayLike, colors: NDArray[np.uint8] | None = None, label_probs: ArrayLike | None = None
    ) -> None:
        """Take in points (N, 3) in the map frame, metres; points that are not finite are left out.

        `colors` (N, 3) are black by default; `label_probs` (N, K) over `class_list` all zero, which is "unknown". For
        a picture of class numbers, look them up: `np.eye(len(class_list))[numbers]`.
        """
        given = np.asarray(points, np.float64).reshape(-1, 3)
        columns = [np.ones((len(given), 1))]
        for name, values, width in (("colors", colors, 3), ("label_probs", label_probs, len(self.class_list))):
            array = np.zeros((len(given), width)) if values is None else np.asarray(values, np.float64)
            if array.shape != (len(given), width):
                raise BenchbotError(
                    f"The {name} do not belong to the points.",
                    f"They have the shape {array.shape}, for {len(given)} points it must be ({len(given)}, {width}).",
                    "Take them from the pixels of the points: values[cloud.rows, cloud.columns]",
                    failure=FailureClass.AGENT,
                )
            columns.append(array)
        indices = np.floor(given / self.resolution_m)
        with np.errstate(invalid="ignore"):
            usable = (np.abs(indices) < _HALF).all(axis=1)
        if not usable.any():
            return
        i, j, k = (indices[usable].astype(np.int64) + _HALF).T
        keys = np.concatenate([self._keys, i << 2 * _BITS | j << _BITS | k])
        order = np.argsort(keys, kind="stable")
        starts = np.flatnonzero(np.diff(keys[order], prepend=-1))
        self._keys = keys[order][starts]
        sums = np.concatenate([self._sums, np.concatenate(columns, axis=1)[usable]])
        self._sums = np.add.reduceat(sums[order], starts)
        self._lower = np.minimum.reduceat(np.concatenate([self._lower, given[usable]])[order], starts)
        self._upper = np.maximum.reduceat(np.concatenate([self._upper, given[usable]])[order], starts)

    @property
    def voxels(self) -> Voxels:
        """The occupied voxels."""
        indices = np.stack([self._keys >> 2 * _BITS, self._keys >> _BITS & _MASK, self._keys & _MASK], axis=1) - _HALF
        counts, colors, label_probs = np.split(self._sums, [1, 4], axis=1)
        return Voxels(
            ((indices + 0.5) * self.resolution_m).astype(np.float32),
            counts[:, 0].astype(np.int64),
            np.rint(colors / np.maximum(counts, 1)).astype(np.uint8),
            label_probs / np.maximum(counts, 1),
        )

    def objects(self, fewest_points: int = FEWEST_POINTS) -> list[MappedObject]:
        """Return the objects: neighbouring voxels of the same most likely class other than the background.

        Voxels touch at faces, edges or corners. A box just holds the points in its voxels; an object of fewer than
        `fewest_points` points is left out.
        """
        voxels = self.voxels
        found: list[MappedObject] = []
        likely = voxels.label_probs.argmax(axis=1) if self.class_list else np.zeros(0, int)
        known = voxels.label_probs.sum(axis=1) > 0
        for number, name in enumerate(self.class_list):
            if name == BACKGROUND:
                continue
            chosen = np.flatnonzero(known & (likely == number)) if len(likely) else np.zeros(0, int)
            groups = clusters(voxels.centers[chosen], 1.8 * self.resolution_m)
            for group in range(int(groups.max(initial=-1)) + 1):
                members = chosen[groups == group]
                points = int(voxels.counts[members].sum())
                if points >= fewest_points:
                    found.append(self._object(voxels, members, points))
        return found

    def _object(self, voxels: Voxels, members: NDArray[np.int64], points: int) -> MappedObject:
        probabilities = np.average(voxels.label_probs[members], axis=0, weights=voxels.counts[members])
        # Points without a label say nothing about the class.
        probabilities /= probabilities.sum()
        named = dict(zip(self.class_list, probabilities.tolist(), strict=True))
        label_probs = {name: value for name, value in named.items() if value > 0}
        return MappedObject(label_probs, self._lower[members].min(axis=0), self._upper[members].max(axis=0), points)


def clusters(points: Floats, gap_m: float) -> NDArray[np.int64]:
    """Return the number of the cluster of each point (N, 3): from one to the next in it, it is `gap_m` at most.

    Clusters are numbered from 0 in the order of their first points.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    if not len(points):
        return np.zeros(0, np.int64)
    pairs = KDTree(points).query_pairs(gap_m, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    _, groups = connected_components(graph, directed=False)
    _, first, numbers = np.unique(groups, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[numbers], np.int64)
