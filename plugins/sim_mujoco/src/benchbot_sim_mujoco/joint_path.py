"""Paths of joints, and when they are where: as fast as limits of speed and acceleration permit, at rest at the ends."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

CURVED_SHARE = 0.5
"""Of the acceleration on a path that bends in joint space: the share for following it, the rest is for speeding up."""


@dataclass(frozen=True)
class Limits:
    """The limits of joints (N,): speeds and accelerations, in radians or metres."""

    speeds: Floats
    accelerations: Floats


@dataclass(frozen=True)
class Timed:
    """Positions (T, N) of joints, and their velocities (T, N), after each step of a motion."""

    positions: Floats
    velocities: Floats


def timed(path: Floats, limits: Limits, step_s: float) -> Timed:
    """Return when joints are where on a path (K, N), K of 2 or more, whose ends are its first and its last row.

    The rows are taken as evenly spaced. A speed along the path is chosen at which no joint exceeds its limits anywhere,
    and it rises and falls evenly (a trapezium).
    """
    rows = len(path) - 1
    slopes = np.abs(np.diff(path, axis=0)).max(0) * rows
    bends = np.abs(np.diff(path, 2, axis=0)).max(0) * rows**2 if rows > 1 else np.zeros_like(slopes)
    is_bent = bool((bends > 1e-6 * np.maximum(slopes, 1e-9)).any())
    share = CURVED_SHARE if is_bent else 1.0
    tiny = 1e-12
    speed = float((limits.speeds / np.maximum(slopes, tiny)).min())
    if is_bent:
        speed = min(speed, float(np.sqrt((1 - share) * limits.accelerations / np.maximum(bends, tiny)).min()))
    acceleration = float((share * limits.accelerations / np.maximum(slopes, tiny)).min())
    if not slopes.max() > tiny:
        return Timed(path[-1:], np.zeros_like(path[-1:]))
    speed = min(speed, math.sqrt(acceleration))
    ramp_s = speed / acceleration
    whole_s = 1.0 / speed + ramp_s
    steps = math.ceil(whole_s / step_s)
    # Stretched a little, so that it ends at the end of a step.
    stretch = whole_s / (steps * step_s)
    moments = np.arange(1, steps + 1) * step_s * stretch
    rising, falling = np.minimum(moments, ramp_s), np.maximum(moments - (whole_s - ramp_s), 0.0)
    places = np.clip(
        acceleration * rising**2 / 2 + speed * np.maximum(moments - ramp_s, 0.0) - acceleration * falling**2 / 2,
        0.0,
        1.0,
    )
    speeds = np.clip(acceleration * rising - acceleration * falling, 0.0, speed) * stretch
    places[-1], speeds[-1] = 1.0, 0.0
    first = np.minimum((places * rows).astype(int), rows - 1)
    along = (places * rows - first)[:, None]
    positions = path[first] + along * (path[first + 1] - path[first])
    return Timed(positions, (path[first + 1] - path[first]) * rows * speeds[:, None])
