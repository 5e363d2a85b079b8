import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import stdtrit

from benchbot.core import plugin_manager
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator, Score
from benchbot.evaluation.intervals import Over
from benchbot.plugins.report.comparison import compare
from benchbot.plugins.report.result_sets import ResultSet
from benchbot.plugins.report.significance import sign_flip

Values = Sequence[Sequence[float | None]]


@pytest.fixture(scope="module")
def omq() -> Evaluator:
    evaluator: Evaluator = plugin_manager.load().record("evaluators", "omq")
    return evaluator


def result_set(name: str, values: Values, robot: str = "carter", failure: str = "agent") -> ResultSet:
    """Return a set with a result for each value, None being a failed episode; one list for each place."""
    rows: list[dict[str, Any]] = []
    missing: list[dict[str, Any]] = []
    for place, of_place in enumerate(values):
        for variant, value in enumerate(of_place):
            which = {"source": None, "environment": f"place{place}:{variant}", "seed": 0, "repeat": None}
            if value is None:
                missing.append({**which, "reason": "It failed.", "failure": failure})
            else:
                provenance = {"selection": {"robot": robot, "seed": 0}}
                scores = {"OMQ": value, "avg_label": value / 2}
                rows.append({**which, "scores": scores, "ground_truths": [], "failure": None, "provenance": provenance})
    count = len(rows) + len(missing)
    combined = {key: sum(row["scores"][key] for row in rows) / count for key in ("OMQ", "avg_label")}
    document = {
        "version": 1,
        "method": {"name": "omq", "version": "1.0", "headline": "OMQ"},
        "task_details": {"name": "semantic_slam:passive:ground_truth"},
        "environment_details": [],
        "scores": combined,
        "rows": rows,
        "coverage": {"expected": count, "scored": len(rows), "missing": missing, "skipped": []},
    }
    return ResultSet(name, document)


NEW = [[0.5, 0.6], [0.7, 0.5], [0.4], [0.6, 0.8], [0.55], [0.9]]
OLD = [[0.4, 0.55], [0.6, 0.45], [0.35], [0.45, 0.6], [0.5], [0.7]]


def test_two_sets_by_hand(omq: Evaluator) -> None:
    document = compare([result_set("new", NEW), result_set("old", OLD)], omq)

    found = document["comparisons"][0]
    # Sums of differences by place: 0.15, 0.15, 0.05, 0.35, 0.05, 0.2; 0.95 of 9 pairs. All signs agree: 2 of 64.
    assert found["difference"] == pytest.approx(0.95 / 9)
    assert (found["p"], found["p_holm"], found["arrangements"], found["exact"]) == (2 / 64, 2 / 64, 64, True)
    assert (found["pairs"], found["clusters"], found["verdict"]) == (9, 6, "higher")
    means = [0.075, 0.075, 0.05, 0.175, 0.05, 0.2]
    assert found["standardised"] == pytest.approx(np.mean(means) / np.std(means, ddof=1))
    assert 0 < found["interval"]["low"] < 0.95 / 9 < found["interval"]["high"]
    # The difference without each place in turn gives the jackknife's standard error, on 5 degrees of freedom.
    sums, sizes = np.array([0.15, 0.15, 0.05, 0.35, 0.05, 0.2]), np.array([2, 2, 1, 2, 1, 1])
    without = (0.95 - sums) / (9 - sizes)
    standard_error = np.sqrt(5 / 6 * ((without - 0.95 / 9) ** 2).sum())
    t_of_level, t_of_power = 2.5706, 0.9195
    assert found["minimum_detectable"] == pytest.approx((t_of_level + t_of_power) * standard_error, rel=1e-4)
    assert found["rows"][0] == {
        "pair": "place0:0, seed 0",
        "a": 0.5,
        "b": 0.4,
        "difference": pytest.approx(0.1),
    }
    assert found["sentence"].startswith("new scores higher than old by 0.106 OMQ (95 % interval ")
    assert schema.problems(document, "comparison", Path("comparison.json")) == []


