"""Hints at mistakes that spoil a whole object map: an empty one, unknown classes, wrong lengths, a wrong frame."""

from collections.abc import Sequence
from typing import cast

import numpy as np

from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq.boxes import Boxes
from benchbot_eval_omq.frames import FARTHEST_M, in_another_frame
from benchbot_eval_omq.omq import Comparison, evaluate
from benchbot_eval_omq.qualities import Qualities

WORTH_TELLING = 0.05
SWALLOWED = 0.8
MARGIN_M = 1.0
_SCALES = {2.0: "Are they half extents?", 0.5: "Are they doubled?"}


def hints(result: Result, ground_truths: Sequence[GroundTruth], table: Qualities, comparison: Comparison) -> list[str]:
    """Return a sentence for each mistake that the map seems to have, none for a map without."""
    if not table.estimates:
        return ["The map is empty."]
    found = _unknown_classes(result, table)
    if table.true_objects:
        found += [*_scaled(result, ground_truths), *_outside(table), *_swallowing(table, comparison)]
        found += in_another_frame(result, ground_truths, table)
    return found


def _unknown_classes(result: Result, table: Qualities) -> list[str]:
    """Return which classes of the map, most probable for some object, the truth does not know."""
    listed = result["results"]["class_list"]
    weights = np.array([item["label_probs"] for item in table.estimates], float)
    counts = np.bincount(weights.argmax(axis=1)[weights.max(axis=1) > 0], minlength=len(listed)).tolist()
    unknown = [(name, count) for name, count in zip(listed, counts, strict=True) if count]
    return [
        f"'{name}' is no class of this truth: it counts as background (objects: {count})."
        for name, count in unknown
        if table.classes.index(name) is None
    ]


def _scaled(result: Result, ground_truths: Sequence[GroundTruth]) -> list[str]:
    score = evaluate(result, ground_truths)["OMQ"]
    found = []
    for scale, question in _SCALES.items():
        objects = [
            {**item, "extent": [min(scale * length, FARTHEST_M) for length in item["extent"]]}
            for item in result["results"]["objects"]
        ]
        scaled = cast(Result, {**result, "results": {**result["results"], "objects": objects}})
        other = evaluate(scaled, ground_truths)["OMQ"]
        if other >= score + WORTH_TELLING:
            found.append(f"With all extents scaled by {scale:g} it would give {other:.2f}. {question}")
    return found


def _outside(table: Qualities) -> list[str]:
    truths, boxes = Boxes.of(table.true_objects), Boxes.of(table.estimates)
    lower, upper = truths.lower.min(axis=0) - MARGIN_M, truths.upper.max(axis=0) + MARGIN_M
    count = int(((boxes.upper < lower) | (boxes.lower > upper)).any(axis=1).sum())
    # Of a map of changes the truth here is only what has changed, which says nothing of where the scene ends.
    if not count or table.state is not None:
        return []
    where = f"lie more than {MARGIN_M:g} m outside the bounds of all true objects"
    return [f"Boxes that {where}: {count} of {len(table.estimates)}. Are they in the frame of the map?"]


def _swallowing(table: Qualities, comparison: Comparison) -> list[str]:
    """Return which boxes hold several true objects that have no better estimate: a table may well hold its chairs."""
    partner = dict(comparison.pairs.tolist())
    volumes = Boxes.of(table.true_objects).volumes
    inside = (table.intersections >= SWALLOWED * volumes[:, None]) & (volumes[:, None] > 0)
    found = []
    for column in np.flatnonzero(inside.sum(axis=0) > 1).tolist():
        rows = [row for row in np.flatnonzero(inside[:, column]).tolist() if partner.get(row, column) == column]
        if len(rows) > 1 and table.spatial[:, column].max() < 0.5:
            named = ", ".join(
                f"'{table.classes.names[int(table.true_classes[row])]}' ({table.origins[row][1]})" for row in rows
            )
            found.append(f"The box of estimate {column} holds several true objects that have no other: {named}.")
    return found
