"""Why an object map got its score: each true and each estimated object, with a verdict in plain words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq.diagnosis import Diagnosis, diagnose
from benchbot_eval_omq.hints import hints
from benchbot_eval_omq.omq import matched
from benchbot_eval_omq.qualities import ADDED, STATES, Array, Qualities, qualities

Document = dict[str, Any]

HALF_TOLERANCE = 0.06


def explain(result: Result, ground_truths: Sequence[GroundTruth]) -> Document:
    """Return `objects`, what became of each true one, then of each estimate without a partner, and their `diagnosis`.

    The schema `explanation` says what an entry holds. Errors as for `evaluate`; changes neither argument.
    """
    table = qualities(result, ground_truths)
    comparison = matched(table)
    column_of = {int(row): int(column) for row, column in comparison.pairs}
    costs = dict(zip(comparison.false_positives.tolist(), comparison.costs.tolist(), strict=True))
    diagnosis = diagnose(table, comparison)
    row_of = {column: row for row, column in column_of.items()}
    writer = _Writer(table, _scenes(ground_truths), column_of, row_of, diagnosis)
    rows, columns = range(len(table.true_objects)), sorted([*costs, *comparison.ignored.tolist()])
    truths = [writer.match(row) if row in column_of else writer.false_negative(row) for row in rows]
    others = [
        writer.false_positive(column, costs[column]) if column in costs else writer.ignored(column)
        for column in columns
    ]
    told = {**diagnosis.document(), "hints": hints(result, ground_truths, table, comparison)}
    return {"objects": truths + others, "diagnosis": told}


def _scenes(ground_truths: Sequence[GroundTruth]) -> list[str]:
    environments = [truth.get("environment", {}) for truth in ground_truths]
    return [f"{environment.get('name')}:{environment.get('variant')}" for environment in environments]


@dataclass(frozen=True)
class _Writer:
    """Writes entries; a row of the table is a true object, a column an estimate."""

    table: Qualities
    scenes: Sequence[str]
    column_of: Mapping[int, int]
    row_of: Mapping[int, int]
    diagnosis: Diagnosis

    def match(self, row: int) -> Document:
        column = self.column_of[row]
        factors = self._factors(row, column)
        why = f"Taken for it: the boxes overlap by {factors['spatial']:.2f} (IoU), and the class "
        why += f"'{self._true_label(row)}' has the probability {factors['label']:.2f}"
        if "state" in factors:
            why += f", the state '{self._true_state(row)}' {factors['state']:.2f}"
        return self._entry("match", row, column, factors, f"{why}.{self._half(row, column)}")

    def false_negative(self, row: int) -> Document:
        column = _nearest(self.table.pairwise[row], self.table.spatial[row])
        if column is None:
            why = "No estimate overlaps it." if self.table.estimates else "The map is empty."
        elif self.table.pairwise[row, column] > 0:
            why = f"Estimate {column} fits it best, but is taken for {self._truth(self.row_of[column])}."
        else:
            why = f"Estimate {column} overlaps it most (IoU {self.table.spatial[row, column]:.2f}), but gives "
            why += f"{self._obstacle(row, column)} no probability."
        return self._entry("false_negative", row, None, self._factors(row, column), why)

    def false_positive(self, column: int, cost: float) -> Document:
        row = _nearest(self.table.pairwise[:, column], self.table.spatial[:, column])
        if row is None:
            why = f"It overlaps no {'true object' if self.table.state is None else 'object that has changed'}."
        elif self.table.pairwise[row, column] > 0:
            why = f"It fits {self._truth(row)} best, but estimate {self.column_of[row]} is taken for that."
        else:
            why = f"It overlaps {self._truth(row)} most (IoU {self.table.spatial[row, column]:.2f}), but gives "
            why += f"{self._obstacle(row, column)} no probability."
        factors = {**self._factors(row, column), "fp_cost": min(cost, 1.0)}
        return self._entry("false_positive", None, column, factors, f"{why} It costs {cost:.2f}.")

    def ignored(self, column: int) -> Document:
        row = int(self.table.pairwise[:, column].argmax())
        why = f"A part of {self._truth(row)}, which is a group: it counts neither for nor against."
        return self._entry("ignored", row, column, self._factors(row, column), why) | {"error": None}

    def _entry(self, verdict: str, row: int | None, column: int | None, factors: Document, why: str) -> Document:
        truth = None if row is None else self.table.true_objects[row]
        estimate = None if column is None else self.table.estimates[column]
        error, counterpart = self.diagnosis.error(row, column)
        if row is None and counterpart is not None:
            counterpart = self.table.origins[counterpart][1]
        return {
            "scene": self.scenes[self._scene(row, column)],
            "proposal": column,
            "truth": None if row is None else self.table.origins[row][1],
            "label": None if column is None else self.table.classes.names[int(self.table.labels[column].argmax())],
            "truth_label": None if row is None else self._true_label(row),
            "centroid": None if estimate is None else list(estimate["centroid"]),
            "extent": None if estimate is None else list(estimate["extent"]),
            "truth_centroid": None if truth is None else list(truth["centroid"]),
            "truth_extent": None if truth is None else list(truth["extent"]),
            "verdict": verdict,
            "factors": factors,
            "why": why,
            "error": error,
            "counterpart": counterpart if row is None or column is None else None,
            **({} if column is None else {"probability": min(float(self.table.labels[column].max()), 1.0)}),
            **self._states(row, column),
        }

    def _states(self, row: int | None, column: int | None) -> Document:
        if self.table.states is None:
            return {}
        estimated = {} if column is None else {"state": STATES[int(self.table.states[column].argmax())]}
        return estimated | ({} if row is None else {"truth_state": self._true_state(row)})

    def _scene(self, row: int | None, column: int | None) -> int:
        """Return the scene that an entry is of: what was added belongs to the second, all else to the first."""
        if row is not None:
            return self.table.origins[row][0]
        if column is None or self.table.states is None:
            return 0
        return int(self.table.states[column].argmax() == ADDED)

    def _factors(self, row: int | None, column: int | None) -> Document:
        tables = {"overall": self.table.pairwise, "spatial": self.table.spatial, "label": self.table.label}
        if self.table.state is not None:
            tables["state"] = self.table.state
        known = row is not None and column is not None
        # Sums of probabilities may exceed 1 by a rounding error.
        return {name: min(float(table[row, column]), 1.0) if known else 0.0 for name, table in tables.items()}

    def _half(self, row: int, column: int) -> str:
        """Return a hint for a box that is half as long as the true one along each axis, nothing for any other."""
        extent, truth = (
            np.array(item["extent"], float) for item in (self.table.estimates[column], self.table.true_objects[row])
        )
        if (truth <= 0).any() or (np.abs(extent / truth - 0.5) > HALF_TOLERANCE).any():
            return ""
        return " It is half as long as the true one along each axis: an extent is a full length, not half of one."

    def _obstacle(self, row: int, column: int) -> str:
        """Return what keeps a pair of boxes that overlap from being any good."""
        if self.table.state is not None and self.table.state[row, column] < self.table.label[row, column]:
            return f"the state '{self._true_state(row)}'"
        return f"the class '{self._true_label(row)}'"

    def _truth(self, row: int) -> str:
        scene, index = self.table.origins[row]
        where = f" of {self.scenes[scene]}" if len(self.scenes) > 1 else ""
        return f"the true '{self._true_label(row)}' ({index}{where})"

    def _true_label(self, row: int) -> str:
        return self.table.classes.names[int(self.table.true_classes[row])]

    def _true_state(self, row: int) -> str:
        return STATES[int(self.table.true_states[row])]


def _nearest(pairwise: Array, spatial: Array) -> int | None:
    """Return the index of the best partner, else of the one that overlaps most, None when none does."""
    for values in (pairwise, spatial):
        if len(values) and values.max() > 0:
            return int(values.argmax())
    return None
