"""Polygons cut into triangles."""

import mapbox_earcut
import numpy as np
import numpy.typing as npt

Corners = npt.NDArray[np.int64]


def fans(polygons: Corners) -> Corners:
    """(F (N - 2), 3) places in `polygons` (F, N), for polygons that have no dent or at most four corners."""
    count, corners = polygons.shape
    start = np.arange(count)[:, None] * corners
    fan = np.array([[0, i, i + 1] for i in range(1, corners - 1)]).ravel()
    places: Corners = (start + fan).reshape(-1, 3)
    return places


def ears(points: npt.NDArray[np.floating]) -> Corners:
    """(T, 3) corners of one polygon (N, 3), dents allowed; a fan where it has no plane to be cut in."""
    following = np.roll(points, -1, axis=0)
    # Newell's method: the normal of a polygon that need not be quite flat.
    normal = np.cross(points, following).sum(axis=0)
    drop = int(np.abs(normal).argmax())
    kept = np.ascontiguousarray(np.delete(points, drop, axis=1), np.float64)
    cut = mapbox_earcut.triangulate_float64(kept, np.array([len(points)], np.uint32)).astype(np.int64).reshape(-1, 3)
    if len(cut) != len(points) - 2:
        return fans(np.arange(len(points))[None])
    flat = kept[cut]
    (ux, uy), (vx, vy) = (flat[:, 1] - flat[:, 0]).T, (flat[:, 2] - flat[:, 0]).T
    turn = ux * vy - uy * vx
    # Without the y axis, what turned left turns right.
    is_left = (normal[drop] > 0) != (drop == 1)
    return np.where((turn > 0)[:, None] == is_left, cut, cut[:, ::-1])


def triangulate(polygons: Corners, points: npt.NDArray[np.floating]) -> Corners:
    """(T, 3) places in the flattened `polygons` (F, N), whose entries are rows of `points`."""
    if polygons.shape[1] <= 4:
        return fans(polygons)
    pieces = [ears(points[polygon]) + i * polygons.shape[1] for i, polygon in enumerate(polygons)]
    return np.concatenate(pieces)
