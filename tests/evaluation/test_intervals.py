import math
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core import plugin_manager
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.records import Evaluator, Score
from benchbot.evaluation import evaluate_files, intervals
from benchbot.evaluation.intervals import Over, of_rows
from tests.made_results import Make, Save, chair, ground_truth

Rows = list[dict[str, Any]]
NO_NUMBERS = {"seed": None, "episode": None, "repeat": None}


def rows_of(values: Sequence[Sequence[float | None]], name: str = "score") -> Rows:
    """Return a row for each value, None being a missing result; one list for each place."""
    return [
        {
            "environment": f"place{place}:{variant}",
            **NO_NUMBERS,
            "scores": {} if value is None else {name: value},
        }
        for place, of_place in enumerate(values)
        for variant, value in enumerate(of_place)
    ]


def mean(scores: Sequence[dict[str, float]]) -> dict[str, float]:
    return {"score": math.fsum(score.get("score", 0.0) for score in scores) / len(scores)}


def median(scores: Sequence[dict[str, float]]) -> dict[str, float]:
    return {"score": float(np.median([score["score"] for score in scores]))}


def root_mean_square(scores: Sequence[dict[str, float]]) -> dict[str, float]:
    return {"score": math.sqrt(math.fsum(score["score"] ** 2 for score in scores) / len(scores))}


FIVE = [[0.30, 0.40], [0.55], [0.45, 0.35, 0.50], [0.62, 0.58], [0.20]]


def test_a_score_has_an_interval_over_places() -> None:
    found = of_rows(rows_of(FIVE), mean)

    interval = found["intervals"]["score"]
    assert 0.1 < interval["low"] < mean([row["scores"] for row in rows_of(FIVE)])["score"] < interval["high"] < 0.8
    assert interval["level"] == 0.95
    assert found["statistics"] == {
        "method": "bootstrap-t over places",
        "clusters": 5,
        "draws": 9999,
        "seed": 0,
        "note": None,
    }


def test_it_is_the_same_whatever_the_order_of_rows() -> None:
    rows = rows_of(FIVE)
    found = of_rows(rows, mean)
    random.Random(0).shuffle(rows)

    assert of_rows(rows, mean) == found


def test_a_mean_is_taken_apart_exactly() -> None:
    clusters = intervals.grouped(rows_of(FIVE), lambda row: row["environment"], Over.PLACES)

    found = intervals.linear(clusters, lambda rows: mean([row["scores"] for row in rows]))["score"]

    assert found.sums == pytest.approx([sum(values) for values in FIVE])
    assert found.sizes == pytest.approx([len(values) for values in FIVE])
    assert found.error < 1e-9


def test_the_standard_error_of_equal_clusters_is_that_of_their_means() -> None:
    values = [0.2, 0.5, 0.3, 0.9, 0.6, 0.4]

    found = intervals.linear([[value] for value in values], lambda drawn: {"score": float(np.mean(drawn))})["score"]

    assert found.standard_error == pytest.approx(np.std(values, ddof=1) / math.sqrt(6))


def test_the_interval_of_equal_clusters_is_worked_out_as_in_the_paper() -> None:
    values = np.array([0.2, 0.5, 0.3, 0.9, 0.6, 0.4])
    count, mean_ = len(values), values.mean()
    students = []
    for draw in np.random.default_rng(0).beta(0.5, 1.5, (1500, count)):
        weights = count * draw / draw.sum()
        drawn = (weights * values).mean()
        variance = (weights * (values - drawn) ** 2).sum() / (count - 1)
        students.append((drawn - mean_) / math.sqrt(variance / count))
    below, above = np.quantile(students, [0.025, 0.975])
    standard_error = values.std(ddof=1) / math.sqrt(count)

    found = intervals.linear([[value] for value in values], lambda drawn: {"score": float(np.mean(drawn))})["score"]

    assert intervals.limits(found, draws=1500) == {
        "low": pytest.approx(mean_ - above * standard_error),
        "high": pytest.approx(mean_ - below * standard_error),
        "level": 0.95,
    }


