"""Object map quality: how well the objects of a map agree with those that are there.

Hall et al., "The Robotic Vision Scene Understanding Challenge", arXiv:2009.05246, and the score published with
BenchBot 2, whose numbers these equal to 1e-6 wherever it gives any.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq.qualities import ADDED, REMOVED, Array, Qualities, qualities

_KEYS = ("OMQ", "avg_pairwise", "avg_label", "avg_spatial", "avg_fp_quality")


@dataclass(frozen=True)
class Comparison:
    """The assignment of estimated objects to true ones, with the qualities of each pair.

    `pairs` holds rows of (index among the true objects, index among the estimates); `pairwise`, `spatial`, `label` and
    `state` (None without states) hold a quality in (0, 1] for each. `false_positives` are indices of estimates and
    `costs` what each costs, in [0, 1]. `ignored` are indices of estimates that are parts of true groups.
    """

    pairs: NDArray[np.int64]
    pairwise: Array
    spatial: Array
    label: Array
    state: Array | None
    missed: NDArray[np.int64]
    false_positives: NDArray[np.int64]
    costs: Array
    ignored: NDArray[np.int64]


def evaluate(result: Result, ground_truths: Sequence[GroundTruth]) -> dict[str, float]:
    """Return OMQ and the averages it is made of, each in [0, 1], `avg_state_quality` for maps with states.

    A semantic map is scored against one ground truth, a map of changes against those of the scenes before and after.
    Raises BenchbotError for a result or ground truth that breaks its format. Changes neither.
    """
    comparison = compare(result, ground_truths)
    hits = len(comparison.pairs)
    cost = math.fsum(comparison.costs)
    total = math.fsum(comparison.pairwise)
    false_positives = len(comparison.false_positives)
    weight = hits + len(comparison.missed) + cost
    scores = {
        "OMQ": total / weight if weight else 0.0,
        "avg_pairwise": _mean(comparison.pairwise),
        "avg_label": _mean(comparison.label),
        "avg_spatial": _mean(comparison.spatial),
        "avg_fp_quality": (false_positives - cost) / false_positives if false_positives else 1.0,
    }
    if comparison.state is not None:
        scores["avg_state_quality"] = _mean(comparison.state)
    return scores


def combine(scores: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the unweighted mean of each score; an empty mapping is a missing result and counts as all zeros."""
    keys = list(dict.fromkeys([*_KEYS, *(key for score in scores for key in score)]))
    count = max(len(scores), 1)
    return {key: math.fsum(score.get(key, 0.0) for score in scores) / count for key in keys}


def compare(result: Result, ground_truths: Sequence[GroundTruth]) -> Comparison:
    """Match the objects of a map to the true ones; errors as for `evaluate`."""
    return matched(qualities(result, ground_truths))


def matched(table: Qualities) -> Comparison:
    """Pair true objects with estimates so that the sum of qualities is the largest possible."""
    rows, columns = linear_sum_assignment(1.0 - table.pairwise)
    hit = table.pairwise[rows, columns] > 0
    rows, columns = rows[hit], columns[hit]
    unmatched = np.setdiff1d(np.arange(len(table.estimates)), columns)
    ignored = _parts_of_groups(unmatched, table)
    false_positives = unmatched[~ignored]
    changes = None if table.states is None or not table.true_objects else table.states[false_positives]
    return Comparison(
        np.stack([rows, columns], axis=1),
        table.pairwise[rows, columns],
        table.spatial[rows, columns],
        table.label[rows, columns],
        None if table.state is None else table.state[rows, columns],
        np.setdiff1d(np.arange(len(table.true_objects)), rows),
        false_positives,
        _costs(table.labels[false_positives], changes),
        unmatched[ignored],
    )


def _parts_of_groups(unmatched: NDArray[np.int64], table: Qualities) -> NDArray[np.bool_]:
    """Say which unmatched estimates are parts of a true group and so neither hit nor false positive.

    Such a part is nearest to a group of its own most likely class, and at least half of it lies inside the group.
    """
    if not table.true_objects or not len(unmatched):
        return np.zeros(len(unmatched), bool)
    # v2's own format of ground truths creates objects with `is_group`; its ground truths and its OMQ say `isgroup`.
    groups = np.array([bool(item.get("isgroup", item.get("is_group", False))) for item in table.true_objects], bool)
    quality = table.pairwise[:, unmatched]
    nearest = quality.argmax(axis=0)
    return np.asarray(
        (quality.max(axis=0) > 0)
        & groups[nearest]
        & (table.labels[unmatched, :-1].argmax(axis=1) == table.true_classes[nearest])
        & (table.intersections[nearest, unmatched] >= 0.5 * table.volumes[unmatched])
    )


def _costs(labels: Array, states: Array | None) -> Array:
    """Return what false positives cost: how sure they are of not being background, and of a change."""
    sureness: Array = labels[:, :-1].max(axis=1, initial=0.0)
    if states is None:
        return sureness
    return np.asarray(np.sqrt(sureness * states[:, [ADDED, REMOVED]].max(axis=1, initial=0.0)))


def _mean(values: Array) -> float:
    return math.fsum(values) / len(values) if len(values) else 0.0
