"""Boxes of objects in pictures: those that a detector finds beside those that are there."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

OVERLAP = 0.5

Box = tuple[float, float, float, float]
"""Left, top, right and bottom, in pixels."""


@dataclass(frozen=True)
class Detection:
    """An object as the detector sees it."""

    class_name: str
    score: float
    box: Box


@dataclass(frozen=True)
class Truth:
    """An object that a picture shows in `pixels`; `is_counted` is False where nobody has to find it.

    `by_part` is True where a detection inside of it finds it: of a stack of things of the class, each of which a
    detector may find, and where COCO outlines a part of what BEAR does.
    """

    class_name: str
    pixels: int
    box: Box
    is_counted: bool = True
    by_part: bool = False


def without_doubles(found: Iterable[Detection]) -> list[Detection]:
    """Leave out what overlaps something surer of its class by more than half; the surest come first."""
    kept: list[Detection] = []
    for each in sorted(found, key=lambda detection: -detection.score):
        if all(each.class_name != other.class_name or iou(each.box, other.box) <= OVERLAP for other in kept):
            kept.append(each)
    return kept


@dataclass(frozen=True)
class Matches:
    """Which detection each truth has, and which detections are wrong; both are places in the lists."""

    found: dict[int, int]
    wrong: tuple[int, ...]


def match(truths: Sequence[Truth], detections: Sequence[Detection], least_iou: float) -> Matches:
    """Give each detection, the surest first, the counted truth of its class that it overlaps most, if none has it yet.

    As in COCO's evaluation, one that overlaps only what is not counted is neither right nor wrong, and one that may be
    a part overlaps by its own share that is inside; further parts are not wrong either.
    """
    found: dict[int, int] = {}
    wrong = []
    for place in sorted(range(len(detections)), key=lambda place: -detections[place].score):
        detection = detections[place]
        overlaps = [
            (truth.is_counted and number not in found, overlap(truth, detection), number)
            for number, truth in enumerate(truths)
            if truth.class_name == detection.class_name and (truth.by_part or number not in found)
        ]
        best = max((each for each in overlaps if each[1] >= least_iou), default=None)
        if best is None:
            wrong.append(place)
        elif best[0]:
            found[best[2]] = place
    return Matches(found, tuple(wrong))


def overlap(truth: Truth, detection: Detection) -> float:
    """IoU of the boxes, or where a part will do the share of the detection's box that is inside."""
    value = iou(truth.box, detection.box)
    if truth.by_part and area(detection.box) > 0:
        value = max(value, intersection(truth.box, detection.box) / area(detection.box))
    return value


def iou(one: Box, other: Box) -> float:
    """Intersection of two boxes over their union; 0 of two that are empty."""
    common = intersection(one, other)
    union = area(one) + area(other) - common
    return common / union if union > 0 else 0.0


def intersection(one: Box, other: Box) -> float:
    """Pixels that two boxes share."""
    return area((max(one[0], other[0]), max(one[1], other[1]), min(one[2], other[2]), min(one[3], other[3])))


def area(box: Box) -> float:
    """Pixels of a box."""
    return max(box[2] - box[0], 0.0) * max(box[3] - box[1], 0.0)
