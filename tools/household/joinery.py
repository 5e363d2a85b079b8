"""Parts that several pieces of furniture share: boards, turned legs, knobs and handles."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tools.household.model import Mesh, merge, moved, rotated
from tools.household.shapes import bevelled_box, lathe, tube

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tools.household.model import Floats


def board(low: Sequence[float], high: Sequence[float], bevel: float = 0.003, grain: str = "") -> Mesh:
    """A bevelled box between two corners, with the grain along its longest side unless told otherwise."""
    first, last = np.asarray(low, float), np.asarray(high, float)
    size = last - first
    return bevelled_box(size, (first + last) / 2, bevel, grain=grain or "xyz"[int(np.argmax(size))])


def leg(
    foot: Sequence[float] | Floats,
    top: Sequence[float] | Floats,
    foot_radius: float,
    top_radius: float,
    sides: int = 14,
) -> Mesh:
    """A tapered round leg between two points, with a softened foot."""
    first, last = np.asarray(foot, float), np.asarray(top, float)
    share = np.array([0.0, 0.012, 0.5, 1.0])[:, None]
    radii = np.array([foot_radius * 0.8, foot_radius, (foot_radius + top_radius) / 2, top_radius])
    return tube(first + (last - first) * share, radii, sides)


def turned_leg(
    foot: Sequence[float] | Floats,
    top: Sequence[float] | Floats,
    profile: Sequence[tuple[float, float]],
    sides: int = 14,
) -> Mesh:
    """A turned leg between two points; the profile lists (share of the length, radius in metres)."""
    first, last = np.asarray(foot, float), np.asarray(top, float)
    share = np.array([point[0] for point in profile])[:, None]
    return tube(first + (last - first) * share, np.array([point[1] for point in profile]), sides)


def grain_upright(mesh: Mesh) -> Mesh:
    """A turned part whose wood grain runs along its axis instead of around it."""
    return replace(mesh, uvs=mesh.uvs[:, ::-1].copy())


def knob(position: Sequence[float], radius: float = 0.014, depth: float = 0.024) -> Mesh:
    """A turned knob on a front that faces +x, its root at `position`."""
    profile = [
        (0.0, 0.0),
        (radius * 0.55, 0.0),
        (radius * 0.42, depth * 0.45),
        (radius, depth * 0.7),
        (radius * 0.96, depth * 0.9),
        (radius * 0.6, depth),
        (0.0, depth),
    ]
    return moved(rotated(lathe(profile, 16), "y", 90.0), *position)


def bar_handle(position: Sequence[float], length: float, axis: str = "y", reach: float = 0.028) -> Mesh:
    """A bow handle on a front that faces +x, along `axis` ("y" or "z"), its middle at `position`."""
    middle = np.asarray(position, float)
    along = np.array([0.0, 1.0, 0.0]) if axis == "y" else np.array([0.0, 0.0, 1.0])
    out = np.array([1.0, 0.0, 0.0])
    bar = tube([middle - along * length / 2 + out * reach, middle + along * length / 2 + out * reach], 0.005, 10)
    posts = [
        tube([middle + along * side * length * 0.4, middle + along * side * length * 0.4 + out * reach], 0.004, 8)
        for side in (-1, 1)
    ]
    return merge([bar, *posts])
