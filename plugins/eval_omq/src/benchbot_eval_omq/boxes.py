"""Axis-aligned boxes in three dimensions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Boxes:
    """N boxes by their lower and upper corners, (N, 3) each, metres."""

    lower: Array
    upper: Array

    @classmethod
    def of(cls, objects: Sequence[Mapping[str, Any]]) -> "Boxes":
        """Return the boxes of objects with a `centroid` and a full `extent`."""
        centroids = np.array([item["centroid"] for item in objects], float).reshape(-1, 3)
        extents = np.array([item["extent"] for item in objects], float).reshape(-1, 3)
        return cls(centroids - extents / 2, centroids + extents / 2)

    @property
    def volumes(self) -> Array:
        """Volumes in cubic metres, (N,)."""
        # From the corners, as the intersections are, so that equal boxes overlap by exactly their volume.
        return np.asarray((self.upper - self.lower).prod(axis=1))

    def intersections(self, other: "Boxes") -> Array:
        """Return the volumes that each pair of boxes shares, (N, M)."""
        shared = np.ones((len(self.lower), len(other.lower)))
        for axis in range(3):
            upper = np.minimum.outer(self.upper[:, axis], other.upper[:, axis])
            lower = np.maximum.outer(self.lower[:, axis], other.lower[:, axis])
            shared *= np.maximum(upper - lower, 0.0)
        return shared


def intersections_over_unions(intersections: Array, volumes: Array, other_volumes: Array) -> Array:
    """Return the IoU of each pair of boxes, (N, M), 0 where both have no volume."""
    unions = np.add.outer(volumes, other_volumes) - intersections
    return np.divide(intersections, unions, out=np.zeros_like(unions), where=unions > 0)
