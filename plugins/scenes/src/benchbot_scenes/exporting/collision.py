"""Convex pieces that cover a scene's surfaces, for engines that collide convex shapes only."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from benchbot_scenes.scene import SceneGeometry

Floats = npt.NDArray[np.float64]
CELL_M = 0.25
"""Pieces are no larger than this, but for flat ones: a doorway stays open, and the floor below a table free."""
DEPTH_M = 0.005
"""Of a piece behind its surface, so that flat ones have a volume."""
LEAST_AREA_M2 = 1e-8


@dataclass(frozen=True)
class Piece:
    """A convex piece of an instance: the corners (N, 3) of its hull in the map frame."""

    instance: int
    corners: Floats


def pieces(geometry: SceneGeometry) -> Iterator[Piece]:
    """Yield pieces that hold every surface of the scene; whatever is in no surface's cell stays free.

    A triangle with an edge longer than `CELL_M` is a plate of its own, smaller ones are gathered by object and cell.
    """
    corners = geometry.vertices[geometry.triangles].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice_area = np.linalg.norm(across, axis=1)
    is_solid = twice_area > 2 * LEAST_AREA_M2
    corners, across, twice_area = corners[is_solid], across[is_solid], twice_area[is_solid]
    instance = geometry.triangle_instance[is_solid]
    behind = corners - DEPTH_M * (across / twice_area[:, None])[:, None, :]
    plates = np.concatenate([corners, behind], axis=1)
    is_large = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1) > CELL_M
    for index, plate in zip(instance[is_large].tolist(), plates[is_large], strict=True):
        yield Piece(index, plate)
    small, owner = plates[~is_large], instance[~is_large]
    if not len(small):
        return
    cells = np.floor(small.mean(axis=1) / CELL_M).astype(np.int64)
    found, place = np.unique(np.column_stack([owner, cells]), axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(place.ravel()))[:-1]
    for index, members in zip(found[:, 0].tolist(), np.split(order, ends), strict=True):
        points = small[members].reshape(-1, 3)
        yield Piece(index, points[ConvexHull(points, qhull_options="QJ").vertices])
