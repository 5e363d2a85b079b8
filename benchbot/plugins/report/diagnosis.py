"""What went wrong over many results: their diagnoses (schema `explanation`) taken together."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Document = Mapping[str, Any]

MEANINGS = {
    "class": "right place, wrong class",
    "location": "right class, poor box",
    "state": "wrong about what has changed",
    "both": "wrong in two or three of these",
    "duplicate": "found once more",
    "background": "nothing is there",
    "missed": "not in the map",
    "imprecise": "right, but unsure or loose",
}
"""The kinds of error of object maps, in words that need no README."""
BREAKDOWNS = {
    "size": "Size of the object",
    "nearest_view": "Distance of the nearest view",
    "occlusion": "How much of it was ever to be seen",
    "times_seen": "How often it was seen",
    "light": "How bright it was (of 1)",
}
ENDINGS = {
    "reached": "arrived",
    "collision": "hit something",
    "limit": "ran out of steps or time",
    "failed": "failed",
    "never_saw": "never saw the goal",
    "loop": "went in circles",
    "passed": "was there, and went on",
    "stopped_short": "stopped short of it",
    "not_alone": "began anew, or was helped",
}


@dataclass(frozen=True)
class ErrorTally:
    """One kind of error: how many there are, and how much higher the combined score would be without."""

    kind: str
    count: int
    gain: float

    @property
    def meaning(self) -> str:
        """What the kind is, in words."""
        return MEANINGS.get(self.kind, "")


@dataclass(frozen=True)
class Group:
    """Objects that have something in common: how many there are, how many were found, and how well in the mean."""

    label: str
    objects: int
    found: int
    quality: float


def errors(diagnoses: Sequence[Document], counted: int) -> list[ErrorTally]:
    """Return the kinds of error, the costliest first; gains are means over `counted` results."""
    counts: Counter[str] = Counter()
    gains: dict[str, float] = {}
    for error in _items(diagnoses, "errors"):
        counts[error["kind"]] += error["count"]
        gains[error["kind"]] = gains.get(error["kind"], 0.0) + error["gain"] / max(counted, 1)
    return sorted((ErrorTally(kind, counts[kind], gain) for kind, gain in gains.items()), key=lambda one: -one.gain)


def confusions(diagnoses: Sequence[Document], most: int = 12) -> list[tuple[str, str, float]]:
    """Return true class, the class that estimates gave it, and the sum of probabilities, those of most weight first."""
    found: Counter[tuple[str, str]] = Counter()
    for row in _items(diagnoses, "confusion"):
        for name, weight in row["estimated"].items():
            if row["truth"] is not None and name != row["truth"]:
                found[row["truth"], name] += weight
    return [(truth, name, weight) for (truth, name), weight in found.most_common(most) if weight >= 0.1]


def breakdown(diagnoses: Sequence[Document]) -> dict[str, list[Group]]:
    """Return how well objects were found, by what may be the reason, groups in their order."""
    order: dict[str, list[str]] = {}
    found: dict[tuple[str, str], list[Document]] = {}
    for item in _items(diagnoses, "breakdown"):
        for row in item["groups"]:
            labels = order.setdefault(item["by"], [])
            if row["label"] not in labels:
                labels.append(row["label"])
            found.setdefault((item["by"], row["label"]), []).append(row)
    return {
        by: [_merged(label, found[by, label]) for label in sorted(labels, key=_rank)] for by, labels in order.items()
    }


def endings(diagnoses: Sequence[Document]) -> list[tuple[str, int]]:
    """Return how episodes ended, in words, and how many did."""
    kinds = Counter(diagnosis["ending"]["kind"] for diagnosis in diagnoses if "ending" in diagnosis)
    return [(ENDINGS.get(kind, kind), count) for kind, count in kinds.most_common()]


def drift(diagnoses: Sequence[Document]) -> list[tuple[float, float, float, int]]:
    """Return length of stretches, mean errors in metres and degrees over results, and how many stretches there are."""
    rows: dict[float, list[Document]] = {}
    for row in _items(diagnoses, "drift"):
        rows.setdefault(row["length_m"], []).append(row)
    return [
        (
            length_m,
            sum(row["error_m"] for row in found) / len(found),
            sum(row["error_deg"] for row in found) / len(found),
            sum(row["stretches"] for row in found),
        )
        for length_m, found in sorted(rows.items())
    ]


def _items(diagnoses: Iterable[Document], key: str) -> Iterator[Document]:
    for diagnosis in diagnoses:
        yield from diagnosis.get(key, ())


def _merged(label: str, rows: Sequence[Document]) -> Group:
    objects = sum(row["objects"] for row in rows)
    quality = sum(row["quality"] * row["objects"] for row in rows) / objects
    return Group(label, objects, sum(row["found"] for row in rows), quality)


def _rank(label: str) -> int:
    from benchbot.evaluation.breakdown import LABELS

    return LABELS.index(label) if label in LABELS else len(LABELS)
