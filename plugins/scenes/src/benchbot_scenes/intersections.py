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

DEPTH_M = 0.01
_PAIRS_AT_ONCE = 200_000
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
    mesh = _mesh(model.file) if model.file.is_file() else _box(model.size_m)
    moved: Floats = mesh @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


@cache
def _mesh(file: Path) -> Floats:
    geometry = load_scene(file)
    return geometry.vertices[geometry.triangles].astype(np.float64)


def _box(size_m: tuple[float, float, float]) -> Floats:
    corners = np.array(list(product((-0.5, 0.5), (-0.5, 0.5), (0.0, 1.0)))) * size_m
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
    if not _cross(first, second):
        return True
    return any(not _cross(first + depth_m * direction, second) for direction in _DIRECTIONS)


def _within(corners: Floats, other: Floats, margin_m: float) -> Floats:
    """The triangles that come as near as `margin_m` to the other body's box."""
    low, high = other.min(axis=(0, 1)) - margin_m, other.max(axis=(0, 1)) + margin_m
    near: Floats = corners[((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)]
    return near


def _cross(first: Floats, second: Floats) -> bool:
    """Return whether an edge of either passes through a triangle of the other."""
    if not len(first) or not len(second):
        return False
    low, high = second.min(axis=1), second.max(axis=1)
    step = max(1, _PAIRS_AT_ONCE // len(second))
    for start in range(0, len(first), step):
        part = first[start : start + step]
        near = np.ones((len(part), len(second)), bool)
        for axis in range(3):
            near &= part[:, :, axis].max(axis=1)[:, None] >= low[None, :, axis]
            near &= part[:, :, axis].min(axis=1)[:, None] <= high[None, :, axis]
        i, j = np.nonzero(near)
        if len(i) and (_edges_pass(part[i], second[j]) or _edges_pass(second[j], part[i])):
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
        across = np.cross(along, other)
        determinant = (side * across).sum(axis=1)
        # What is parallel passes through nothing, and NaN is not at least 0.
        determinant[np.abs(determinant) < 1e-14] = np.nan
        offset = start - corner
        normal = np.cross(offset, side)
        u = (offset * across).sum(axis=1) / determinant
        v = (along * normal).sum(axis=1) / determinant
        t = (other * normal).sum(axis=1) / determinant
        if ((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)).any():
            return True
    return False
