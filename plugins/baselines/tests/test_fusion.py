"""The map that labelled points of frames add up to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.mapping import MappedObject
from benchbot_baselines import fusion
from benchbot_baselines.fusion import ClassMap
from benchbot_baselines.segmenter import Sighting

CLASSES = ("chair", "cup", "background")
CHAIR, CUP = np.array([0.8, 0.1, 0.1]), np.array([0.1, 0.8, 0.1])


def block(at: tuple[float, float, float], side_m: float, probabilities: np.ndarray, depth_m: float = 1.0) -> Sighting:
    """Return a full cube of points, 1 cm or a tenth of its side apart."""
    steps = np.linspace(0, side_m, 11)
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3) + at
    count = len(points)
    return Sighting(
        points.astype(np.float32),
        np.tile(probabilities, (count, 1)).astype(np.float32),
        np.full(count, depth_m, np.float32),
    )


def found(*seen: Sighting) -> list[MappedObject]:
    made = ClassMap(CLASSES)
    for one in seen:
        made.add(one)
    return made.objects()


def test_an_object_has_the_box_of_its_points_and_the_probabilities_of_all_classes() -> None:
    (cup,) = found(block((1, 2, 0.7), 0.1, CUP))

    np.testing.assert_allclose([cup.lower, cup.upper], [(1, 2, 0.7), (1.1, 2.1, 0.8)], atol=1e-6)
    assert cup.label_probs == pytest.approx(dict(zip(CLASSES, CUP, strict=True)), abs=1e-6)


def test_a_fragment_is_no_chair_but_may_be_a_cup() -> None:
    assert [item.label for item in found(block((0, 0, 0), 0.1, CHAIR), block((1, 0, 0), 0.1, CUP))] == ["cup"]


def test_two_cups_with_a_gap_are_two_and_too_few_points_are_none() -> None:
    cups = block((0, 0, 0), 0.1, CUP), block((0.3, 0, 0), 0.1, CUP)

    assert len(found(*cups)) == 2
    few = Sighting(cups[0].points[:50], cups[0].label_probs[:50], cups[0].depth_m[:50])
    assert found(few) == []


def test_what_is_seen_from_near_counts_more() -> None:
    (item,) = found(block((0, 0, 0), 0.5, CHAIR, depth_m=1.0), block((0, 0, 0), 0.5, CUP, depth_m=4.0))

    # The geometric mean, with the weights 1 and 1/4.
    expected = CHAIR**0.8 * CUP**0.2
    assert item.label_probs == pytest.approx(dict(zip(CLASSES, expected / expected.sum(), strict=True)), abs=1e-5)


def test_nothing_is_seen_in_nothing() -> None:
    empty = np.zeros((0, 3), np.float32)

    assert found() == found(Sighting(empty, empty, np.zeros(0, np.float32))) == []


@given(st.permutations(range(6)), st.integers(0, 3000))
def test_the_order_of_frames_and_when_they_are_sorted_are_of_no_account(order: list[int], waiting: int) -> None:
    frames = [block((0.07 * i, 0, 0), 0.2, CUP if i % 2 else CHAIR, 0.5 + i) for i in range(6)]
    usual = found(*frames)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fusion, "_FEWEST_WAITING", waiting)
        other = found(*(frames[i] for i in order))

    assert [item.points for item in usual] == [item.points for item in other]
    for one, same in zip(usual, other, strict=True):
        np.testing.assert_array_equal([one.lower, one.upper], [same.lower, same.upper])
        assert one.label_probs == pytest.approx(same.label_probs, abs=1e-5)


def test_places_far_from_the_origin_of_the_map_are_like_others() -> None:
    (cup,) = found(block((60_000.0, 0, 0), 0.4, CUP))

    assert cup.points == 11**3
