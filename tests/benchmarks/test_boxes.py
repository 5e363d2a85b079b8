"""Detections are matched with what is there as COCO's evaluation does."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.boxes import Box, Detection, Truth, area, iou, match, overlap, without_doubles

EDGES = st.integers(0, 40)
BOXES = st.tuples(EDGES, EDGES, st.integers(1, 20), st.integers(1, 20)).map(
    lambda at: (float(at[0]), float(at[1]), float(at[0] + at[2]), float(at[1] + at[3]))
)
CLASSES = st.sampled_from(["cup", "chair"])
TRUTHS = st.lists(st.builds(Truth, CLASSES, st.just(1000), BOXES, st.booleans(), st.booleans()), max_size=8)
DETECTIONS = st.lists(st.builds(Detection, CLASSES, st.floats(0, 1), BOXES), max_size=12)
CUP = Truth("cup", 1000, (0.0, 0.0, 10.0, 10.0))


@given(BOXES, BOXES)
def test_overlap_is_symmetric_and_a_share(one: Box, other: Box) -> None:
    assert iou(one, one) == 1.0
    assert iou(one, other) == iou(other, one)
    assert 0.0 <= iou(one, other) <= 1.0


@given(TRUTHS, DETECTIONS, st.sampled_from([0.3, 0.5]))
def test_who_is_matched_is_counted_of_the_class_and_overlaps(
    truths: list[Truth], detections: list[Detection], least: float
) -> None:
    matches = match(truths, detections, least)
    assert len(set(matches.found.values())) == len(matches.found)
    assert not set(matches.found.values()) & set(matches.wrong)
    for number, place in matches.found.items():
        truth, detection = truths[number], detections[place]
        assert truth.is_counted
        assert truth.class_name == detection.class_name
        assert overlap(truth, detection) >= least
    for place in matches.wrong:
        same = [truth for truth in truths if truth.class_name == detections[place].class_name]
        groups = [truth for truth in same if truth.by_part or not truth.is_counted]
        assert all(overlap(truth, detections[place]) < least for truth in groups)


@given(TRUTHS)
def test_a_detector_that_knows_the_truth_misses_nothing(truths: list[Truth]) -> None:
    apart = [
        replace(truth, box=(100 * number + truth.box[0], *truth.box[1:2], 100 * number + truth.box[2], truth.box[3]))
        for number, truth in enumerate(truths)
    ]
    matches = match(apart, [Detection(truth.class_name, 1.0, truth.box) for truth in apart], 0.99)
    assert set(matches.found) == {number for number, truth in enumerate(apart) if truth.is_counted}
    assert matches.wrong == ()


def test_the_surest_detection_takes_an_object_and_a_second_one_is_wrong() -> None:
    surer, other = Detection("cup", 0.9, (0, 0, 10, 9)), Detection("cup", 0.8, CUP.box)
    matches = match([CUP], [other, surer], 0.5)
    assert matches.found == {0: 1}
    assert matches.wrong == (0,)


def test_what_need_not_be_found_may_be() -> None:
    cut = replace(CUP, is_counted=False)
    matches = match([cut], [Detection("cup", 0.9, CUP.box)], 0.5)
    assert matches.found == {}
    assert matches.wrong == ()


def test_a_group_is_found_by_one_of_its_things_and_the_others_are_not_wrong() -> None:
    stack = replace(CUP, by_part=True)
    things = [
        Detection("cup", score, (0.0, top, 10.0, top + 2.0)) for score, top in ((0.5, 0.0), (0.9, 4.0), (0.4, 9.0))
    ]
    matches = match([stack], [*things, Detection("cup", 0.3, (0.0, 9.5, 10.0, 20.0))], 0.5)
    assert matches.found == {0: 1}
    assert matches.wrong == (3,)


@given(DETECTIONS)
def test_of_doubles_the_surest_stays(detections: list[Detection]) -> None:
    kept = without_doubles(detections)
    assert all(any(each == other for other in detections) for each in kept)
    for each in detections:
        assert any(
            other.score >= each.score and other.class_name == each.class_name and iou(other.box, each.box) > 0.5
            for other in kept
        )


def test_a_box_without_pixels_has_no_area() -> None:
    assert area((5.0, 0.0, 3.0, 9.0)) == 0.0
    assert iou((5.0, 0.0, 3.0, 9.0), (5.0, 0.0, 3.0, 9.0)) == pytest.approx(0.0)
