"""The kinds of error of an object map, and the OMQ that each costs.

After Bolya et al., "TIDE: A General Toolbox for Identifying Object Detection Errors", ECCV 2020, arXiv:2008.08115,
restated for maps whose objects have class probabilities: the README says how.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from benchbot_eval_omq.omq import Comparison
from benchbot_eval_omq.qualities import NEGLIGIBLE, STATES, Array, Qualities

Document = dict[str, Any]

FOREGROUND_IOU, BACKGROUND_IOU = 0.5, 0.1
"""TIDE's thresholds: a box is right from the first on, and has to do with an object at all from the second on."""
KINDS = ("class", "location", "state", "both", "duplicate", "background", "missed", "imprecise")
_FACTORS = ("class", "location", "state")


@dataclass(frozen=True)
class Diagnosis:
    """Which estimate is about which true object, and what is wrong with each.

    `rows` and `columns` are indices of P true objects and their estimates; `factors` are their class, spatial and (for
    maps of changes) state qualities, (P, 2 or 3), `wrong` the factors that are errors, `kinds` one of KINDS or
    "correct" for each. `costs` are what the P estimates cost as long as OMQ does not pair them, 0 where it does.
    """

    table: Qualities
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    factors: Array
    wrong: NDArray[np.bool_]
    kinds: Sequence[str]
    costs: Array
    missed: NDArray[np.int64]
    duplicates: dict[int, float]
    background: dict[int, float]

    def score(self, fixed: Collection[str] = ()) -> float:
        """Return the OMQ that the map would have with these KINDS of error put right, nothing paired anew."""
        of_fixed_kind = np.array([kind in fixed for kind in self.kinds], bool).reshape(-1, 1)
        right = (self.wrong & of_fixed_kind) | (~self.wrong & ("imprecise" in fixed))
        product = np.where(right, 1.0, self.factors).prod(axis=1)
        quality = np.sqrt(product) if self.table.state is None else np.cbrt(product)
        paired = quality >= NEGLIGIBLE
        total = math.fsum(quality[paired]) + len(self.missed) * ("missed" in fixed)
        cost = math.fsum(self.costs[~paired])
        cost += math.fsum(self.duplicates.values()) * ("duplicate" not in fixed)
        cost += math.fsum(self.background.values()) * ("background" not in fixed)
        weight = len(self.table.true_objects) + cost
        return total / weight if weight else 0.0

    def counts(self) -> dict[str, int]:
        """Return how many errors there are of each of KINDS."""
        imprecise = int((~self.wrong & (self.factors < 1.0 - 1e-9)).any(axis=1).sum())
        others = {"duplicate": len(self.duplicates), "background": len(self.background), "missed": len(self.missed)}
        return {kind: list(self.kinds).count(kind) for kind in KINDS} | others | {"imprecise": imprecise}

    def document(self) -> Document:
        """Return the errors, largest gain first, and the confusion of classes (schema `explanation`)."""
        score, counts = self.score(), self.counts()
        kinds = [kind for kind in KINDS if counts[kind]]
        errors: list[Document] = [
            {"kind": kind, "count": counts[kind], "gain": min(max(self.score([kind]) - score, 0.0), 1.0)}
            for kind in kinds
        ]
        table = self.table
        told: Document = {
            "score": min(score, 1.0),
            "errors": sorted(errors, key=lambda error: -error["gain"]),
            "confusion": self._confusion(table.classes.names, table.true_classes, table.labels),
        }
        if table.states is not None:
            told["states"] = self._confusion(STATES, table.true_states, table.states)
        return told

    def error(self, row: int | None, column: int | None) -> tuple[str | None, int | None]:
        """Return the kind of error that a true object or an estimate has, None for none, and its other side's index."""
        of_row, of_column = self._partners
        other: int | None
        if row is not None:
            other, kind = of_row.get(row, (None, "missed"))
        elif column in of_column:
            other, kind = of_column[column]
        else:
            kind = "duplicate" if column in self.duplicates else "background"
            other = int(self.table.spatial[:, column].argmax()) if kind == "duplicate" else None
        return None if kind == "correct" else kind, other

    @cached_property
    def _partners(self) -> tuple[dict[int, tuple[int, str]], dict[int, tuple[int, str]]]:
        """The partner and the kind of error of each true object that has one, and of each such estimate."""
        found = list(zip(self.rows.tolist(), self.columns.tolist(), self.kinds, strict=True))
        return {row: (column, kind) for row, column, kind in found}, {
            column: (row, kind) for row, column, kind in found
        }

    def _confusion(self, names: Sequence[str], true: NDArray[np.int64], given: Array) -> list[Document]:
        """Return for each true class or state, and for no true object, the sums of the probabilities `given` there."""

        def confused(truth: str | None, estimates: NDArray[np.int64], missed: int) -> Document:
            sums = zip(names, given[estimates].sum(axis=0).tolist(), strict=True)
            probabilities = {name: value for name, value in sums if value > 0}
            return {"truth": truth, "objects": len(estimates) + missed, "missed": missed, "estimated": probabilities}

        spare = np.array(sorted([*self.duplicates, *self.background]), int)
        rows = [
            confused(names[index], self.columns[true[self.rows] == index], int((true[self.missed] == index).sum()))
            for index in np.unique(true)
        ]
        return rows + ([confused(None, spare, 0)] if len(spare) else [])


def diagnose(table: Qualities, comparison: Comparison) -> Diagnosis:
    """Return what is wrong with a map, given what OMQ made of it."""
    costs = dict(zip(comparison.false_positives.tolist(), comparison.costs.tolist(), strict=True))
    more_rows, more_columns = _same_place(table, comparison)
    rows = np.concatenate([comparison.pairs[:, 0], more_rows]).astype(int)
    columns = np.concatenate([comparison.pairs[:, 1], more_columns]).astype(int)
    qualities = [table.label, table.spatial, *([] if table.state is None else [table.state])]
    wrong = [
        table.labels[columns].argmax(axis=1) != table.true_classes[rows],
        table.spatial[rows, columns] < FOREGROUND_IOU,
    ]
    if table.states is not None:
        wrong.append(table.states[columns].argmax(axis=1) != table.true_states[rows])
    errors = np.stack(wrong, axis=1)
    spare = sorted(set(costs) - set(columns.tolist()))
    overlaps = table.spatial.max(axis=0, initial=0.0)
    return Diagnosis(
        table,
        rows,
        columns,
        np.stack([quality[rows, columns] for quality in qualities], axis=1),
        errors,
        [_kind(row) for row in errors],
        np.array([costs.get(column, 0.0) for column in columns.tolist()], float),
        np.setdiff1d(np.arange(len(table.true_objects)), rows),
        {column: costs[column] for column in spare if overlaps[column] >= BACKGROUND_IOU},
        {column: costs[column] for column in spare if overlaps[column] < BACKGROUND_IOU},
    )


def _same_place(table: Qualities, comparison: Comparison) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pair missed objects with false positives that lie where they are, but give class or state no probability."""
    overlap = table.spatial[np.ix_(comparison.missed, comparison.false_positives)]
    rows, columns = linear_sum_assignment(-np.where(overlap >= BACKGROUND_IOU, overlap, 0.0))
    near = overlap[rows, columns] >= BACKGROUND_IOU
    return comparison.missed[rows[near]], comparison.false_positives[columns[near]]


def _kind(wrong: NDArray[np.bool_]) -> str:
    names = [name for name, error in zip(_FACTORS, wrong.tolist(), strict=False) if error]
    return "correct" if not names else names[0] if len(names) == 1 else "both"
