"""Pairs of objects that reach into each other: whether their surfaces cross, and by how much."""

from collections.abc import Iterator, Mapping
from functools import cache
from itertools import combinations, product
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.layout import Placement
from benchbot_scenes.placing import place

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.intp]

DEPTH_M = 0.01
_BOXES_AT_ONCE = 200_000
# Of bodies that cross, a few pairs of triangles mostly tell.
_PAIRS_AT_ONCE = 1_000
_DIRECTIONS = np.array(
    sorted((d for d in product((0, 1, -1), repeat=3) if any(d)), key=lambda d: (np.abs(d).sum(), -d[2])), float
)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]


def intersecting(bodies: Mapping[str, Floats], depth_m: float = DEPTH_M) -> list[tuple[str, str]]:
    """Pairs of bodies, each triangles (T, 3, 3), that no shift of `depth_m` brings apart.

    Twenty-six directions are tried. A body that lies wholly within a closed one crosses no surface and is not found.
    """
    return [
        (first, second)
        for first, second in _near(bodies, depth_m)
        if not _come_apart(bodies[first], bodies[second], depth_m)
    ]


def triangles_of(placement: Placement, model: AssetModel) -> Floats:
    """The triangles (T, 3, 3) of a placed model in the map frame; those of its box when its file is not there."""
    matrix = place(placement, model).matrix
    mesh = _mesh(model.file) if model.file.is_file() else _box(model)
    moved: Floats = mesh @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


@cache
def _mesh(file: Path) -> Floats:
    geometry = load_scene(file)
    return geometry.vertices[geometry.triangles].astype(np.float64)


def _box(model: AssetModel) -> Floats:
    """The box of a model as its file would have it."""
    size_m = np.array(model.size_m) / np.array(model.scale)
    corners: Floats = np.array(list(product((-0.5, 0.5), (-0.5, 0.5), (0.0, 1.0)))) * size_m
    sides = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return corners[[half for a, b, c, d in sides for half in ((a, b, c), (a, c, d))]]


def _near(bodies: Mapping[str, Floats], depth_m: float) -> Iterator[tuple[str, str]]:
    """Pairs whose boxes overlap by more than `depth_m` along every axis."""
    names = [name for name, corners in bodies.items() if len(corners)]
    low = np.array([bodies[name].min(axis=(0, 1)) for name in names]).reshape(-1, 3)
    high = np.array([bodies[name].max(axis=(0, 1)) for name in names]).reshape(-1, 3)
    for i, j in combinations(range(len(names)), 2):
        if (np.minimum(high[i], high[j]) - np.maximum(low[i], low[j]) > depth_m).all():
            yield names[i], names[j]


def _come_apart(first: Floats, second: Floats, depth_m: float) -> bool:
    first, second = _within(first, second, depth_m), _within(second, first, depth_m)
    (low, high), (other_low, other_high) = _ends(first), _ends(second)
    # No shift brings other triangles near each other than these.
    i, j = _touching(low - depth_m, high + depth_m, other_low, other_high)
    low, high, other_low, other_high = low[i], high[i], other_low[j], other_high[j]
    for shift in (np.zeros(3), *(depth_m * _DIRECTIONS)):
        x, y, z = ((high + shift >= other_low) & (low + shift <= other_high)).T
        near = np.flatnonzero(x & y & z)
        if not _cross(first, i[near], shift, second, j[near]):
            return True
    return False


def _within(corners: Floats, other: Floats, margin_m: float) -> Floats:
    """The triangles that come as near as `margin_m` to the other body's box."""
    low, high = other.min(axis=(0, 1)) - margin_m, other.max(axis=(0, 1)) + margin_m
    lowest, highest = _ends(corners)
    x, y, z = ((highest >= low) & (lowest <= high)).T
    near: Floats = corners[x & y & z]
    return near


def _ends(corners: Floats) -> tuple[Floats, Floats]:
    """The lowest and the highest coordinates (T, 3) of triangles; `min` along so short an axis takes far longer."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _touching(low: Floats, high: Floats, other_low: Floats, other_high: Floats) -> tuple[Integers, Integers]:
    """Number the pairs of boxes (N, 3) and (M, 3) that touch or overlap."""
    step = max(1, _BOXES_AT_ONCE // max(1, len(other_low)))
    parts = [(np.zeros(0, np.intp), np.zeros(0, np.intp))]
    for start in range(0, len(low), step):
        near = np.ones((len(low[start : start + step]), len(other_low)), bool)
        for axis in range(3):
            near &= high[start : start + step, None, axis] >= other_low[None, :, axis]
            near &= low[start : start + step, None, axis] <= other_high[None, :, axis]
        i, j = np.nonzero(near)
        parts.append((i + start, j))
    return np.concatenate([i for i, _ in parts]), np.concatenate([j for _, j in parts])


def _cross(first: Floats, i: Integers, shift: Floats, second: Floats, j: Integers) -> bool:
    """Return whether an edge of either triangle of a pair passes through the other, the first ones being shifted."""
    for start in range(0, len(i), _PAIRS_AT_ONCE):
        one, other = first[i[start : start + _PAIRS_AT_ONCE]] + shift, second[j[start : start + _PAIRS_AT_ONCE]]
        if _edges_pass(one, other) or _edges_pass(other, one):
            return True
    return False


def _edges_pass(edges_of: Floats, triangles: Floats) -> bool:
    """Return whether an edge of a triangle passes through the one at the same place; both (N, 3, 3).

    The method of Möller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997.
    """
    corner, side, other = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    for number in range(3):
        start = edges_of[:, number]
        along = edges_of[:, (number + 1) % 3] - start
        across = _crossed(along, other)
        determinant = (side * across).sum(axis=1)
        # What is parallel passes through nothing, and NaN is not at least 0.
        determinant[np.abs(determinant) < 1e-14] = np.nan
        offset = start - corner
        normal = _crossed(offset, side)
        u = (offset * across).sum(axis=1) / determinant
        v = (along * normal).sum(axis=1) / determinant
        t = (other * normal).sum(axis=1) / determinant
        if ((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)).any():
            return True
    return False


def _crossed(first: Floats, second: Floats) -> Floats:
    """The cross products of vectors (N, 3); for so few of them most of `np.cross` is looking at its arguments."""
    (x, y, z), (u, v, w) = first.T, second.T
    return np.column_stack([y * w - z * v, z * u - x * w, x * v - y * u])
