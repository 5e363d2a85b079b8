"""What OMQ says about maps that can be judged by eye, and about those that break the rules."""

from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq import omq
from plugins.eval_omq.tests.omq_maps import change_map, found, semantic_map, thing, truth

ADDED: dict[str, Any] = {"state_probs": [1.0, 0.0, 0.0]}
REMOVED: dict[str, Any] = {"state_probs": [0.0, 1.0, 0.0]}


def test_an_object_at_its_place_scores_one() -> None:
    scores = omq.evaluate(semantic_map(found("chair")), [truth(thing("chair"))])

    assert set(scores.values()) == {1.0}


def test_half_the_overlap_and_half_the_label_give_half() -> None:
    # IoU of unit cubes shifted by 1/3 is (2/3) / (4/3) = 1/2; sqrt(1/2 * 1/2) = 1/2.
    scores = omq.evaluate(semantic_map(found("chair", x=1 / 3, sure=0.5)), [truth(thing("chair"))])

    assert scores["OMQ"] == pytest.approx(0.5)
    assert scores["avg_spatial"] == pytest.approx(0.5)
    assert scores["avg_label"] == pytest.approx(0.5)


def test_a_false_positive_costs_what_it_claims() -> None:
    scores = omq.evaluate(semantic_map(found("chair"), found("tv", x=9.0, sure=0.25)), [truth(thing("chair"))])

    assert scores["OMQ"] == pytest.approx(1 / 1.25)
    assert scores["avg_fp_quality"] == pytest.approx(0.75)


def test_a_missed_object_costs_one() -> None:
    scores = omq.evaluate(semantic_map(found("chair")), [truth(thing("chair"), thing("tv", x=9.0))])

    assert scores["OMQ"] == pytest.approx(1 / 2)


def test_an_empty_map_of_a_furnished_room_scores_nothing() -> None:
    scores = omq.evaluate(semantic_map(), [truth(thing("chair"))])

    assert scores["OMQ"] == 0.0
    assert scores["avg_fp_quality"] == 1.0


def test_the_assignment_is_the_best_of_all_and_not_the_first() -> None:
    # Greedily, the estimate at 0.3 would take the chair at 0.4 and leave the one at 0 to nobody.
    room = truth(thing("chair", x=0.0), thing("chair", x=0.4))
    scores = omq.evaluate(semantic_map(found("chair", x=0.3), found("chair", x=0.5)), [room])

    assert scores["OMQ"] > 0.6
    assert len(omq.compare(semantic_map(found("chair", x=0.3), found("chair", x=0.5)), [room]).pairs) == 2


def test_parts_of_a_group_are_neither_hits_nor_false_positives() -> None:
    group = truth(thing("chair", size=2.0, isgroup=True))
    parts = [found("chair", x=-0.4), found("chair", x=0.4, size=0.5)]

    scores = omq.evaluate(semantic_map(found("chair", size=2.0), *parts), [group])

    assert scores["OMQ"] == 1.0


def test_a_part_of_another_class_than_its_group_is_a_false_positive() -> None:
    group = truth(thing("chair", size=2.0, isgroup=True))
    part = found("tv") | {"label_probs": [0.4, 0.0, 0.6, 0.0]}

    scores = omq.evaluate(semantic_map(found("chair", size=2.0), part), [group])

    assert scores["OMQ"] == pytest.approx(1 / 1.6)


def test_synonyms_are_followed_to_their_end() -> None:
    room = truth(thing("diningtable"), synonyms={"diningtable": "dining table", "dining table": "Table"})
    result = semantic_map(class_list=["chair", "DiningTable", "tv", "background"])
    result["results"]["objects"].append(found("table"))

    assert omq.evaluate(result, [room])["OMQ"] == 1.0


def test_synonyms_in_a_circle_end_as_background() -> None:
    room = truth(thing("chair"), synonyms={"a": "b", "b": "a"})
    result = semantic_map(found("table"), class_list=["chair", "a", "tv", "background"])

    assert omq.evaluate(result, [room])["OMQ"] == 0.0


