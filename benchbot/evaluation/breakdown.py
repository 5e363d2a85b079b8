"""How well true objects were found, by size and by how they were seen."""

from collections.abc import Sequence
from math import inf
from typing import Any

Document = dict[str, Any]

_NEVER = "never seen"
_GROUPS: dict[str, tuple[str, list[tuple[float, str]]]] = {
    "size": (
        "",
        [(0.2, "longest side below 0.2 m"), (0.5, "0.2 to 0.5 m"), (1.0, "0.5 to 1 m"), (inf, "1 m and more")],
    ),
    "nearest_view": ("nearest_m", [(1.0, "below 1 m"), (2.0, "1 to 2 m"), (4.0, "2 to 4 m"), (inf, "4 m and more")]),
    "occlusion": (
        "visible",
        [(0.5, "half or more always hidden"), (0.9, "10 to 50 % hidden"), (inf, "once all to be seen")],
    ),
    "times_seen": (
        "times_seen",
        [(1.5, "once"), (5.5, "2 to 5 times"), (20.5, "6 to 20 times"), (inf, "more often")],
    ),
    "light": ("brightness", [(0.15, "dark: below 0.15"), (0.35, "dim: below 0.35"), (inf, "bright")]),
}


LABELS = [*(label for _, groups in _GROUPS.values() for _, label in groups), _NEVER]
"""The groups of all breakdowns, in their order."""


def breakdown(objects: Sequence[Document]) -> list[Document]:
    """Return how well true objects were found, by size and, of those with evidence, by how they were seen."""
    true = [item for item in objects if item["verdict"] in ("match", "false_negative")]
    told = []
    for by, (key, groups) in _GROUPS.items():
        labelled = [(label, item) for item in true if (label := _group(item, key, groups)) is not None]
        order = [*(label for _, label in groups), _NEVER]
        found = [(label, [item for other, item in labelled if other == label]) for label in order]
        rows = [_row(label, items) for label, items in found if items]
        if rows:
            told.append({"by": by, "groups": rows})
    return told


def _group(item: Document, key: str, groups: Sequence[tuple[float, str]]) -> str | None:
    evidence = item.get("evidence")
    value: float | None = max(item["truth_extent"]) if not key else None if evidence is None else evidence.get(key)
    if value is None or (key == "times_seen" and not value):
        return None if evidence is None or evidence["times_seen"] or key == "brightness" else _NEVER
    return next(label for below, label in groups if value < below)


def _row(label: str, items: Sequence[Document]) -> Document:
    qualities = [item["factors"]["overall"] if item["verdict"] == "match" else 0.0 for item in items]
    found = sum(item["verdict"] == "match" for item in items)
    return {"label": label, "objects": len(items), "found": found, "quality": sum(qualities) / len(items)}