def test_a_score_that_some_draws_leave_undefined_has_no_interval_and_the_others_have() -> None:
    def combine(scores: Sequence[dict[str, float]]) -> dict[str, float]:
        rare = [score["rare"] for score in scores if "rare" in score]
        return ({"rare": math.fsum(rare) / len(rare)} if rare else {}) | mean(scores)

    rows = rows_of([[0.1 * place] for place in range(1, 9)])
    rows[0]["scores"]["rare"] = 0.5

    found = of_rows(rows, combine)

    assert list(found["intervals"]) == ["rare", "score"]
    assert found["intervals"]["rare"] is None
    assert found["intervals"]["score"]["low"] < 0.45 < found["intervals"]["score"]["high"]
    assert found["statistics"]["note"] == "rare: no interval, its summary is not close to a mean."


def test_variants_of_a_place_are_no_places() -> None:
    values = [[base + step for step in (-0.01, 0.0, 0.01, 0.02)] for base in (0.2, 0.4, 0.5, 0.3, 0.7, 0.6)]

    over_places = of_rows(rows_of(values), mean)
    over_environments = of_rows(rows_of(values), mean, over=Over.ENVIRONMENTS)

    def width(found: dict[str, Any]) -> float:
        return float(found["intervals"]["score"]["high"] - found["intervals"]["score"]["low"])

    assert over_places["statistics"]["clusters"] == 6
    assert over_environments["statistics"]["clusters"] == 24
    assert width(over_environments) < 0.6 * width(over_places)


def test_missing_results_are_rows_and_those_of_no_known_environment_are_one_cluster() -> None:
    rows = rows_of([*FIVE, [None, None]])
    unknown: dict[str, Any] = {"environment": None, **NO_NUMBERS, "scores": {}}

    assert of_rows([*rows, unknown, unknown], mean)["statistics"]["clusters"] == 7
    assert of_rows(rows, mean)["intervals"]["score"]["low"] < of_rows(rows_of(FIVE), mean)["intervals"]["score"]["low"]


@pytest.mark.parametrize(("places", "words"), [(1, "of 1 place;"), (4, "of 4 places;")])
def test_few_places_give_no_interval_and_a_reason(places: int, words: str) -> None:
    found = of_rows(rows_of(FIVE[:places]), mean)

    assert found["intervals"] == {"score": None}
    assert words in found["statistics"]["note"]
    assert found["statistics"]["method"] is None


def test_few_places_with_many_variants_are_told_of_the_narrower_question() -> None:
    rows = rows_of(FIVE[2:4])

    assert "--over environments" in of_rows(rows, mean)["statistics"]["note"]
    assert of_rows(rows, mean, over=Over.ENVIRONMENTS)["statistics"]["clusters"] == 5


@pytest.mark.parametrize("value", [0.7, 0.7e-6, 1e6 / 3])
@pytest.mark.parametrize("variants", [1, 3])
def test_equal_places_give_no_interval_and_a_reason(value: float, variants: int) -> None:
    found = of_rows(rows_of([[value] * (variants + place % 2) for place in range(8)]), mean)

    assert found["intervals"] == {"score": None}
    assert found["statistics"]["note"] == "score: no interval, all places give the same."


def test_a_summary_that_is_nearly_a_mean_has_an_interval_and_a_median_has_none() -> None:
    values = np.random.default_rng(0).uniform(0.1, 2.0, (12, 2)).tolist()

    assert of_rows(rows_of(values), root_mean_square)["intervals"]["score"]["low"] > 0.8
    found = of_rows(rows_of(values), median)
    assert found["intervals"] == {"score": None}
    assert "not close to a mean" in found["statistics"]["note"]