def test_a_ground_truth_without_synonyms_and_class_list_uses_its_environment() -> None:
    room = truth(thing("chair"))
    room["ground_truth"] = {"objects": room["ground_truth"]["objects"]}

    assert omq.evaluate(semantic_map(found("chair")), [room])["OMQ"] == 1.0


def test_changes_are_what_only_one_of_the_scenes_has() -> None:
    before = truth(thing("chair"), thing("tv", x=5.0))
    after = truth(thing("chair"), thing("table", x=9.0))

    scores = omq.evaluate(change_map(found("tv", x=5.0, **REMOVED), found("table", x=9.0, **ADDED)), [before, after])

    assert set(scores.values()) == {1.0}


def test_a_moved_object_was_removed_and_added() -> None:
    before, after = truth(thing("chair", x=0.0)), truth(thing("chair", x=5.0))

    scores = omq.evaluate(change_map(found("chair", x=0.0, **REMOVED), found("chair", x=5.0, **ADDED)), [before, after])

    assert scores["OMQ"] == 1.0


def test_a_state_counts_as_a_third_of_the_quality() -> None:
    before, after = truth(thing("chair")), truth()
    unsure = found("chair", state_probs=[0.0, 0.125, 0.875])

    scores = omq.evaluate(change_map(unsure), [before, after])

    assert scores["OMQ"] == pytest.approx(0.5)
    assert scores["avg_state_quality"] == pytest.approx(0.125)


def test_states_are_told_by_the_format_and_not_by_the_name_of_the_task() -> None:
    with pytest.raises(BenchbotError, match="too few ground truths"):
        omq.evaluate(change_map(), [truth()])


def test_missing_results_count_as_zero_in_the_mean() -> None:
    assert omq.combine([{"OMQ": 0.5, "avg_fp_quality": 1.0}, {}])["OMQ"] == 0.25
    assert set(omq.combine([]).values()) == {0.0}


@pytest.mark.parametrize(
    ("result", "place"),
    [
        (semantic_map(found("chair", size=-1.0)), r"results.objects\[0\].extent\[0\]: must be from 0"),
        (semantic_map(found("chair", x=float("nan"))), r"results.objects\[0\].centroid\[0\].* NaN"),
        (semantic_map(found("chair") | {"label_probs": [1.0]}), r"label_probs: 1 numbers, class_list has 4"),
        (semantic_map(class_list=None), "results.class_list: must be a list"),
        (semantic_map() | {"results": {"objects": []}}, "results.class_list: is missing"),
        (change_map(found("chair")), r"results.objects\[0\].state_probs: is missing"),
        (semantic_map() | {"task_details": {"results_format": "poem"}}, "OMQ reads: object_map"),
    ],
)
def test_a_result_that_breaks_its_format_is_told_where(result: Result, place: str) -> None:
    with pytest.raises(BenchbotError, match=place):
        omq.evaluate(result, [truth(), truth()])


@pytest.mark.parametrize(
    ("room", "place"),
    [
        (truth(thing("unicorn")), "'unicorn' is neither in its class_list nor a synonym"),
        (truth(thing("chair", size=-1.0)), r"ground_truth.objects\[0\].extent"),
        (truth(class_list=None) | {"environment": {"name": "bare", "variant": 1}}, "class_list"),
    ],
)
def test_a_broken_ground_truth_is_told_where(room: GroundTruth, place: str) -> None:
    with pytest.raises(BenchbotError, match=place):
        omq.evaluate(semantic_map(found("chair")), [room])


def test_every_score_is_a_share_of_which_more_is_better() -> None:
    method = load().record("evaluators", "omq")

    names = set(omq.evaluate(change_map(), [truth(), truth()]))
    assert names == set(method.scores)
    assert {(score.lower_is_better, score.least, score.greatest) for score in method.scores.values()} == {(False, 0, 1)}
