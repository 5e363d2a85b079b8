"""Object map quality: how well the objects of a map agree with those that are there.

Hall et al., "The Robotic Vision Scene Understanding Challenge", arXiv:2009.05246, and the score published with
BenchBot 2, whose numbers these equal to 1e-6 wherever it gives any.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from benchbot.core.errors import BenchbotError
from benchbot.plugins.formats import object_map, object_map_ground_truth, object_map_with_states
from benchbot_eval_omq.boxes import Boxes, intersections_over_unions
from benchbot_eval_omq.classes import Classes, normalised

Array = NDArray[np.float64]
Object = Mapping[str, Any]

ADDED, REMOVED = 0, 1
NEGLIGIBLE = 2.0**-25
"""Qualities below this are none: the published implementation stores 1 - quality in single precision."""
_KEYS = ("OMQ", "avg_pairwise", "avg_label", "avg_spatial", "avg_fp_quality")


@dataclass(frozen=True)
class Comparison:
    """Which estimated objects are which true ones, and how good each such pair is.

    `pairs` holds rows of (index among the true objects, index among the estimates); `pairwise`, `spatial`, `label` and
    `state` (None without states) hold a quality in (0, 1] for each. `false_positives` are indices of estimates and
    `costs` what each costs, in [0, 1].
    """

    pairs: NDArray[np.int64]
    pairwise: Array
    spatial: Array
    label: Array
    state: Array | None
    missed: NDArray[np.int64]
    false_positives: NDArray[np.int64]
    costs: Array


def evaluate(result: Mapping[str, Any], ground_truths: Sequence[Mapping[str, Any]]) -> dict[str, float]:
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


def compare(result: Mapping[str, Any], ground_truths: Sequence[Mapping[str, Any]]) -> Comparison:
    """Match the objects of a map to the true ones; errors as for `evaluate`."""
    with_states = _checked(result, ground_truths)
    classes = Classes.of(ground_truths)
    true_objects, true_states = _true_objects(ground_truths, with_states)
    true_classes = np.array([_class_index(item, classes) for item in true_objects], int)
    results = result["results"]
    estimates = results["objects"]
    labels = classes.probabilities([item["label_probs"] for item in estimates], results["class_list"])
    states = None
    if with_states:
        weights = np.array([item["state_probs"] for item in estimates], float)
        states = normalised(weights.reshape(-1, len(object_map_with_states.STATE_LIST)))

    true_boxes, boxes = Boxes.of(true_objects), Boxes.of(estimates)
    intersections = true_boxes.intersections(boxes)
    spatial = intersections_over_unions(intersections, true_boxes.volumes, boxes.volumes)
    label = labels.T[true_classes]
    state = None if states is None else states.T[true_states]
    pairwise = np.sqrt(label * spatial) if state is None else np.cbrt(label * spatial * state)
    pairwise[pairwise < NEGLIGIBLE] = 0.0

    rows, columns = linear_sum_assignment(1.0 - pairwise)
    hit = pairwise[rows, columns] > 0
    rows, columns = rows[hit], columns[hit]
    missed = np.setdiff1d(np.arange(len(true_objects)), rows)
    unmatched = np.setdiff1d(np.arange(len(estimates)), columns)
    groups = np.array([bool(item.get("isgroup", False)) for item in true_objects], bool)
    ignored = _parts_of_groups(unmatched, pairwise, groups, true_classes, labels, intersections, boxes.volumes)
    false_positives = unmatched[~ignored]
    return Comparison(
        np.stack([rows, columns], axis=1),
        pairwise[rows, columns],
        spatial[rows, columns],
        label[rows, columns],
        None if state is None else state[rows, columns],
        missed,
        false_positives,
        _costs(labels[false_positives], states[false_positives] if states is not None and true_objects else None),
    )


def _checked(result: Mapping[str, Any], ground_truths: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether the map has states; raises BenchbotError unless formats and number of scenes fit."""
    name = result.get("task_details", {}).get("results_format")
    formats: dict[str, tuple[Callable[[Any], None], int]] = {
        "object_map": (object_map.validate, 1),
        "object_map_with_states": (object_map_with_states.validate, 2),
    }
    if name not in formats:
        raise BenchbotError(
            "OMQ cannot score this result.",
            f"Its task_details.results_format is {name!r}; OMQ reads: {', '.join(formats)}.",
            "Score it with the method that belongs to its task: benchbot list methods",
        )
    validate, scenes = formats[name]
    validate(result.get("results"))
    if len(ground_truths) < scenes:
        raise BenchbotError(
            "There are too few ground truths.",
            f"A result of the format '{name}' is scored against {scenes}, not {len(ground_truths)}.",
            "Give one for each scene of the result.",
        )
    for document in ground_truths:
        object_map_ground_truth.validate(document.get("ground_truth"))
    return scenes == 2


def _true_objects(
    ground_truths: Sequence[Mapping[str, Any]], with_states: bool
) -> tuple[list[Object], NDArray[np.int64]]:
    """Return the true objects and their states; with states these are the ones that only one of two scenes has."""
    before: list[Object] = ground_truths[0]["ground_truth"]["objects"]
    if not with_states:
        return before, np.zeros(len(before), int)
    after: list[Object] = ground_truths[1]["ground_truth"]["objects"]
    removed = [item for item in before if item not in after]
    added = [item for item in after if item not in before]
    return removed + added, np.array([REMOVED] * len(removed) + [ADDED] * len(added), int)


def _class_index(item: Object, classes: Classes) -> int:
    index = classes.index(item["class"])
    if index is None:
        raise BenchbotError(
            "A ground truth names a class that it does not list.",
            f"'{item['class']}' is neither in its class_list nor a synonym of a class there.",
            "Mend the ground truth.",
        )
    return index


def _parts_of_groups(
    unmatched: NDArray[np.int64],
    pairwise: Array,
    groups: NDArray[np.bool_],
    true_classes: NDArray[np.int64],
    labels: Array,
    intersections: Array,
    volumes: Array,
) -> NDArray[np.bool_]:
    """Say which unmatched estimates are parts of a true group and so neither hit nor false positive.

    Such a part is nearest to a group of its own most likely class, and at least half of it lies inside the group.
    """
    if not len(groups) or not len(unmatched):
        return np.zeros(len(unmatched), bool)
    quality = pairwise[:, unmatched]
    nearest = quality.argmax(axis=0)
    return np.asarray(
        (quality.max(axis=0) > 0)
        & groups[nearest]
        & (labels[unmatched, :-1].argmax(axis=1) == true_classes[nearest])
        & (intersections[nearest, unmatched] >= 0.5 * volumes[unmatched])
    )


def _costs(labels: Array, states: Array | None) -> Array:
    """Return what false positives cost: how sure they are of not being background, and of a change."""
    sureness: Array = labels[:, :-1].max(axis=1, initial=0.0)
    if states is None:
        return sureness
    return np.asarray(np.sqrt(sureness * states[:, [ADDED, REMOVED]].max(axis=1, initial=0.0)))


def _mean(values: Array) -> float:
    return math.fsum(values) / len(values) if len(values) else 0.0