def test_the_method_that_makes_the_number_makes_its_interval() -> None:
    omq: Evaluator = plugin_manager.load().record("evaluators", "omq")
    rows = rows_of(FIVE, name="OMQ")

    found = of_rows(rows, omq.combine)

    assert found["intervals"]["OMQ"] is not None
    assert found["intervals"]["avg_label"] is None


@pytest.mark.parametrize(
    ("values", "bounds"),
    [([0.0, 1.0], (0, 1)), ([0.2, 3.0], (0, math.inf)), ([-0.1, 0.2], (-math.inf, math.inf)), ([], (0, 1))],
)
def test_scores_suggest_their_bounds(values: list[float], bounds: tuple[float, float]) -> None:
    assert intervals.bounds(values) == bounds


@pytest.mark.parametrize(
    ("score", "bounds"),
    [
        (Score(least=0.0, greatest=1.0), (0.0, 1.0)),
        (Score(least=0.0), (0.0, math.inf)),
        (Score(greatest=5.0), (-math.inf, 5.0)),
        (Score(lower_is_better=True), (0.0, 1.0)),
    ],
)
def test_what_a_method_says_of_a_score_counts_more_than_its_values(score: Score, bounds: tuple[float, float]) -> None:
    assert intervals.bounds([0.2, 0.4], score) == bounds


def test_an_error_of_which_all_values_are_below_one_is_not_taken_for_a_share() -> None:
    rows = rows_of([[0.9], [0.95], [0.99], [0.05], [0.97]])

    guessed = of_rows(rows, mean)["intervals"]["score"]
    said = of_rows(rows, mean, scores={"score": Score(lower_is_better=True, least=0.0)})["intervals"]["score"]

    assert guessed["high"] <= 1.0 < said["high"]
    assert guessed["low"] == said["low"]


def test_a_bounded_score_keeps_to_its_bounds() -> None:
    interval = of_rows(rows_of([[1.0], [1.0], [1.0], [0.2], [1.0]]), mean)["intervals"]["score"]

    assert interval["high"] == 1.0
    assert 0.0 <= interval["low"] < 0.7


places = st.lists(st.lists(st.floats(0, 1), min_size=1, max_size=4), min_size=5, max_size=9)


@settings(max_examples=40)
@given(places, st.floats(-5, 5), st.floats(0.1, 10))
def test_an_interval_moves_and_stretches_with_the_scores(values: list[list[float]], shift: float, scale: float) -> None:
    def ends(transform: float, factor: float) -> tuple[float, float] | None:
        clusters = [[transform + factor * value for value in cluster] for cluster in values]
        found = intervals.linear(clusters, lambda drawn: {"score": math.fsum(drawn) / len(drawn)})["score"]
        if found.standard_error <= 1e-6:
            return None
        interval = intervals.limits(found, draws=199)
        return interval["low"], interval["high"]

    straight, moved = ends(0.0, 1.0), ends(shift, scale)
    if straight is not None and moved is not None:
        assert moved == pytest.approx([shift + scale * end for end in straight], rel=1e-3, abs=1e-3)
        assert straight[0] <= straight[1]


def test_a_scores_document_says_how_sure_its_scores_are(
    catalog: Catalog, make_result: Make, save: Save, tmp_path: Path
) -> None:
    results, truths = [], []
    for number, found in enumerate(([0.0], [0.1], [0.2], [0.3, 5.0], [0.4], [])):
        place = {"name": f"flat{number}", "variant": 1}
        results.append(save(f"{number}.json", make_result(*found, environment_details=[place])))
        truths.append(save(f"truth{number}.json", {**ground_truth(1, chair(0.0)), "environment": place}))

    document = evaluate_files(results, catalog=catalog, ground_truth_paths=truths)

    assert schema.problems(document, "scores", tmp_path) == []
    interval = document["intervals"]["OMQ"]
    assert 0 <= interval["low"] < document["scores"]["OMQ"] < interval["high"] <= 1
    assert document["statistics"]["clusters"] == 6
