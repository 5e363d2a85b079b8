"""The method: numbers worked out by hand, what is refused, and what stands for a result that is missing."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot_eval_trajectory import evaluator
from benchbot_eval_trajectory.evaluator import explain
from plugins.eval_trajectory.tests.ways import result

ERRORS = evaluator.NAMES[:-2]


def test_the_truth_has_no_error() -> None:
    scores = evaluator.evaluate(result())

    assert tuple(scores) == evaluator.NAMES
    assert [scores[name] for name in ERRORS] == pytest.approx([0.0] * len(ERRORS), abs=1e-6)
    assert (scores["path_length_m"], scores["completeness"]) == (2.0, 1.0)


def test_an_estimate_in_another_frame_is_wrong_in_the_map_only() -> None:
    """Turned by 90 degrees about the first pose, and 3 m higher: (x, y, z) becomes (-y, x, z + 3)."""
    poses = [(0, (0.0, 0.0, 3.05), math.pi / 2), (1, (0.0, 1.0, 3.05), math.pi / 2), (2, (-1.0, 1.0, 3.05), math.pi)]
    scores = evaluator.evaluate(result(poses))

    # Distances in the map: 3, √(1 + 1 + 9), √(4 + 0 + 9).
    assert scores["ATE_map_RMSE_m"] == pytest.approx(math.sqrt((9 + 11 + 13) / 3))
    aligned = [name for name in ERRORS if name != "ATE_map_RMSE_m"]
    assert [scores[name] for name in aligned] == pytest.approx([0.0] * len(aligned), abs=1e-6)


def test_an_estimate_of_wrong_scale_is_right_after_sim3() -> None:
    poses = [(0, (0.0, 0.0, 0.1), 0.0), (1, (2.0, 0.0, 0.1), 0.0), (2, (2.0, 2.0, 0.1), math.pi / 2)]
    scores = evaluator.evaluate(result(poses))

    assert scores["ATE_sim3_RMSE_m"] == pytest.approx(0, abs=1e-12)
    # About their centres, twice the triangle (0, 0), (1, 0), (1, 1) is off by the triangle itself.
    assert scores["ATE_RMSE_m"] == pytest.approx(math.sqrt(4 / 9))
    assert (scores["RPE_frame_m"], scores["RPE_1m_m"]) == pytest.approx((1.0, 1.0))
    assert scores["RPE_1m_deg"] == pytest.approx(0, abs=1e-6)


def test_errors_over_a_metre_are_left_out_where_observations_end_before() -> None:
    rows = [(0, 0.0, 0.0, 0.0, 0.0), (1, 1.0, 0.5, 0.0, 0.0), (None, 2.0, 1.0, 0.0, 0.0), (2, 3.0, 0.6, 0.0, 0.0)]
    scores = evaluator.evaluate(result(rows=rows))

    assert "RPE_1m_m" not in scores
    assert scores["RPE_frame_m"] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("observations", "missing", "fits"), [(3, 1, True), (3, 2, False), (40, 4, True), (40, 5, False)]
)
def test_a_tenth_of_the_observations_may_be_missing_and_always_one(observations: int, missing: int, fits: bool) -> None:
    rows = [(number, float(number), 0.1 * number, 0.0, 0.0) for number in range(observations)]
    document = result(rows=rows)
    del document["results"]["poses"][:missing]

    if fits:
        assert evaluator.evaluate(document)["completeness"] == pytest.approx(1 - missing / observations)
    else:
        with pytest.raises(BenchbotError, match="leaves out too many"):
            evaluator.evaluate(document)


def test_without_a_start_pose_the_floor_is_at_zero() -> None:
    document = result() | {"environment_details": [{"name": "room", "variant": 1}]}

    assert evaluator.evaluate(document)["ATE_map_RMSE_m"] == pytest.approx(0.05)


def test_the_order_of_poses_does_not_matter() -> None:
    document = result([(0, (0, 0, 0), 0.1), (1, (1, 0.5, 0), 0.0), (2, (1, 1, 0.2), 1.0)])
    scores = evaluator.evaluate(document)
    document["results"]["poses"].reverse()

    assert evaluator.evaluate(document) == scores


@pytest.mark.parametrize(
    ("change", "title"),
    [
        ({"track": None}, "does not say where the robot went"),
        ({"track": []}, "does not say where the robot went"),
        ({"track": [{**result()["track"][0], "rows": []}]}, "does not say where the robot went"),
        ({"track": result()["track"] * 2}, "of several scenes"),
        ({"track": result(path_length_m=0.99)["track"]}, "hardly moved"),
        ({"results": result([(5, (0, 0, 0), 0.0)])["results"]}, "observations that there were not"),
        ({"results": {"poses": []}}, "leaves out too many"),
        ({"environment_details": [{"name": "room", "variant": 1, "start_pose": [1, 0]}]}, "start pose"),
        ({"environment_details": [{"name": "room", "variant": 1, "start_pose": "here"}]}, "start pose"),
    ],
)
def test_what_cannot_be_judged_is_refused(change: dict[str, Any], title: str) -> None:
    with pytest.raises(BenchbotError, match=title):
        evaluator.evaluate(result() | change)


def test_what_is_missing_has_no_error_but_no_poses_either() -> None:
    scores = evaluator.evaluate(result([(0, (0, 0, 0), 0.1), (1, (1, 0.5, 0), 0.0), (2, (1, 1, 0.2), 1.0)]))
    combined = evaluator.combine([scores, {}])

    assert combined == {**scores, "completeness": 0.5}
    assert evaluator.combine([{}]) == {"completeness": 0.0}
    assert evaluator.combine([]) == {}


@given(st.lists(st.floats(0, 100), min_size=1, max_size=9))
def test_many_are_combined_by_their_mean(errors: list[float]) -> None:
    combined = evaluator.combine([{"ATE_RMSE_m": error, "completeness": 1.0} for error in errors])

    assert combined["ATE_RMSE_m"] == pytest.approx(float(np.mean(errors)))
    assert combined["completeness"] == 1.0


def test_its_record_names_what_it_gives() -> None:
    record = load().record("evaluators", "trajectory")

    assert record.headline in evaluator.NAMES
    assert record.evaluate(result(), []) == evaluator.evaluate(result())
    assert record.combine([]) == {}


def test_every_score_is_read_as_an_error_but_length_and_completeness() -> None:
    method = load().record("evaluators", "trajectory")

    assert set(method.scores) == set(evaluator.NAMES)
    assert {name for name in evaluator.NAMES if method.score(name).lower_is_better} == set(ERRORS)
    assert method.score("completeness").lower_is_better is False


def test_drift_is_told_by_the_length_of_the_way() -> None:
    rows = [(i, float(i), 0.1 * i, 0.0, 0.0) for i in range(121)]
    # A wheel that reports 2 % too much: 2 cm a metre, however long the stretch.
    estimate = [(i, (0.102 * i, 0.0, 0.05), 0.0) for i in range(121)]

    told = explain(result(estimate, rows, path_length_m=12.0))["diagnosis"]

    assert [row["length_m"] for row in told["drift"]] == [0.5, 1.0, 2.0, 5.0, 10.0]
    for row in told["drift"]:
        assert row["error_m"] == pytest.approx(0.02 * row["length_m"], rel=0.25)
        assert row["error_deg"] == pytest.approx(0.0, abs=1e-6)
    assert told["along"][0] == [0.0, 0.0]
    assert told["along"][-1] == pytest.approx([12.0, 0.24])
