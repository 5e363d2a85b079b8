"""Boxes of many views, with properties that hold for any of them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.api import BenchbotError
from benchbot.mapping import MappedObject, fuse, iou, merged, non_maximum_suppression
from benchbot_eval_omq.boxes import Boxes, intersections_over_unions

LABELS = ("chair", "table", "background")


@st.composite
def objects(draw: st.DrawFn) -> MappedObject:
    """Return an object on a coarse raster, so that boxes often touch, coincide or are flat."""
    lower = np.array([draw(st.integers(-3, 3)) for _ in range(3)], np.float32) / 2
    size = np.array([draw(st.integers(0, 3)) for _ in range(3)], np.float32) / 2
    weights = [draw(st.integers(1, 9)) for _ in LABELS]
    label_probs = {name: weight / sum(weights) for name, weight in zip(LABELS, weights, strict=True)}
    return MappedObject(label_probs, lower, lower + size, draw(st.integers(1, 50)))


Maps = st.lists(objects(), max_size=10)


def told(found: list[MappedObject]) -> list[tuple[object, ...]]:
    """Return what objects are, to the last bit."""
    return [(dict(item.label_probs), item.lower.tolist(), item.upper.tolist(), item.points) for item in found]


@given(Maps, Maps)
def test_iou_is_that_of_object_map_quality(ours: list[MappedObject], others: list[MappedObject]) -> None:
    def boxes(found: list[MappedObject]) -> Boxes:
        corners = [
            np.array([getattr(item, name) for item in found], float).reshape(-1, 3) for name in ("lower", "upper")
        ]
        return Boxes(*corners)

    one, two = boxes(ours), boxes(others)
    expected = intersections_over_unions(one.intersections(two), one.volumes, two.volumes)
    np.testing.assert_allclose(iou(ours, others), expected, atol=1e-12)


@given(Maps)
def test_iou_is_symmetric_and_one_with_oneself(found: list[MappedObject]) -> None:
    table = iou(found, found)
    solid = np.array([bool((item.upper > item.lower).all()) for item in found], bool)

    np.testing.assert_array_equal(table, table.T)
    np.testing.assert_allclose(np.diag(table), solid)
    assert ((table >= 0) & (table <= 1)).all()


@given(Maps, st.randoms(use_true_random=False))
def test_fusing_is_the_same_in_any_order_and_again(found: list[MappedObject], chance: st.DataObject) -> None:
    fused = fuse(found)
    shuffled = found.copy()
    chance.shuffle(shuffled)  # type: ignore[attr-defined]

    assert told(fuse(shuffled)) == told(fused)
    assert told(fuse(fused)) == told(fused)


@given(Maps)
def test_fusing_makes_nothing_of_nothing(found: list[MappedObject]) -> None:
    fused = fuse(found)

    assert len(fused) <= len(found)
    assert sum(item.points for item in fused) == sum(item.points for item in found)
    for item in found:
        assert any((one.lower <= item.lower).all() and (item.upper <= one.upper).all() for one in fused)
    for item in fused:
        assert item.lower.min() >= -1.5
        assert item.upper.max() <= 3.0
        assert math.isclose(sum(item.label_probs.values()), 1.0)


def test_views_of_one_object_are_fused_and_those_of_two_are_not() -> None:
    left = MappedObject.around([[0.0, 0.0, 0.0], [0.5, 0.5, 1.0]], {"chair": 1.0})
    right = MappedObject.around([[0.1, 0.0, 0.0], [0.6, 0.5, 1.0]], {"chair": 0.6, "table": 0.4})
    beside = MappedObject.around([[1.5, 0.0, 0.0], [2.0, 0.5, 1.0]], {"chair": 1.0})
    on_top = MappedObject.around([[0.0, 0.0, 0.0], [0.5, 0.5, 1.0]], {"table": 1.0})
    fused = fuse([left, right, beside, on_top])

    assert [item.label for item in fused] == ["chair", "chair", "table"]
    np.testing.assert_allclose(fused[0].upper - fused[0].lower, [0.6, 0.5, 1])
    assert fused[0].label_probs == {"chair": 0.8, "table": 0.2}


def test_a_box_around_nothing_is_told() -> None:
    with pytest.raises(BenchbotError, match="An object has no points"):
        MappedObject.around(np.zeros((0, 3)), {"chair": 1.0})


def test_the_mean_of_class_probabilities_is_weighted_by_points() -> None:
    point = np.zeros(3, np.float32)
    near = MappedObject({"cup": 0.9, "bowl": 0.1}, point, point, points=30)
    far = MappedObject({"bowl": 1.0}, point, point, points=10)

    assert merged([near, far]).label_probs == merged([far, near]).label_probs
    assert math.isclose(merged([near, far]).label_probs["cup"], 0.675)


@given(Maps, st.randoms(use_true_random=False), st.booleans(), st.sampled_from([0.0, 0.3, 0.5]))
def test_suppression_keeps_the_best_in_any_order(
    found: list[MappedObject], chance: st.DataObject, across: bool, largest_iou: float
) -> None:
    kept = non_maximum_suppression(found, largest_iou, across_classes=across)
    shuffled = found.copy()
    chance.shuffle(shuffled)  # type: ignore[attr-defined]

    def doubles(one: MappedObject, other: MappedObject) -> bool:
        return bool((across or one.label == other.label) and iou([one], [other])[0, 0] > largest_iou)

    assert told(non_maximum_suppression(shuffled, largest_iou, across_classes=across)) == told(kept)
    assert [item.score for item in kept] == sorted((item.score for item in kept), reverse=True)
    assert not found or kept[0].score == max(item.score for item in found)
    assert not any(doubles(one, other) for i, one in enumerate(kept) for other in kept[:i])
    assert all(any(item is one or (doubles(item, one) and one.score >= item.score) for one in kept) for item in found)


@settings(max_examples=20)
@given(objects())
def test_a_label_is_the_most_likely_class_and_a_score_never_that_of_the_background(item: MappedObject) -> None:
    assert item.label_probs[item.label] == max(item.label_probs.values())
    assert item.score == max(item.label_probs["chair"], item.label_probs["table"])
