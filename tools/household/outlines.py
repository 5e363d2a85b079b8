"""Curves: outlines (K, 2), lathe profiles (radius, z) and smooth paths of any dimension, in metres."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import mapbox_earcut
import numpy as np
from scipy.interpolate import PchipInterpolator

from tools.household.model import Floats, Ints, rotation

Points: TypeAlias = Floats | Sequence[Sequence[float]] | Sequence[Floats]


def circle(radius: float, points: int = 12) -> Floats:
    """A counter-clockwise circular outline (points, 2)."""
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def rectangle(width: float, height: float) -> Floats:
    """A counter-clockwise centred rectangle (4, 2)."""
    x, y = width / 2, height / 2
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]])


def rounded_rectangle(width: float, height: float, radius: float, segments: int = 4) -> Floats:
    """A counter-clockwise centred rectangle with rounded corners."""
    angle = np.radians(np.linspace(0, 90, segments + 1))
    arc = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners = []
    for quarter, (x, y) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        turn = rotation("z", 90.0 * quarter)[:2, :2]
        corners.append(arc @ turn.T + np.array([x * (width / 2 - radius), y * (height / 2 - radius)]))
    return np.concatenate(corners)


def catmull_rom(points: Points, samples: int = 32, closed: bool = False) -> Floats:
    """A uniform Catmull-Rom curve through points of any dimension, (samples, D)."""
    given = np.asarray(points, float)
    if closed:
        control = np.concatenate([given[-1:], given, given[:2]])
    else:
        control = np.concatenate([2 * given[:1] - given[1:2], given, 2 * given[-1:] - given[-2:-1]])
    spans = len(control) - 3
    position = np.linspace(0, spans, samples, endpoint=not closed)
    span = np.minimum(position.astype(int), spans - 1)
    t = (position - span)[:, None]
    p0, p1, p2, p3 = (control[span + shift] for shift in range(4))
    curve = 2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2
    return np.asarray(0.5 * (curve + (3 * p1 - 3 * p2 + p3 - p0) * t**3))


def smooth_profile(points: Points, samples: int = 32) -> Floats:
    """A lathe profile (radius, z) through points with strictly rising z, without overshoot."""
    given = np.asarray(points, float)
    z = np.linspace(given[0, 1], given[-1, 1], samples)
    return np.stack([PchipInterpolator(given[:, 1], given[:, 0])(z), z], axis=1)


def inward_directions(outline: Floats) -> Floats:
    """Mitred inward directions (K, 2): moving a point by d along its own insets both edges by d."""
    forward = np.roll(outline, -1, axis=0) - outline
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    normal = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    previous = np.roll(normal, 1, axis=0)
    total = normal + previous
    return np.asarray(2 * total / np.maximum((total**2).sum(axis=1, keepdims=True), 0.5))


def signed_area(outline: Floats) -> float:
    """The area of an outline (K, 2) in m², positive when it is counter-clockwise."""
    following = np.roll(outline, -1, axis=0)
    return float(np.sum(outline[:, 0] * following[:, 1] - following[:, 0] * outline[:, 1]) / 2)


def triangulate(*rings: Floats) -> Ints:
    """Counter-clockwise triangles (M, 3) that fill the first ring without the others."""
    points = np.concatenate(rings)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    triangles = np.asarray(mapbox_earcut.triangulate_float64(points, ends), np.int32).reshape(-1, 3)
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    flip = turn < 0
    triangles[flip] = triangles[flip][:, ::-1]
    return triangles
