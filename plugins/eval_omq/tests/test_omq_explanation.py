"""What OMQ says of each object."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given

from benchbot.core.declarations import schema
from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq import omq
from benchbot_eval_omq.explanation import explain
from plugins.eval_omq.tests.omq_maps import change_map, found, semantic_map, thing, truth
from plugins.eval_omq.tests.test_omq_golden import CASES
from plugins.eval_omq.tests.test_omq_properties import Objects, estimates, true_objects


def explained(result: Result, *rooms: GroundTruth) -> list[dict[str, Any]]:
    objects: list[dict[str, Any]] = explain(result, rooms)["objects"]
    entry = {"source": None, "environment": "room:1", "seed": None, "objects": objects}
    document = {"version": 1, "method": {"name": "omq", "version": "1.0"}, "results": [entry]}
    assert schema.problems(document, "explanation", Path("explanation.json")) == []
    return objects


def test_a_match_names_both_objects_and_its_factors() -> None:
    (item,) = explained(semantic_map(found("chair", x=1 / 3, sure=0.5)), truth(thing("chair")))

    assert (item["verdict"], item["proposal"], item["truth"], item["scene"]) == ("match", 0, 0, "room:1")
    assert (item["label"], item["truth_label"]) == ("chair", "chair")
    assert item["truth_centroid"] == [0.0, 0.0, 0.0]
    assert item["factors"] == pytest.approx({"overall": 0.5, "spatial": 0.5, "label": 0.5})
    assert item["why"] == (
        "Taken for it: the boxes overlap by 0.50 (IoU), and the class 'chair' has the probability 0.50."
    )


@pytest.mark.parametrize(("size", "hinted"), [(0.5, True), (0.47, True), (1.0, False), (0.7, False)])
def test_extents_that_are_half_of_a_length_are_told(size: float, hinted: bool) -> None:
    (item,) = explained(semantic_map(found("chair", size=size)), truth(thing("chair")))

    assert ("an extent is a full length, not half of one" in item["why"]) == hinted


@pytest.mark.parametrize(
    ("estimates", "why"),
    [
        ([], "The map is empty."),
        ([found("chair", x=9.0)], "No estimate overlaps it."),
        ([found("tv", x=0.5)], "Estimate 0 overlaps it most (IoU 0.33), but gives the class 'chair' no probability."),
    ],
)
def test_a_missed_object_says_why(estimates: Objects, why: str) -> None:
    missed = explained(semantic_map(*estimates), truth(thing("chair")))[0]

    assert (missed["verdict"], missed["proposal"], missed["centroid"]) == ("false_negative", None, None)
    assert missed["why"] == why


def test_of_two_objects_for_one_estimate_the_worse_one_says_which_went_before_it() -> None:
    room = truth(thing("chair"), thing("chair", x=0.5))

    missed, matched = explained(semantic_map(found("chair", x=0.4)), room)

    assert (missed["verdict"], matched["verdict"]) == ("false_negative", "match")
    assert missed["why"] == "Estimate 0 fits it best, but is taken for the true 'chair' (1)."


def test_a_false_positive_says_why_and_what_it_costs() -> None:
    lonely, doubled, wrong = explained(
        semantic_map(found("chair"), found("tv", x=9.0, sure=0.25), found("chair", x=0.5), found("tv", x=0.5)),
        truth(thing("chair")),
    )[1:]

    assert {item["verdict"] for item in (lonely, doubled, wrong)} == {"false_positive"}
    assert lonely["why"] == "It overlaps no true object. It costs 0.25."
    assert lonely["factors"] == {"overall": 0.0, "spatial": 0.0, "label": 0.0, "fp_cost": 0.25}
    assert doubled["why"] == "It fits the true 'chair' (0) best, but estimate 0 is taken for that. It costs 1.00."
    assert wrong["why"].startswith("It overlaps the true 'chair' (0) most (IoU 0.33), but gives the class 'chair' no")


def test_a_part_of_a_group_counts_neither_for_nor_against() -> None:
    group = truth(thing("chair", size=2.0, isgroup=True))

    _, part = explained(semantic_map(found("chair", size=2.0), found("chair", x=-0.4)), group)

    assert (part["verdict"], part["proposal"], part["truth"]) == ("ignored", 1, 0)
    assert part["why"] == "A part of the true 'chair' (0), which is a group: it counts neither for nor against."


def test_labels_are_told_with_their_synonyms_resolved() -> None:
    room = truth(thing("Seat"), synonyms={"seat": "stool", "stool": "chair", "sessel": "chair"})
    result = semantic_map(found("chair"), class_list=["Sessel", "table", "tv", "background"])

    (item,) = explained(result, room)

    assert (item["label"], item["truth_label"]) == ("chair", "chair")


def test_changes_are_told_by_scene_and_state() -> None:
    before = truth(thing("tv", x=5.0), thing("chair"))
    after = truth(thing("tv", x=5.0), thing("table", x=9.0)) | {"environment": {"name": "room", "variant": 2}}
    result = change_map(
        found("chair", state_probs=[0.0, 1.0, 0.0]),
        found("table", x=9.0, state_probs=[0.0, 1.0, 0.0]),
        found("tv", x=20.0, state_probs=[0.5, 0.0, 0.5]),
    )

    gone, come, wrong, nothing = explained(result, before, after)

    assert (gone["verdict"], gone["scene"], gone["truth"], gone["factors"]["state"]) == ("match", "room:1", 1, 1.0)
    assert gone["why"].endswith("the state 'removed' 1.00.")
    assert (come["verdict"], come["scene"], come["truth"]) == ("false_negative", "room:2", 1)
    assert come["why"] == "Estimate 1 overlaps it most (IoU 1.00), but gives the state 'added' no probability."
    assert (wrong["verdict"], wrong["scene"]) == ("false_positive", "room:1")
    assert wrong["why"].startswith("It overlaps the true 'table' (1 of room:2) most")
    assert (nothing["scene"], nothing["factors"]["fp_cost"]) == ("room:2", pytest.approx(0.5**0.5))
    assert nothing["why"] == "It overlaps no object that has changed. It costs 0.71."


@pytest.mark.parametrize("case", CASES, ids=range(len(CASES)))
def test_verdicts_agree_with_the_published_counts(case: dict[str, Any]) -> None:
    items = explained(case["result"], *case["ground_truths"])

    verdicts = [item["verdict"] for item in items]
    assert verdicts.count("match") == case["raw"]["TP"]
    assert verdicts.count("false_negative") == case["raw"]["FN"]
    assert verdicts.count("false_positive") == case["raw"]["FP"]
    assert sum(item["factors"].get("fp_cost", 0.0) for item in items) == pytest.approx(case["raw"]["fp_cost"], abs=1e-9)


@given(estimates, true_objects, true_objects)
def test_the_score_can_be_worked_out_from_its_explanation(objects: Objects, before: Objects, after: Objects) -> None:
    result, rooms = change_map(*objects), [truth(*before), truth(*after)]

    items = explained(result, *rooms)

    matches = [item["factors"]["overall"] for item in items if item["verdict"] == "match"]
    missed = sum(item["verdict"] == "false_negative" for item in items)
    weight = len(matches) + missed + sum(item["factors"].get("fp_cost", 0.0) for item in items)
    assert omq.evaluate(result, rooms)["OMQ"] == pytest.approx(sum(matches) / weight if weight else 0.0)
    assert sorted(item["proposal"] for item in items if item["proposal"] is not None) == list(range(len(objects)))
