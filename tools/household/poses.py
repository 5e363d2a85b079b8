"""Poses of people: where their joints are. They face +x, their soles at z = 0.

Proportions of an adult of 1.74 m (DIN 33402-2, medians, rounded).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tools.household.model import Floats


@dataclass(frozen=True)
class Pose:
    """Joints of the left half (y > 0) in metres; the right half mirrors them, but for those that `right` names.

    `spine` is (x, z) of pelvis, waist, chest and neck; `hem` how far below the pelvis a pullover ends; `pitch` says by
    (degrees, 0, 0) how far a heel is off the floor; who `phones` has a telephone in the right hand.
    """

    spine: tuple[tuple[float, float], ...]
    hip: tuple[float, float, float]
    knee: tuple[float, float, float]
    ankle: tuple[float, float, float]
    shoulder: tuple[float, float, float]
    elbow: tuple[float, float, float]
    wrist: tuple[float, float, float]
    fingers: tuple[float, float, float]
    palm: tuple[float, float, float]
    hem: float
    pitch: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phones: bool = False
    right: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)

    def joint(self, name: str, side: float) -> Floats:
        """A joint, or a direction, of the left (1) or right (-1) half."""
        own: tuple[float, float, float] = getattr(self, name)
        return np.array(self.right.get(name, own) if side < 0 else own) * [1.0, side, 1.0]


STANDING = Pose(
    spine=((-0.005, 0.95), (0.005, 1.11), (-0.005, 1.30), (-0.02, 1.47)),
    hip=(0.0, 0.092, 0.92),
    knee=(0.015, 0.105, 0.50),
    ankle=(-0.02, 0.118, 0.085),
    shoulder=(-0.018, 0.168, 1.375),
    elbow=(-0.035, 0.235, 1.12),
    wrist=(0.055, 0.250, 0.885),
    fingers=(0.20, 0.02, -0.98),
    palm=(0.15, -1.0, 0.0),
    hem=0.02,
)
SITTING = Pose(
    spine=((-0.14, 0.535), (-0.155, 0.70), (-0.135, 0.89), (-0.125, 1.06)),
    hip=(-0.11, 0.095, 0.525),
    knee=(0.32, 0.115, 0.515),
    ankle=(0.30, 0.110, 0.085),
    shoulder=(-0.135, 0.168, 0.965),
    elbow=(-0.06, 0.250, 0.725),
    wrist=(0.155, 0.165, 0.640),
    fingers=(0.90, -0.25, -0.12),
    palm=(0.1, 0.0, -1.0),
    hem=-0.055,
)


PHONING = replace(
    STANDING,
    phones=True,
    right={
        "elbow": (0.020, 0.220, 1.120),
        "wrist": (0.205, 0.125, 1.245),
        "fingers": (0.45, -0.25, 0.86),
        "palm": (-0.86, -0.10, 0.42),
        "ankle": (0.035, 0.125, 0.085),
        "knee": (0.045, 0.110, 0.50),
    },
)
ARMS_CROSSED = replace(
    STANDING,
    elbow=(0.050, 0.238, 1.130),
    wrist=(0.190, 0.010, 1.170),
    fingers=(-0.35, -0.90, 0.22),
    palm=(-0.93, 0.35, 0.0),
    right={
        "elbow": (0.065, 0.238, 1.125),
        "wrist": (0.225, 0.025, 1.095),
        "fingers": (-0.42, -0.88, 0.10),
        "palm": (-0.90, 0.42, 0.0),
        "ankle": (0.010, 0.150, 0.085),
        "knee": (0.025, 0.125, 0.50),
    },
)
WALKING = replace(
    STANDING,
    spine=((-0.005, 0.93), (0.010, 1.09), (0.010, 1.28), (0.000, 1.45)),
    hip=(0.0, 0.092, 0.90),
    knee=(0.150, 0.100, 0.505),
    ankle=(0.185, 0.108, 0.085),
    shoulder=(-0.018, 0.168, 1.355),
    elbow=(-0.120, 0.235, 1.118),
    wrist=(-0.045, 0.255, 0.880),
    right={
        "knee": (0.015, 0.100, 0.475),
        "ankle": (-0.255, 0.108, 0.150),
        "pitch": (38.0, 0.0, 0.0),
        "shoulder": (0.022, 0.168, 1.355),
        "elbow": (0.060, 0.240, 1.095),
        "wrist": (0.225, 0.220, 0.905),
        "fingers": (0.55, -0.05, -0.83),
    },
)
SITTING_BACK = replace(
    SITTING,
    spine=((-0.14, 0.535), (-0.175, 0.70), (-0.185, 0.89), (-0.190, 1.06)),
    shoulder=(-0.200, 0.168, 0.965),
    elbow=(-0.110, 0.260, 0.730),
    knee=(0.320, 0.145, 0.515),
    ankle=(0.300, 0.150, 0.085),
    right={"ankle": (0.400, 0.140, 0.085), "wrist": (0.140, 0.190, 0.640), "elbow": (-0.090, 0.270, 0.735)},
)