def test_a_set_that_is_lower_throughout_is_lower_whichever_comes_first(omq: Evaluator) -> None:
    (found,) = compare([result_set("old", OLD), result_set("new", NEW)], omq)["comparisons"]

    assert (found["verdict"], found["difference"]) == ("lower", pytest.approx(-0.95 / 9))
    assert found["sentence"].startswith("new scores higher than old by 0.106 OMQ (95 % interval ")


def test_variants_of_five_places_are_no_twentyfive_places(omq: Evaluator) -> None:
    new = [[0.5 + 0.01 * place + 0.02 * variant for variant in range(5)] for place in range(5)]
    old = [[value - 0.1 - 0.01 * place for value in of_place] for place, of_place in enumerate(new)]
    sets = [result_set("new", new), result_set("old", old)]

    over_places = compare(sets, omq)["comparisons"][0]
    over_environments = compare(sets, omq, over=Over.ENVIRONMENTS)["comparisons"][0]

    assert (over_places["p"], over_places["verdict"], over_places["minimum_detectable"]) == (0.0625, "too_few", None)
    assert over_places["interval"]["low"] < over_places["difference"] < over_places["interval"]["high"]
    assert over_environments["verdict"] == "higher"
    assert "25 environments" in over_environments["sentence"]


def test_one_place_has_neither_interval_nor_standard_deviations(omq: Evaluator) -> None:
    found = compare([result_set("new", NEW[:1]), result_set("old", OLD[:1])], omq)["comparisons"][0]

    assert (found["difference"], found["verdict"]) == (pytest.approx(0.075), "too_few")
    assert (found["interval"], found["standardised"], found["minimum_detectable"]) == (None, None, None)


def test_a_failed_episode_is_zero_and_its_class_is_told(omq: Evaluator) -> None:
    failing: Values = [[None, *OLD[0][1:]], *OLD[1:]]

    document = compare([result_set("a", OLD), result_set("b", failing, failure="collision")], omq)

    assert document["comparisons"][0]["difference"] == pytest.approx(0.4 / 9)
    assert document["comparisons"][0]["rows"][0]["b"] == 0.0
    assert document["sets"][1]["failures"] == {"collision": 1}
    assert (document["sets"][1]["scored"], document["sets"][1]["expected"]) == (8, 9)


def test_what_has_no_counterpart_is_listed_and_left_out(omq: Evaluator) -> None:
    document = compare([result_set("a", NEW), result_set("b", OLD[:-1])], omq)

    found = document["comparisons"][0]
    assert found["pairs"] == 8
    assert found["unpaired"] == {"a": ["place5:0, seed 0"], "b": [], "without_score": []}


def test_three_sets_are_compared_each_with_each_and_adjusted(omq: Evaluator) -> None:
    low = [[value - 0.3 for value in of_place] for of_place in OLD]

    document = compare([result_set("new", NEW), result_set("old", OLD), result_set("low", low)], omq)

    assert [(found["a"], found["b"]) for found in document["comparisons"]] == [
        ("new", "old"),
        ("new", "low"),
        ("old", "low"),
    ]
    assert [found["p_holm"] for found in document["comparisons"]] == pytest.approx([6 / 64] * 3)
    assert {found["verdict"] for found in document["comparisons"]} == {"too_few"}


def test_another_score_can_be_compared(omq: Evaluator) -> None:
    sets = [result_set("new", NEW), result_set("old", OLD)]

    assert compare(sets, omq, "avg_label")["comparisons"][0]["difference"] == pytest.approx(0.95 / 18)
    with pytest.raises(BenchbotError, match="'new' has no score 'avg_lable'") as raised:
        compare(sets, omq, "avg_lable")
    assert "Did you mean 'avg_label'?" in raised.value.why


def test_sets_without_a_common_result_cannot_be_compared(omq: Evaluator) -> None:
    other = result_set("other", OLD)
    for row in other.document["rows"]:
        row["seed"] = 5

    with pytest.raises(BenchbotError, match="no result in common") as raised:
        compare([result_set("a", NEW), other], omq)
    assert "place0:0, seed 0" in raised.value.why
    assert compare([result_set("a", NEW), other], omq, ignore_seeds=True)["comparisons"][0]["pairs"] == 9


def test_different_robots_are_told(omq: Evaluator) -> None:
    document = compare([result_set("a", NEW), result_set("b", OLD, robot="turtlebot")], omq)

    assert document["notes"] == ["The robots differ: a on carter; b on turtlebot."]


