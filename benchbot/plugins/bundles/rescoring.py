"""Scores that somebody states, held against those that the results get here."""

import math
from collections.abc import Mapping
from typing import Any

from benchbot.core import overrides

Row = Mapping[str, Any]


def contradictions(stated: Mapping[str, Any], found: Mapping[str, Any], tolerance: float = 0.0) -> list[str]:
    """Return where two scores documents of the same results differ by more than `tolerance`, row by row."""
    method, here = stated["method"], found["method"]
    if method["name"] != here["name"]:
        return [f"The scores are of the method '{method['name']}', here they are of '{here['name']}'."]
    said, scored = _rows(stated), _rows(found)
    problems = [f"{label}: it is among the scores, but not among the results." for label in said if label not in scored]
    problems += [f"{label}: the scores do not mention it." for label in scored if label not in said]
    for label in (label for label in said if label in scored):
        problems += [f"{label}: {text}" for text in unequal(said[label]["scores"], scored[label]["scores"], tolerance)]
    return problems + [f"all: {text}" for text in unequal(stated["scores"], found["scores"], tolerance)]


def unequal(stated: Mapping[str, float], found: Mapping[str, float], tolerance: float = 0.0) -> list[str]:
    """Return which scores differ by more than `tolerance`, as text: `OMQ is 0.5, not 0.7`."""
    texts = []
    for name in dict.fromkeys([*stated, *found]):
        if name not in stated or name not in found:
            texts.append(f"{name} is only among the scores {'stated' if name in stated else 'found'}")
        elif not math.isclose(stated[name], found[name], rel_tol=1e-12, abs_tol=max(tolerance, 1e-12)):
            texts.append(f"{name} is {found[name]:.6g}, not {stated[name]:.6g}")
    return texts


def label(row: Row) -> str:
    """Return what tells a row of scores from the others: `miniroom:1, seed 3`."""
    said = [f"{key} {row[key]}" for key in ("seed", "episode", "repeat") if row.get(key) is not None]
    return ", ".join(filter(None, [str(row["environment"]), *said, overrides.label(row.get("settings") or {})]))


def _rows(document: Mapping[str, Any]) -> dict[str, Row]:
    return {label(row): row for row in document["rows"]}
