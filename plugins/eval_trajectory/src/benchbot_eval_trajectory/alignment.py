"""Alignment: the motion that brings an estimate closest to the truth.

S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE TPAMI 13(4), 1991.
Which one to use: Z. Zhang and D. Scaramuzza, "A Tutorial on Quantitative Trajectory Evaluation for Visual(-Inertial)
Odometry", IROS 2018. A camera alone knows no scale and needs Sim(3).
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from benchbot_eval_trajectory.trajectory import Floats, Trajectory


class Align(StrEnum):
    """The transforms that may be applied to an estimate: none, rigid ones, or rigid ones with a scale."""

    NONE = "none"
    SE3 = "se3"
    SIM3 = "sim3"


@dataclass(frozen=True)
class Similarity:
    """The map x → scale · rotation · x + translation_m, with rotation (3, 3) and translation (3,)."""

    rotation: Floats
    translation_m: Floats
    scale: float = 1.0

    def of(self, trajectory: Trajectory) -> Trajectory:
        """Return the trajectory, moved."""
        return Trajectory(
            self.scale * trajectory.positions_m @ self.rotation.T + self.translation_m,
            self.rotation @ trajectory.rotations,
            trajectory.times_s,
        )


def alignment(estimate: Trajectory, truth: Trajectory, align: Align) -> Similarity:
    """Return the motion of the estimate that leaves the least squared distances to the truth, pose by pose."""
    if align is Align.NONE:
        return Similarity(np.eye(3), np.zeros(3))
    return umeyama(estimate.positions_m, truth.positions_m, with_scale=align is Align.SIM3)


def umeyama(points: Floats, targets: Floats, *, with_scale: bool) -> Similarity:
    """Return the similarity, or rigid motion, that takes points (N, 3) closest to targets (N, 3); N is at least 1.

    Where several do it equally well, as for points in a line, it is one of these; the scale of points that are all the
    same is 1.
    """
    centre, target_centre = points.mean(axis=0), targets.mean(axis=0)
    centred = points - centre
    covariance = (targets - target_centre).T @ centred / len(points)
    left, singular, right = np.linalg.svd(covariance)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left) * np.linalg.det(right))])
    rotation = left * signs @ right
    variance = float((centred**2).sum()) / len(points)
    scale = float(singular @ signs) / variance if with_scale and variance > 0 else 1.0
    return Similarity(rotation, target_centre - scale * rotation @ centre, scale)