places = st.lists(st.lists(st.integers(0, 100), min_size=1, max_size=3), min_size=2, max_size=7)


@settings(max_examples=20)
@given(places, st.randoms(use_true_random=False))
def test_swapping_the_sets_turns_the_difference_and_nothing_else(omq: Evaluator, values: Values, random: Any) -> None:
    first = result_set("a", [[(value or 0) / 100 for value in of_place] for of_place in values])
    second = result_set("b", [[random.randint(0, 100) / 100 for _ in of_place] for of_place in values])

    straight = compare([first, second], omq)["comparisons"][0]
    turned = compare([second, first], omq)["comparisons"][0]

    assert turned["difference"] == pytest.approx(-straight["difference"], abs=1e-12)
    assert turned["verdict"] == {"higher": "lower", "lower": "higher"}.get(straight["verdict"], straight["verdict"])
    assert turned["p"] == straight["p"]
    assert 0 < straight["p"] <= 1
    assert (turned["interval"] is None) == (straight["interval"] is None)
    if straight["interval"] is not None:
        assert turned["interval"]["low"] == pytest.approx(-straight["interval"]["high"], abs=1e-9)


@settings(max_examples=20)
@given(places)
def test_a_set_is_equal_to_itself(omq: Evaluator, values: Values) -> None:
    a, b = (result_set(name, [[(value or 0) / 100 for value in of_place] for of_place in values]) for name in "ab")

    found = compare([a, b], omq)["comparisons"][0]

    assert (found["difference"], found["p"], found["verdict"]) == (0.0, 1.0, "equal")
    assert found["interval"] is found["standardised"] is None


@settings(max_examples=20)
@given(places, st.integers(1, 50))
def test_adding_a_constant_to_one_set_adds_it_to_the_difference(omq: Evaluator, values: Values, added: int) -> None:
    base = [[(value or 0) / 200 for value in of_place] for of_place in values]
    raised = [[value + added / 200 for value in of_place] for of_place in base]

    found = compare([result_set("a", raised), result_set("b", base)], omq)["comparisons"][0]

    assert found["difference"] == pytest.approx(added / 200)
    assert found["p"] == max(2.0 ** (1 - len(values)), 2.0**-20)


def test_the_minimum_detectable_effect_is_found_four_times_out_of_five() -> None:
    random = np.random.default_rng(0)
    count = 12
    effect = (stdtrit(count - 1, 0.975) + stdtrit(count - 1, 0.8)) / math.sqrt(count)

    found = [sign_flip(list(random.normal(effect, 1, count))).p < 0.05 for _ in range(600)]

    assert 0.75 < np.mean(found) < 0.85


def test_sets_under_other_settings_are_compared_only_when_asked_and_it_is_noted(omq: Evaluator) -> None:
    night = result_set("night", OLD)
    for item in [*night.document["rows"], *night.document["coverage"]["missing"]]:
        item["settings"] = {"lighting.time": "21:30"}

    with pytest.raises(BenchbotError, match="no result in common") as caught:
        compare([result_set("day", NEW), night], omq)
    document = compare([result_set("day", NEW), night], omq, ignore_settings=True)

    assert "--ignore-settings" in caught.value.fix
    assert document["comparisons"][0]["pairs"] == 9
    assert document["notes"] == ["The settings differ (--set): day with none; night with lighting.time=21:30."]


@pytest.mark.parametrize(("lower_is_better", "better"), [(False, "new"), (True, "old"), (None, None)])
def test_which_set_is_better_depends_on_the_score(omq: Evaluator, lower_is_better: bool | None, better: str) -> None:
    read_so = replace(omq, scores={"OMQ": Score(lower_is_better=lower_is_better)})

    document = compare([result_set("new", NEW), result_set("old", OLD)], read_so)

    schema.check(document, "comparison", Path("comparison.json"))
    found = document["comparisons"][0]
    assert (document["lower_is_better"], found["better"], found["verdict"]) == (lower_is_better, better, "higher")
    assert found["sentence"].startswith("old is better than new" if lower_is_better else "new scores higher than old")
