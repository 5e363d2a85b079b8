"""Trajectory errors: absolute (ATE) and relative (RPE).

J. Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchbot_eval_trajectory.trajectory import Floats, Trajectory

Pairs = NDArray[np.intp]


@dataclass(frozen=True)
class Summary:
    """Statistics of a set of errors: root mean square, mean, median, maximum and count."""

    rmse: float
    mean: float
    median: float
    max: float
    count: int


def summary(errors: Floats) -> Summary | None:
    """Return the summary of errors (N,), None of none."""
    if not len(errors):
        return None
    return Summary(
        float(np.sqrt(np.mean(errors**2))),
        float(errors.mean()),
        float(np.median(errors)),
        float(errors.max()),
        len(errors),
    )


def absolute_m(estimate: Trajectory, truth: Trajectory) -> Floats:
    """Return how far each position of the (aligned) estimate is from the true one (N,), metres: ATE."""
    distances: Floats = np.linalg.norm(estimate.positions_m - truth.positions_m, axis=1)
    return distances


def relative(estimate: Trajectory, truth: Trajectory, pairs: Pairs) -> tuple[Floats, Floats]:
    """Return how far the motion within each pair of poses (M, 2) is off: metres (M,) and degrees (M,), RPE.

    The error of a pair (i, j) is (Qᵢ⁻¹ Qⱼ)⁻¹ (Pᵢ⁻¹ Pⱼ) with true poses Q and estimated ones P: the length of its
    translation, the angle of its rotation. No rigid motion of either trajectory changes it.
    """
    if not len(pairs):
        return np.zeros(0), np.zeros(0)
    true_turns, true_ways = _motions(truth, pairs)
    turns, ways = _motions(estimate, pairs)
    back = np.swapaxes(true_turns, 1, 2)
    errors_m: Floats = np.linalg.norm(np.einsum("nij,nj->ni", back, ways - true_ways), axis=1)
    errors_deg: Floats = np.degrees(Rotation.from_matrix(back @ turns).magnitude())
    return errors_m, errors_deg


def neighbours(count: int) -> Pairs:
    """Return each pose and the next one (count - 1, 2): errors per frame."""
    numbers = np.arange(max(count, 1), dtype=np.intp)
    return np.stack([numbers[:-1], numbers[1:]], axis=1)


def pairs_by_path(positions_m: Floats, length_m: float) -> Pairs:
    """Return pairs of poses (M, 2), one after the other, each the first so far along the way: errors per `length_m`."""
    ends, driven_m = [0], 0.0
    for number, step_m in enumerate(np.linalg.norm(np.diff(positions_m, axis=0), axis=1), 1):
        driven_m += step_m
        if driven_m >= length_m:
            ends.append(number)
            driven_m = 0.0
    return np.stack([ends[:-1], ends[1:]], axis=1).astype(np.intp)


def _motions(trajectory: Trajectory, pairs: Pairs) -> tuple[Floats, Floats]:
    """Return the rotations (M, 3, 3) and translations (M, 3) from the first to the second pose, seen from the first."""
    first, second = pairs.T
    back = np.swapaxes(trajectory.rotations[first], 1, 2)
    steps_m = trajectory.positions_m[second] - trajectory.positions_m[first]
    return back @ trajectory.rotations[second], np.einsum("nij,nj->ni", back, steps_m)
