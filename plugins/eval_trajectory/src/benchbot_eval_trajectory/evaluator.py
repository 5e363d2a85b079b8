"""The method `trajectory`: how far a solution's estimate of the robot's poses is from where the robot really went.

Absolute (ATE) and relative (RPE) errors after Sturm et al. (2012); which alignment answers which question: Zhang and
Scaramuzza (2018).
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchbot.plugin import BenchbotError, GroundTruth, Pose, Result
from benchbot_eval_trajectory import metrics
from benchbot_eval_trajectory.alignment import Align, alignment
from benchbot_eval_trajectory.trajectory import Floats, Trajectory

Scores = dict[str, float]

HEADLINE = "ATE_RMSE_m"
COMPLETENESS = "completeness"
NAMES = (
    HEADLINE,
    "ATE_mean_m",
    "ATE_median_m",
    "ATE_max_m",
    "ATE_sim3_RMSE_m",
    "ATE_map_RMSE_m",
    "RPE_1m_m",
    "RPE_1m_deg",
    "RPE_frame_m",
    "RPE_frame_deg",
    "path_length_m",
    COMPLETENESS,
)
LEAST_PATH_M = 1.0
"""On a shorter way an estimate can hardly go wrong."""
LEAST_COMPLETENESS = 0.9
"""With fewer of its observations, a solution could choose where it is judged; one may always be missing."""
RPE_LENGTH_M = 1.0
DRIFT_LENGTHS_M = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
MOST_ALONG = 200


def evaluate(result: Result, ground_truths: Sequence[GroundTruth] = ()) -> Scores:
    """Return the errors of one result against its own track, which the back end has written.

    ATE is that after SE(3) alignment, except where its name says Sim(3) or map (no alignment). RPE over a metre is left
    out where no two observations are so far apart. Raises BenchbotError for a result without a track, of several
    scenes, of less than 1 m, with poses of observations that there were not, and with too few poses.
    """
    track = _track(result)
    estimate, truth, completeness = matched(result)
    ate_m = metrics.absolute_m(alignment(estimate, truth, Align.SE3).of(estimate), truth)
    scaled_m = metrics.absolute_m(alignment(estimate, truth, Align.SIM3).of(estimate), truth)
    in_map_m = metrics.absolute_m(estimate, truth)
    metre = metrics.relative(estimate, truth, metrics.pairs_by_path(truth.positions_m, RPE_LENGTH_M))
    frame = metrics.relative(estimate, truth, metrics.neighbours(len(truth)))
    values = (
        _rmse(ate_m),
        float(ate_m.mean()),
        float(np.median(ate_m)),
        float(ate_m.max()),
        _rmse(scaled_m),
        _rmse(in_map_m),
        *(_rmse(errors) for errors in (*metre, *frame)),
        float(track["path_length_m"]),
        completeness,
    )
    return {name: value for name, value in zip(NAMES, values, strict=True) if value is not None}


def explain(result: Result, ground_truths: Sequence[GroundTruth] = ()) -> dict[str, Any]:
    """Return the `diagnosis` of one result (schema `explanation`): `drift` over stretches, the error `along` the way.

    Errors as for `evaluate`. Along the way the estimate is laid onto the truth where it begins, not fitted as a whole.
    """
    estimate, truth, _ = matched(result)
    drift = []
    for length_m in DRIFT_LENGTHS_M:
        pairs = metrics.pairs_by_path(truth.positions_m, length_m)
        if len(pairs):
            errors_m, errors_deg = metrics.relative(estimate, truth, pairs)
            row = {"length_m": length_m, "stretches": len(pairs)}
            drift.append({**row, "error_m": _rmse(errors_m), "error_deg": _rmse(errors_deg)})
    driven_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(truth.positions_m, axis=0), axis=1)))
    turn = truth.rotations[0] @ estimate.rotations[0].T
    laid_m = (estimate.positions_m - estimate.positions_m[0]) @ turn.T + truth.positions_m[0]
    errors_m = np.linalg.norm(laid_m - truth.positions_m, axis=1)
    kept = np.stack([driven_m, errors_m], axis=1)[:: len(driven_m) // MOST_ALONG + 1]
    return {"diagnosis": {"drift": drift, "along": kept.tolist()}}


def combine(scores: Sequence[Scores]) -> Scores:
    """Return the means over what was scored: no number stands for the error of what is missing; completeness has 0."""
    combined = {}
    for name in NAMES:
        values = [row.get(name, 0.0) for row in scores if name in row or name == COMPLETENESS]
        if values:
            combined[name] = math.fsum(values) / len(values)
    return combined


def matched(result: Result) -> tuple[Trajectory, Trajectory, float]:
    """Return the estimated and the true poses of the observations that have both, and what share these are of all."""
    truth, numbers = truth_of(result)
    poses = sorted(result["results"]["poses"], key=lambda pose: pose["observation"])
    place = {number: index for index, number in enumerate(numbers)}
    unknown = [pose["observation"] for pose in poses if pose["observation"] not in place]
    if unknown:
        raise BenchbotError(
            "The trajectory has poses of observations that there were not.",
            f"Observation {unknown[0]}; there were {len(numbers)}, from 0 to {numbers[-1]}.",
            "Count observations from 0: the first that reset() returns, then one for each step.",
        )
    completeness = len(poses) / len(numbers)
    if completeness < LEAST_COMPLETENESS and len(poses) < len(numbers) - 1:
        raise BenchbotError(
            "The trajectory leaves out too many observations.",
            f"It has poses for {len(poses)} of {len(numbers)}; {LEAST_COMPLETENESS:.0%} are needed.",
            "Give one for each observation; where the estimator has none, the last one moved on by odometry.",
        )
    indices = [place[pose["observation"]] for pose in poses]
    chosen = truth.at(indices)
    estimate = Trajectory.from_quaternions(
        [pose["translation_xyz"] for pose in poses], [pose["rotation_xyzw"] for pose in poses], chosen.times_s
    )
    return estimate, chosen, completeness


def truth_of(result: Result) -> tuple[Trajectory, list[int]]:
    """Return where the robot really was at each observation, and the observations' numbers.

    The track is level: its height is that of the start pose.
    """
    rows = [row for row in _track(result)["rows"] if row[0] is not None]
    times_s, x, y, yaw_rad = np.array([row[1:] for row in rows], np.float64).T
    positions_m = np.stack([x, y, np.full_like(x, _height_m(result))], axis=1)
    zeros = np.zeros_like(x)
    quaternions = np.stack([zeros, zeros, np.sin(yaw_rad / 2), np.cos(yaw_rad / 2)], axis=1)
    return Trajectory.from_quaternions(positions_m, quaternions, times_s), [row[0] for row in rows]


def _height_m(result: Result) -> float:
    """Return the height of the start pose, 0 where none is declared."""
    start_pose = result["environment_details"][0].get("start_pose")
    if start_pose is None:
        return 0.0
    try:
        return Pose.from_wxyz_xyz(start_pose).translation_xyz[2]
    except (TypeError, ValueError) as error:
        raise BenchbotError(
            "The start pose of the result's environment is not a pose.",
            f"environment_details/0/start_pose: {error}.",
            "Score the result as the back end has written it.",
        ) from error


def _track(result: Result) -> Mapping[str, Any]:
    """Return the result's one track; raises BenchbotError for a result that cannot be judged by it."""
    tracks = result.get("track") or []
    if not tracks or not any(row[0] is not None for row in tracks[0]["rows"]):
        raise BenchbotError(
            "The result does not say where the robot went.",
            "It has no track, which the back end notes when a run is submitted.",
            "Score the result that benchbot submit writes, or the one that benchbot run keeps in its folder.",
        )
    if len(tracks) > 1:
        raise BenchbotError(
            "The result is of several scenes.",
            f"It has {len(tracks)} tracks; a trajectory is of one.",
            "Run a task with one scene: benchbot list tasks",
        )
    track: Mapping[str, Any] = tracks[0]
    if track["path_length_m"] < LEAST_PATH_M:
        raise BenchbotError(
            "The robot has hardly moved.",
            f"It has driven {track['path_length_m']:.2f} m; any estimate is good on less than {LEAST_PATH_M:g} m.",
            "Let the robot drive further.",
        )
    return track


def _rmse(errors: Floats) -> float | None:
    found = metrics.summary(errors)
    return None if found is None else found.rmse
