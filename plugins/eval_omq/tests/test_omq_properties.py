"""What holds of OMQ for every map."""

from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_eval_omq import omq
from plugins.eval_omq.tests.omq_maps import CLASSES, change_map, semantic_map, truth

Objects = list[dict[str, Any]]

# How long a score takes says nothing of whether it is right.
relaxed = settings(deadline=None)

place: st.SearchStrategy[float] = st.integers(-30, 30).map(lambda tenths: tenths / 10)
size: st.SearchStrategy[float] = st.integers(1, 20).map(lambda tenths: tenths / 10)
box: st.SearchStrategy[dict[str, Any]] = st.fixed_dictionaries(
    {"centroid": st.tuples(place, place, place).map(list), "extent": st.tuples(size, size, size).map(list)}
)
weights: st.SearchStrategy[list[float]] = st.lists(st.floats(0, 1), min_size=len(CLASSES), max_size=len(CLASSES))
states: st.SearchStrategy[list[float]] = st.lists(st.floats(0, 1), min_size=3, max_size=3)
true_objects: st.SearchStrategy[Objects] = st.lists(
    st.builds(
        lambda name, group, where: {"class": name, "isgroup": group} | where,
        st.sampled_from(CLASSES[:-1]),
        st.booleans(),
        box,
    ),
    max_size=6,
)
estimates: st.SearchStrategy[Objects] = st.lists(
    st.builds(lambda label, state, where: {"label_probs": label, "state_probs": state} | where, weights, states, box),
    max_size=6,
)


def scored(objects: Objects, before: Objects, after: Objects | None = None) -> dict[str, float]:
    if after is None:
        return omq.evaluate(semantic_map(*objects), [truth(*before)])
    return omq.evaluate(change_map(*objects), [truth(*before), truth(*after)])


def perfect(objects: Objects) -> Objects:
    one_hot = [[float(name == item["class"]) for name in CLASSES] for item in objects]
    return [
        {"label_probs": label, "centroid": item["centroid"], "extent": item["extent"]}
        for label, item in zip(one_hot, objects, strict=True)
    ]


@relaxed
@given(estimates, true_objects, true_objects)
def test_every_score_is_between_zero_and_one(objects: Objects, before: Objects, after: Objects) -> None:
    for scores in (scored(objects, before), scored(objects, before, after)):
        assert all(0.0 <= score <= 1.0 for score in scores.values())


@relaxed
@given(true_objects.filter(bool))
def test_a_perfect_map_scores_one(objects: Objects) -> None:
    # Where true objects coincide the assignment among them is free, but the best one is perfect all the same.
    assert scored(perfect(objects), objects) == pytest.approx(dict.fromkeys(scored([], []), 1.0))


@relaxed
@given(true_objects)
def test_an_empty_map_scores_zero(objects: Objects) -> None:
    assert scored([], objects)["OMQ"] == 0.0


@relaxed
@given(estimates, true_objects, st.randoms(use_true_random=False))
def test_the_order_of_objects_is_of_no_account(objects: Objects, room: Objects, random: Random) -> None:
    mixed_objects, mixed_room = random.sample(objects, len(objects)), random.sample(room, len(room))

    # Pairs of equal quality may be exchanged for one another, so only their sum is determined.
    first, second = (
        omq.compare(semantic_map(*a), [truth(*b)]) for a, b in ((objects, room), (mixed_objects, mixed_room))
    )
    assert sum(first.pairwise) == pytest.approx(sum(second.pairwise))


@relaxed
@given(estimates, true_objects, place)
def test_where_the_origin_lies_is_of_no_account(objects: Objects, room: Objects, shift: float) -> None:
    def moved(items: Objects) -> Objects:
        return [item | {"centroid": [value + 64 * shift for value in item["centroid"]]} for item in items]

    still, elsewhere = (
        omq.compare(semantic_map(*a), [truth(*b)]) for a, b in ((objects, room), (moved(objects), moved(room)))
    )
    assert sum(still.pairwise) == pytest.approx(sum(elsewhere.pairwise), abs=1e-5)


@relaxed
@given(estimates, true_objects, weights)
def test_an_object_where_nothing_is_never_raises_the_score(objects: Objects, room: Objects, label: list[float]) -> None:
    nowhere = {"label_probs": label, "state_probs": [1.0, 0.0, 0.0], "centroid": [99.0] * 3, "extent": [1.0] * 3}

    assert scored([*objects, nowhere], room)["OMQ"] <= scored(objects, room)["OMQ"] + 1e-12


@relaxed
@given(true_objects.filter(bool), st.data())
def test_being_surer_of_the_right_class_never_lowers_the_score(room: Objects, data: st.DataObject) -> None:
    objects = perfect(room)
    index = data.draw(st.integers(0, len(objects) - 1))
    doubt = data.draw(st.floats(0, 1))
    unsure = [*objects]
    unsure[index] = objects[index] | {"label_probs": [weight * doubt for weight in objects[index]["label_probs"]]}

    assert scored(unsure, room)["OMQ"] <= scored(objects, room)["OMQ"] + 1e-12
