"""Hints at mistakes that spoil a whole object map."""

import pytest
from hypothesis import given

from benchbot_eval_omq.explanation import explain
from plugins.eval_omq.tests.omq_maps import found, semantic_map, thing, truth
from plugins.eval_omq.tests.test_omq_properties import Objects, relaxed, true_objects

ROOM = truth(thing("chair"), thing("tv", x=4.0))


def hinted(*objects: dict[str, object], **keys: object) -> list[str]:
    hints: list[str] = explain(semantic_map(*objects, **keys), [ROOM])["diagnosis"]["hints"]
    return hints


def test_an_empty_map_is_told() -> None:
    assert hinted() == ["The map is empty."]


def test_a_class_that_the_truth_does_not_know_is_told() -> None:
    classes = ["Unicorn", "table", "tv", "background"]

    assert hinted(found("chair"), found("tv", x=4.0), class_list=classes) == [
        "'Unicorn' is no class of this truth: it counts as background (objects: 1)."
    ]


@pytest.mark.parametrize(
    ("size", "hint"),
    [
        (0.5, "With all extents scaled by 2 it would give 1.00. Are they half extents?"),
        (2.0, "With all extents scaled by 0.5 it would give 1.00. Are they doubled?"),
    ],
)
def test_extents_of_a_wrong_scale_are_told(size: float, hint: str) -> None:
    assert hinted(found("chair", size=size), found("tv", x=4.0, size=size)) == [hint]


def test_boxes_far_from_all_that_is_true_are_told() -> None:
    (hint,) = hinted(found("chair"), found("tv", x=40.0))

    assert hint.startswith("Boxes that lie more than 1 m outside the bounds of all true objects: 1 of 2.")


def test_a_box_that_swallows_two_objects_is_told() -> None:
    (hint,) = hinted(found("chair", x=2.0, size=5.0))

    assert hint == "The box of estimate 0 holds several true objects that have no other: 'chair' (0), 'tv' (1)."


@given(true_objects)
@relaxed
def test_nothing_is_hinted_at_where_nothing_is_wrong(things: Objects) -> None:
    names = ["chair", "table", "tv"]
    weights = [[float(item["class"] == name) for name in [*names, "background"]] for item in things]
    objects = [
        {"label_probs": row, "centroid": item["centroid"], "extent": item["extent"]}
        for row, item in zip(weights, things, strict=True)
    ]

    hints = explain(semantic_map(*objects), [truth(*things)])["diagnosis"]["hints"]
    assert hints == ([] if things else ["The map is empty."])
