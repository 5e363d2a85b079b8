"""Kinds of error of object maps: each fault that was put into a map is found, with what it costs."""

from itertools import combinations
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugin import GroundTruth, Result
from benchbot_eval_omq import omq
from benchbot_eval_omq.diagnosis import KINDS, Diagnosis, diagnose
from benchbot_eval_omq.explanation import explain
from benchbot_eval_omq.qualities import qualities
from plugins.eval_omq.tests.omq_maps import CLASSES, change_map, found, semantic_map, thing, truth
from plugins.eval_omq.tests.test_omq_properties import Objects, estimates, relaxed, true_objects

FAULTS = ("none", "class", "location", "both", "duplicate", "background", "missed")
NAMES = CLASSES[:-1]


def diagnosed(result: Result, *rooms: GroundTruth) -> Diagnosis:
    table = qualities(result, rooms)
    return diagnose(table, omq.matched(table))


def degraded(faults: list[str]) -> tuple[Objects, Objects]:
    """Return true objects in a row, 5 m apart, and a map of them with one fault each."""
    things: Objects = []
    objects: Objects = []
    for place, fault in enumerate(faults):
        x, name, wrong = 5.0 * place, NAMES[place % 3], NAMES[(place + 1) % 3]
        things.append(thing(name, x, size=0.8))
        shift = 0.3 if fault in ("location", "both") else 0.0
        if fault != "missed":
            objects.append(found(wrong if fault in ("class", "both") else name, x + shift, size=0.8))
        if fault == "duplicate":
            objects.append(found(name, x + 0.1, size=0.8))
        if fault == "background":
            objects.append(found(name, x + 2.5, size=0.8))
    return things, objects


@given(st.lists(st.sampled_from(FAULTS), min_size=1, max_size=20))
@relaxed
def test_each_fault_is_found_and_counted(faults: list[str]) -> None:
    things, objects = degraded(faults)

    counts = diagnosed(semantic_map(*objects), truth(*things)).counts()

    assert {kind: counts[kind] for kind in FAULTS[1:]} == {kind: faults.count(kind) for kind in FAULTS[1:]}
    assert counts["state"] == 0


@given(estimates, true_objects, true_objects)
@relaxed
def test_no_fix_lowers_the_score_and_all_together_make_it_perfect(
    objects: Objects, before: Objects, after: Objects
) -> None:
    cases: list[tuple[Result, list[GroundTruth]]] = [
        (semantic_map(*objects), [truth(*before)]),
        (change_map(*objects), [truth(*before), truth(*after)]),
    ]
    for result, rooms in cases:
        diagnosis = diagnosed(result, *rooms)
        score = diagnosis.score()

        assert score == pytest.approx(omq.evaluate(result, rooms)["OMQ"])
        assert all(diagnosis.score([kind]) >= score - 1e-12 for kind in KINDS)
        for pair in combinations(KINDS, 2):
            assert diagnosis.score(pair) >= max(diagnosis.score([kind]) for kind in pair) - 1e-12
        assert diagnosis.score(KINDS) == pytest.approx(1.0 if diagnosis.table.true_objects else 0.0)


@given(estimates, true_objects)
@relaxed
def test_the_confusion_accounts_for_each_object(objects: Objects, things: Objects) -> None:
    diagnosis = diagnosed(semantic_map(*objects), truth(*things))

    confusion = diagnosis.document()["confusion"]
    for row in confusion:
        assert row["missed"] + sum(row["estimated"].values()) == pytest.approx(row["objects"])
    assert sum(row["objects"] for row in confusion if row["truth"]) == len(things)


@given(st.lists(st.sampled_from(FAULTS), min_size=1, max_size=20))
@relaxed
def test_each_object_says_which_error_it_is_and_of_what(faults: list[str]) -> None:
    things, objects = degraded(faults)

    entries = explain(semantic_map(*objects), [truth(*things)])["objects"]

    of_truth = {entry["truth"]: entry for entry in entries if entry["truth"] is not None}
    told = [of_truth[place]["error"] for place in range(len(things))]
    assert told == [None if fault in ("none", "duplicate", "background") else fault for fault in faults]
    extra = [entry for entry in entries if entry["verdict"] == "false_positive"]
    kinds = ("class", "both", "duplicate", "background")
    assert sorted(entry["error"] for entry in extra) == sorted(fault for fault in faults if fault in kinds)
    for entry in extra:  # both sides of a confusion name one another
        other = entry["counterpart"]
        assert (other is None) == (entry["error"] == "background")
        if entry["error"] in ("class", "both"):
            assert of_truth[other]["counterpart"] == entry["proposal"]


def test_right_classes_give_what_wrong_ones_cost() -> None:
    things, objects = degraded(["none", "class"])

    document = diagnosed(semantic_map(*objects), truth(*things)).document()

    assert document["score"] == pytest.approx(1 / 3)
    assert document["errors"] == [{"kind": "class", "count": 1, "gain": pytest.approx(2 / 3)}]
    table: dict[str, Any] = next(row for row in document["confusion"] if row["truth"] == "table")
    assert table == {"truth": "table", "objects": 1, "missed": 0, "estimated": {"tv": 1.0}}


def test_a_wrong_state_is_an_error_of_its_own() -> None:
    result = change_map(found("chair", state_probs=[1.0, 0.0, 0.0]))

    document = diagnosed(result, truth(thing("chair")), truth()).document()

    assert document["errors"] == [{"kind": "state", "count": 1, "gain": 1.0}]
    assert document["states"] == [{"truth": "removed", "objects": 1, "missed": 0, "estimated": {"added": 1.0}}]


def test_what_is_right_but_unsure_is_imprecise() -> None:
    document = diagnosed(semantic_map(found("chair", sure=0.64)), truth(thing("chair"))).document()

    assert document["errors"] == [{"kind": "imprecise", "count": 1, "gain": pytest.approx(0.2)}]


def test_an_empty_map_misses_everything() -> None:
    errors = diagnosed(semantic_map(), truth(thing("chair"))).document()["errors"]

    assert errors == [{"kind": "missed", "count": 1, "gain": 1.0}]
