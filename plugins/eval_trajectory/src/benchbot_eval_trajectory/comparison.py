"""Comparing an estimated trajectory with the true one: all errors, summed up."""

from dataclasses import asdict
from typing import Any

from benchbot.plugin import BenchbotError
from benchbot_eval_trajectory import metrics
from benchbot_eval_trajectory.alignment import Align, alignment
from benchbot_eval_trajectory.association import MAX_DIFFERENCE_S, Association, associate
from benchbot_eval_trajectory.trajectory import Floats, Trajectory


def compare(
    estimate: Trajectory,
    truth: Trajectory,
    *,
    align: str = Align.SE3,
    length_m: float = 1.0,
    max_difference_s: float = MAX_DIFFERENCE_S,
    association: str = Association.EVO,
) -> dict[str, Any]:
    """Return `{poses, unmatched, association, align, scale, length_m, errors: {name: {rmse, mean, …, count} | None}}`.

    Poses belong together by time, or one by one when neither has times; then `association` is None. `unmatched` has
    for `estimate` and `ground_truth` how many `poses` belong to none of the other, and `of` how many. Relative errors
    are over `length_m` of the true way, and from each pose to the next. Raises BenchbotError when nothing belongs
    together.
    """
    sizes = {"estimate": len(estimate), "ground_truth": len(truth)}
    by_time = estimate.times_s is not None
    estimate, truth, used = _associated(estimate, truth, max_difference_s, Association(association))
    motion = alignment(estimate, truth, Align(align))
    aligned = motion.of(estimate)
    path = metrics.relative(aligned, truth, metrics.pairs_by_path(truth.positions_m, length_m))
    frame = metrics.relative(aligned, truth, metrics.neighbours(len(truth)))
    errors = {
        "ATE_m": metrics.absolute_m(aligned, truth),
        "RPE_m": path[0],
        "RPE_deg": path[1],
        "RPE_frame_m": frame[0],
        "RPE_frame_deg": frame[1],
    }
    summaries = {name: metrics.summary(values) for name, values in errors.items()}
    return {
        "poses": len(truth),
        "unmatched": {name: {"poses": size - used[name], "of": size} for name, size in sizes.items()},
        "association": association if by_time else None,
        "align": align,
        "scale": motion.scale,
        "length_m": length_m,
        "errors": {name: found and asdict(found) for name, found in summaries.items()},
    }


def _associated(
    estimate: Trajectory, truth: Trajectory, max_difference_s: float, rule: Association
) -> tuple[Trajectory, Trajectory, dict[str, int]]:
    """Return the poses of both that belong together, and how many of each these are."""
    if estimate.times_s is None and truth.times_s is None:
        if len(estimate) != len(truth):
            raise BenchbotError(
                "The two trajectories have different numbers of poses.",
                f"The estimate has {len(estimate)}, the ground truth {len(truth)}; without times, line goes with line.",
                "Give one pose for each of the ground truth, or TUM files, which have times.",
            )
        return estimate, truth, {"estimate": len(estimate), "ground_truth": len(truth)}
    if estimate.times_s is None or truth.times_s is None:
        raise BenchbotError(
            "Only one of the two trajectories has times.",
            "The one is a TUM file, the other a KITTI file.",
            "Give two files of the same format.",
        )
    ours, theirs = associate(estimate.times_s, truth.times_s, max_difference_s, rule)
    if not len(ours):
        raise BenchbotError(
            "No two poses of the trajectories belong together.",
            f"The estimate is from {_span(estimate.times_s)}, the ground truth from {_span(truth.times_s)}; "
            f"none are within {max_difference_s:g} s of each other.",
            "Use the same clock for both, or allow more with --max-difference.",
        )
    used = {"estimate": len(set(ours.tolist())), "ground_truth": len(set(theirs.tolist()))}
    return estimate.at(ours), truth.at(theirs), used


def _span(times_s: Floats) -> str:
    return f"{times_s[0]:.2f} s to {times_s[-1]:.2f} s"
