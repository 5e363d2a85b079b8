"""Checks of a finished scene: does everything stand on something, and nothing in a wall?"""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import shapely

from benchbot_scenes.floor_plan import floor_plan
from benchbot_scenes.layout import Building
from benchbot_scenes.scene import FloatArray, SceneGeometry

Floats = npt.NDArray[np.float64]

_CONTACT_M = 0.01
_SUNK_M = 0.05
_MOST_POINTS = 200
_AROUND_M = 100.0


def floating(geometry: SceneGeometry, names: Iterable[str] | None = None, gap_m: float = 0.02) -> list[str]:
    """Objects with nothing within `gap_m` below any of their lowest points; by default of those that have a class.

    What sinks into its support by up to 5 cm, as into a cushion, stands. Name only what is to stand: what hangs floats.
    """
    corners = geometry.vertices[geometry.triangles]
    # By axis, each in one piece: there are many objects, and all triangles are looked at for each.
    low = [np.minimum.reduce([corners[:, corner, axis] for corner in range(3)]) for axis in range(3)]
    high = [np.maximum.reduce([corners[:, corner, axis] for corner in range(3)]) for axis in range(3)]
    found = []
    for name in _classed(geometry) if names is None else dict.fromkeys(names):
        own = _triangles_of(geometry, name)
        points = _lowest_points(corners[own])
        if not len(points):
            continue
        bottom = float(points[:, 2].min())
        near = np.flatnonzero((high[2] >= bottom - gap_m) & (low[2] <= bottom + _SUNK_M))
        for axis in range(2):
            within = (high[axis][near] >= points[:, axis].min()) & (low[axis][near] <= points[:, axis].max())
            near = near[within]
        if not _is_over(points, corners[near[~own[near]]], gap_m):
            found.append(name)
    return found


def in_walls(
    geometry: SceneGeometry, building: Building, names: Iterable[str] | None = None, depth_m: float = 0.02
) -> list[str]:
    """Objects that reach more than `depth_m` into or through a wall of the building; by default those with a class."""
    plan = floor_plan(building)
    holes = shapely.union_all([passage.rectangle(0.0, 0.1) for passage in plan.passages])
    free = shapely.union_all([*plan.rooms, holes]).buffer(depth_m, join_style="mitre")
    taken = free.envelope.buffer(_AROUND_M).difference(free)
    shapely.prepare(taken)
    found = []
    for name in _classed(geometry) if names is None else dict.fromkeys(names):
        corners = geometry.vertices[geometry.triangles[_triangles_of(geometry, name)]][:, :, :2].astype(float)
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        if taken.intersects(shapely.box(*low, *high)):
            sides = shapely.linestrings(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2, 2))
            if shapely.intersects(taken, sides).any():
                found.append(name)
    return found


def _classed(geometry: SceneGeometry) -> list[str]:
    return list(dict.fromkeys(instance.name for instance in geometry.instances if instance.class_name is not None))


def _triangles_of(geometry: SceneGeometry, name: str) -> npt.NDArray[np.bool_]:
    own = np.zeros(len(geometry.triangle_instance), bool)
    for instance in geometry.instances:
        if instance.name == name:
            own |= geometry.triangle_instance == instance.index
    return own


def _lowest_points(corners: FloatArray) -> Floats:
    """Points of an object within a centimetre of its lowest: corners and middles of triangles, some hundred of them."""
    points = np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)]).astype(float)
    if not len(points):
        return points
    points = np.unique(points[points[:, 2] <= points[:, 2].min() + _CONTACT_M].round(4), axis=0)
    return points[:: -(-len(points) // _MOST_POINTS)]


def _is_over(points: Floats, corners: FloatArray, gap_m: float) -> bool:
    """Return whether a triangle lies at most `gap_m` below any of the points, or above it by at most `_SUNK_M`."""
    a, b, c = (corners[:, corner].astype(float) for corner in range(3))
    area = _cross(b - a, c - a)
    flat = np.abs(area) > 1e-9
    a, b, c, area = a[flat], b[flat], c[flat], area[flat]
    for point in points:
        # Barycentric coordinates in the plane seen from above.
        over_b, over_c = _cross(point - a, c - a) / area, _cross(b - a, point - a) / area
        inside = (over_b >= -1e-6) & (over_c >= -1e-6) & (over_b + over_c <= 1 + 1e-6)
        height = a[:, 2] + over_b * (b - a)[:, 2] + over_c * (c - a)[:, 2]
        if (inside & (height >= point[2] - gap_m) & (height <= point[2] + _SUNK_M)).any():
            return True
    return False


def _cross(first: Floats, second: Floats) -> Floats:
    product: Floats = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return product
