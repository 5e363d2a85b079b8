"""Boxes of several views: how far they overlap, which are of one object, and which are doubtful repetitions."""

from collections.abc import Sequence

import numpy as np

from benchbot.plugins.mapping.lens import Doubles
from benchbot.plugins.mapping.objects import MappedObject, merged


def iou(objects: Sequence[MappedObject], others: Sequence[MappedObject]) -> Doubles:
    """Return the intersection over union of each pair of boxes, (N, M); 0 where both have no volume.

    It is the spatial quality of object map quality (OMQ).
    """
    shared = _intersections(_corners(objects), _corners(others))
    unions = np.add.outer(_volumes(objects), _volumes(others)) - shared
    return np.divide(shared, unions, out=np.zeros_like(unions), where=unions > 0)


def fuse(objects: Sequence[MappedObject], least_overlap: float = 0.6, margin_m: float = 0.02) -> list[MappedObject]:
    """Return detections of many views as one object each: those of one class whose boxes share enough.

    Two are of one object when their boxes, `margin_m` larger on each side, share `least_overlap` of the smaller one;
    what they were merged into is held against the others again, until nothing more fits. The order of the objects is
    of no account, and fusing again changes nothing. Objects of one class that touch, such as books in a row, become
    one: keep them apart by instance, or with a larger `least_overlap`.
    """
    found = list(objects)
    while True:
        groups = _of_one_object(found, least_overlap, margin_m)
        if len(groups) == len(found):
            return sorted(found, key=_place)
        found = [merged([found[i] for i in group]) for group in groups]


def non_maximum_suppression(
    objects: Sequence[MappedObject], largest_iou: float = 0.5, *, across_classes: bool = False
) -> list[MappedObject]:
    """Return the objects, by falling score, without those that overlap a better one by more than `largest_iou`.

    Of one class, or of any (`across_classes`). The order of the objects is of no account.
    """
    found = sorted(objects, key=lambda item: (-item.score, _place(item)))
    doubled = iou(found, found) > largest_iou
    if not across_classes:
        labels = np.array([item.label for item in found], np.str_)
        doubled &= labels[:, None] == labels
    kept: list[int] = []
    for i in range(len(found)):
        if not doubled[i, kept].any():
            kept.append(i)
    return [found[i] for i in kept]


def _of_one_object(objects: Sequence[MappedObject], least_overlap: float, margin_m: float) -> list[list[int]]:
    """Return the groups of indices of objects of one class that overlap, each by way of others perhaps."""
    from scipy.sparse.csgraph import connected_components

    # Class by class: the thousands of detections of a long way have as many pairs as their square.
    by_label: dict[str, list[int]] = {}
    for i, item in enumerate(objects):
        by_label.setdefault(item.label, []).append(i)
    found = []
    for indices in by_label.values():
        lower, upper = _corners([objects[i] for i in indices])
        grown = lower - margin_m, upper + margin_m
        volumes = np.prod(grown[1] - grown[0], axis=1)
        enough = _intersections(grown, grown) >= least_overlap * np.minimum.outer(volumes, volumes)
        count, groups = connected_components(enough, directed=False)
        found += [np.array(indices)[groups == group].tolist() for group in range(count)]
    return found


def _place(item: MappedObject) -> tuple[str, list[float], list[float], list[tuple[str, float]], int]:
    """Return all that an object is, so that no order but that of equal ones is left to chance."""
    lower, upper = (np.asarray(corner, np.float64).tolist() for corner in (item.lower, item.upper))
    return item.label, lower, upper, sorted(item.label_probs.items()), item.points


def _corners(objects: Sequence[MappedObject]) -> tuple[Doubles, Doubles]:
    lower, upper = (
        np.array([getattr(item, corner) for item in objects], np.float64).reshape(-1, 3)
        for corner in ("lower", "upper")
    )
    return lower, upper


def _volumes(objects: Sequence[MappedObject]) -> Doubles:
    lower, upper = _corners(objects)
    return np.asarray(np.prod(upper - lower, axis=1))


def _intersections(boxes: tuple[Doubles, Doubles], others: tuple[Doubles, Doubles]) -> Doubles:
    """Return the volumes that each pair of boxes shares, (N, M)."""
    shared = np.ones((len(boxes[0]), len(others[0])))
    for axis in range(3):
        upper = np.minimum.outer(boxes[1][:, axis], others[1][:, axis])
        lower = np.maximum.outer(boxes[0][:, axis], others[0][:, axis])
        shared *= np.maximum(upper - lower, 0.0)
    return shared
