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
    low, high, other_low, other_high = first.min(axis=1), first.max(axis=1), second.min(axis=1), second.max(axis=1)
    # No shift brings other triangles near each other than these.
    i, j = _touching(low - depth_m, high + depth_m, other_low, other_high)
    low, high, other_low, other_high = (each.T.copy() for each in (low[i], high[i], other_low[j], other_high[j]))
    # Coordinates in rows: most triangles are asked for more than once.
    first, second = (np.ascontiguousarray(corners.transpose(1, 2, 0)) for corners in (first, second))
    crossing = np.zeros(0, np.intp)
    for shift in (np.zeros(3), *(depth_m * _DIRECTIONS)):
        along = shift[:, None]
        is_near = ((high + along >= other_low) & (low + along <= other_high)).all(axis=0)
        # Pairs that crossed before the shift mostly do so after it.
        for pairs in (crossing[is_near[crossing]], np.flatnonzero(is_near)):
            crossing = _crossing(first, i[pairs], along, second, j[pairs])
            if len(crossing):
                crossing = pairs[crossing]
                break
        else:
            return True
    return False


def _within(corners: Floats, other: Floats, margin_m: float) -> Floats:
    """The triangles that come as near as `margin_m` to the other body's box."""
    low, high = other.min(axis=(0, 1)) - margin_m, other.max(axis=(0, 1)) + margin_m
    near: Floats = corners[((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)]
    return near


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


def _crossing(first: Floats, i: Integers, shift: Floats, second: Floats, j: Integers) -> Integers:
    """Number the first pairs found of which an edge of either triangle passes through the other, if there are any.

    Bodies are (corner, coordinate, T); the first one is shifted.
    """
    for start in range(0, len(i), _PAIRS_AT_ONCE):
        part = slice(start, start + _PAIRS_AT_ONCE)
        one, other = first[:, :, i[part]] + shift, second[:, :, j[part]]
        for edges_of, triangles in ((one, other), (other, one)):
            for number in range(3):
                found = np.flatnonzero(_passes(edges_of[number], edges_of[(number + 1) % 3], triangles))
                if len(found):
                    return found + start
    return np.zeros(0, np.intp)


def _passes(start: Floats, end: Floats, triangles: Floats) -> npt.NDArray[np.bool_]:
    """Say which edges, from `start` to `end` (3, N), pass through the triangle (corner, coordinate, N) of their place.

    The method of Möller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997.
    """
    corner, side, other, along = triangles[0], triangles[1] - triangles[0], triangles[2] - triangles[0], end - start
    across = _crossed(along, other)
    determinant = _dot(side, across)
    # What is parallel passes through nothing, and NaN is not at least 0.
    determinant[np.abs(determinant) < 1e-14] = np.nan
    offset = start - corner
    normal = _crossed(offset, side)
    u, v, t = _dot(offset, across) / determinant, _dot(along, normal) / determinant, _dot(other, normal) / determinant
    passing: npt.NDArray[np.bool_] = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)
    return passing


def _crossed(first: Floats, second: Floats) -> Floats:
    """The cross products of vectors (3, N); for so few of them most of `np.cross` is looking at its arguments."""
    (x, y, z), (u, v, w) = first, second
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u])


def _dot(first: Floats, second: Floats) -> Floats:
    product = first * second
    scalar: Floats = product[0] + product[1] + product[2]
    return scalar
