"""The published implementation's scores, reproduced."""

import json
import lzma
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from benchbot_eval_omq import omq

GOLDEN = json.loads(lzma.decompress((Path(__file__).parent / "data" / "golden_v2.json.xz").read_bytes()))
CASES = GOLDEN["cases"]


@pytest.mark.parametrize("case", CASES, ids=range(len(CASES)))
def test_scores_equal_the_published_ones(case: dict[str, Any]) -> None:
    scores = omq.evaluate(case["result"], case["ground_truths"])

    assert {key: scores[key] for key in case["scores"]} == pytest.approx(case["scores"], abs=1e-6)


@pytest.mark.parametrize("case", CASES, ids=range(len(CASES)))
def test_hits_misses_and_false_positives_equal_the_published_ones(case: dict[str, Any]) -> None:
    comparison = omq.compare(case["result"], case["ground_truths"])

    assert len(comparison.pairs) == case["raw"]["TP"]
    assert len(comparison.false_positives) == case["raw"]["FP"]
    assert len(comparison.missed) == case["raw"]["FN"]
    assert sum(comparison.costs) == pytest.approx(case["raw"]["fp_cost"], abs=1e-9)


@pytest.mark.parametrize("case", [case for case in CASES if len(case["ground_truths"]) == 2])
def test_the_state_average_that_was_computed_but_never_published_is_reported(case: dict[str, Any]) -> None:
    scores = omq.evaluate(case["result"], case["ground_truths"])

    assert scores["avg_state_quality"] == pytest.approx(case["raw"]["avg_state_unreported"], abs=1e-6)


def test_inputs_are_left_as_they_were() -> None:
    before = deepcopy(CASES)
    for case in CASES:
        omq.evaluate(case["result"], case["ground_truths"])

    assert before == CASES


def test_the_mean_over_many_results_equals_the_published_one() -> None:
    scores = [omq.evaluate(case["result"], case["ground_truths"]) for case in CASES]

    combined = omq.combine(scores)

    assert {key: combined[key] for key in GOLDEN["combine_all"]} == pytest.approx(GOLDEN["combine_all"], abs=1e-6)
