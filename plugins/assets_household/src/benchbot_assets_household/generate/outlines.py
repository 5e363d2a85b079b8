"""Curves: outlines (K, 2), lathe profiles (radius, z) and smooth paths of any dimension, in metres."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from scipy.interpolate import PchipInterpolator

from benchbot_assets_household.generate.model import Floats, rotation

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
