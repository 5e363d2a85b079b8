"""Soft bodies from signed distances, turned into triangles.

A field maps points (N, 3) to signed distances (N,), negative inside. `smooth_union` blends bodies as flesh and cloth
do. Formulas of primitives and blends: I. Quilez, "Distance functions" and "Smooth minimum"; the surface: S. F. Gibson,
"Constrained elastic surface nets", MICCAI 1998.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from tools.household.meshing import build
from tools.household.model import Floats, Mesh
from tools.household.simplify import simplified

Field: TypeAlias = Callable[[Floats], Floats]


def ball(
    center: Sequence[float] | Floats, radii: Sequence[float] | Floats | float, frame: Floats | None = None
) -> Field:
    """An ellipsoid (approximate distance); `frame`'s rows are its axes."""
    middle, radius = np.asarray(center, float), np.broadcast_to(np.asarray(radii, float), (3,))

    def field(points: Floats) -> Floats:
        local = points - middle if frame is None else (points - middle) @ frame.T
        inner = np.linalg.norm(local / radius, axis=1)
        outer = np.linalg.norm(local / radius**2, axis=1)
        return np.asarray(inner * (inner - 1.0) / np.maximum(outer, 1e-9))

    return field


def limb(
    first: Sequence[float] | Floats, last: Sequence[float] | Floats, start: float, end: float, flat: float = 1.0
) -> Field:
    """A rod with round ends whose radius goes from `start` to `end`; `flat` widens it along y."""
    a, b = np.asarray(first, float), np.asarray(last, float)
    squeeze = np.array([1.0, 1.0 / flat, 1.0])
    a, b = a * squeeze, b * squeeze
    along = b - a

    def field(points: Floats) -> Floats:
        local = points * squeeze - a
        share = np.clip(local @ along / (along @ along), 0.0, 1.0)
        return np.asarray(np.linalg.norm(local - share[:, None] * along, axis=1) - (start + share * (end - start)))

    return field


def smooth_union(fields: Sequence[Field], blend_m: float) -> Field:
    """All bodies together, their joints filled within about `blend_m`."""

    def field(points: Floats) -> Floats:
        total = fields[0](points)
        for other in fields[1:]:
            value = other(points)
            share = np.clip(0.5 + 0.5 * (value - total) / blend_m, 0.0, 1.0)
            total = value + (total - value) * share - blend_m * share * (1.0 - share)
        return total

    return field


def cut(field: Field, *others: Callable[[Floats], Floats]) -> Field:
    """Only what lies where all other fields are negative too."""

    def both(points: Floats) -> Floats:
        return np.asarray(np.max([field(points), *(other(points) for other in others)], axis=0))

    return both


def without(field: Field, other: Field, blend_m: float) -> Field:
    """The first body with the other pressed out of it."""

    def carved(points: Floats) -> Floats:
        value, hole = field(points), -other(points)
        share = np.clip(0.5 + 0.5 * (value - hole) / blend_m, 0.0, 1.0)
        return np.asarray(hole + (value - hole) * share + blend_m * share * (1.0 - share))

    return carved


def surface(field: Field, low: Sequence[float], high: Sequence[float], cell_m: float, most: int | None = None) -> Mesh:
    """The zero surface within a box, with triangles of about `cell_m`, and at most so many where `most` says."""
    axes = [np.arange(first - cell_m, last + 2 * cell_m, cell_m) for first, last in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = field(grid.reshape(-1, 3)).reshape(grid.shape[:3])
    inside = values < 0
    number, vertices = _cell_points(grid, values, inside, cell_m)
    triangles = np.concatenate([_faces(inside, number, axis) for axis in range(3)])
    for _ in range(3):
        vertices = vertices - field(vertices)[:, None] * _gradient(field, vertices, cell_m * 0.1)
    if most is not None:
        vertices, triangles = simplified(vertices, triangles, most)
    return build(vertices, triangles.astype(np.int32), crease_deg=75.0, grain="z")


def _cell_points(grid: Floats, values: Floats, inside: np.ndarray, cell_m: float) -> tuple[np.ndarray, Floats]:
    """Each mixed cell's number (-1 for others) and its point: the mean of where its edges cross the surface."""
    shape = tuple(size - 1 for size in values.shape)
    total, count = np.zeros((*shape, 3)), np.zeros(shape)
    offsets = [np.array(corner) for corner in np.ndindex(2, 2, 2)]
    for start in offsets:
        for axis in range(3):
            if start[axis]:
                continue
            end = start + np.eye(3, dtype=int)[axis]
            first, last = (
                tuple(slice(o, o + n) for o, n in zip(corner, shape, strict=True)) for corner in (start, end)
            )
            crosses = inside[first] != inside[last]
            share = values[first] / np.where(crosses, values[first] - values[last], 1.0)
            point = grid[first] + share[..., None] * np.eye(3)[axis] * cell_m
            total += np.where(crosses[..., None], point, 0.0)
            count += crosses
    mixed = count > 0
    number = np.full(shape, -1)
    number[mixed] = np.arange(int(mixed.sum()))
    return number, total[mixed] / count[mixed][:, None]


def _faces(inside: np.ndarray, number: np.ndarray, axis: int) -> np.ndarray:
    """Two triangles for every grid edge along `axis` that crosses the surface."""
    second, third = (axis + 1) % 3, (axis + 2) % 3
    lower = [slice(None)] * 3
    lower[axis] = slice(0, -1)
    upper = [slice(None)] * 3
    upper[axis] = slice(1, None)
    changes = inside[tuple(lower)].astype(int) - inside[tuple(upper)].astype(int)
    where = np.argwhere(changes != 0)
    where = where[(where[:, second] > 0) & (where[:, third] > 0)]
    sign = changes[tuple(where.T)]
    around = []
    for step_second, step_third in ((1, 1), (0, 1), (0, 0), (1, 0)):
        cell = where.copy()
        cell[:, second] -= step_second
        cell[:, third] -= step_third
        around.append(number[tuple(cell.T)])
    quads = np.stack(around, axis=1)
    quads = np.where(sign[:, None] > 0, quads, quads[:, ::-1])
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _gradient(field: Field, points: Floats, step: float) -> Floats:
    slopes = [(field(points + step * unit) - field(points - step * unit)) / (2 * step) for unit in np.eye(3)]
    slope = np.stack(slopes, axis=1)
    return np.asarray(slope / np.maximum((slope**2).sum(axis=1, keepdims=True), 0.25))
