"""Tables of the quality of every estimated object as a match for every true one, for scores and explanations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import BenchbotError, GroundTruth, Result, check_format
from benchbot_eval_omq.boxes import Boxes, intersections_over_unions
from benchbot_eval_omq.classes import Classes, normalised

Array = NDArray[np.float64]
Object = Mapping[str, Any]

STATES = ("added", "removed", "unchanged")
"""The state list of the format `object_map_with_states`, in its order."""
ADDED, REMOVED = 0, 1
NEGLIGIBLE = 2.0**-25
"""Qualities below this are none: the published implementation stores 1 - quality in single precision."""


@dataclass(frozen=True)
class Qualities:
    """T true objects and E estimates, and for each pair of them how well they agree.

    `origins` are the scene of each true object and its index there. Tables are (T, E), in [0, 1]: `spatial`, `label`
    and `state` (None without states) are what `pairwise` is the geometric mean of; `intersections` are in cubic metres.
    """

    classes: Classes
    true_objects: Sequence[Object]
    origins: Sequence[tuple[int, int]]
    true_classes: NDArray[np.int64]
    true_states: NDArray[np.int64]
    estimates: Sequence[Object]
    labels: Array
    """Probabilities of the estimates over `classes`, (E, classes)."""
    states: Array | None
    """Probabilities of the estimates over added, removed, unchanged, (E, 3)."""
    volumes: Array
    intersections: Array
    spatial: Array
    label: Array
    state: Array | None
    pairwise: Array


def qualities(result: Result, ground_truths: Sequence[GroundTruth]) -> Qualities:
    """Return how well each pair agrees; raises BenchbotError for a result or ground truth that breaks its format."""
    with_states = _checked(result, ground_truths)
    classes = Classes.of(ground_truths)
    true_objects, origins, true_states = _true_objects(ground_truths, with_states)
    true_classes = np.array([_class_index(item, classes) for item in true_objects], int)
    results = result["results"]
    estimates = results["objects"]
    labels = classes.probabilities([item["label_probs"] for item in estimates], results["class_list"])
    states = None
    if with_states:
        weights = np.array([item["state_probs"] for item in estimates], float)
        states = normalised(weights.reshape(-1, len(STATES)))

    true_boxes, boxes = Boxes.of(true_objects), Boxes.of(estimates)
    intersections = true_boxes.intersections(boxes)
    spatial = intersections_over_unions(intersections, true_boxes.volumes, boxes.volumes)
    label = labels.T[true_classes]
    state = None if states is None else states.T[true_states]
    pairwise = np.sqrt(label * spatial) if state is None else np.cbrt(label * spatial * state)
    pairwise[pairwise < NEGLIGIBLE] = 0.0
    return Qualities(
        classes,
        true_objects,
        origins,
        true_classes,
        true_states,
        estimates,
        labels,
        states,
        boxes.volumes,
        intersections,
        spatial,
        label,
        state,
        pairwise,
    )


def _checked(result: Result, ground_truths: Sequence[GroundTruth]) -> bool:
    """Return whether the map has states; raises BenchbotError unless formats and number of scenes fit."""
    name = result.get("task_details", {}).get("results_format")
    scenes_of = {
        "object_map": 1,
        "object_map_with_states": 2,
    }
    if name not in scenes_of:
        raise BenchbotError(
            "OMQ cannot score this result.",
            f"Its task_details.results_format is {name!r}; OMQ reads: {', '.join(scenes_of)}.",
            "Score it with the method that belongs to its task: benchbot list methods",
        )
    scenes = scenes_of[name]
    check_format(name, result.get("results"))
    if len(ground_truths) < scenes:
        raise BenchbotError(
            "There are too few ground truths.",
            f"A result of the format '{name}' is scored against {scenes}, not {len(ground_truths)}.",
            "Give one for each scene of the result.",
        )
    for document in ground_truths:
        check_format("object_map_ground_truth", document.get("ground_truth"))
    return scenes == 2


def _true_objects(
    ground_truths: Sequence[GroundTruth], with_states: bool
) -> tuple[list[Object], list[tuple[int, int]], NDArray[np.int64]]:
    """Return the true objects, scene and index of each, and their states.

    With states these are the objects that only one of two scenes has.
    """
    before: list[Object] = ground_truths[0]["ground_truth"]["objects"]
    if not with_states:
        return before, [(0, index) for index in range(len(before))], np.zeros(len(before), int)
    after: list[Object] = ground_truths[1]["ground_truth"]["objects"]
    removed = [(0, index) for index, item in enumerate(before) if item not in after]
    added = [(1, index) for index, item in enumerate(after) if item not in before]
    origins = removed + added
    objects = [(before, after)[scene][index] for scene, index in origins]
    return objects, origins, np.array([REMOVED] * len(removed) + [ADDED] * len(added), int)


def _class_index(item: Object, classes: Classes) -> int:
    index = classes.index(item["class"])
    if index is None:
        raise BenchbotError(
            "A ground truth names a class that it does not list.",
            f"'{item['class']}' is neither in its class_list nor a synonym of a class there.",
            "Mend the ground truth.",
        )
    return index
