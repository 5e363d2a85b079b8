"""Success, SPL and SoftSPL against cases worked out by hand, and what counts as the end of a run."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot.plugin import GroundTruth, Result
from benchbot_task_navigation.evaluator import NAMES, Run, combine, evaluate, score
from plugins.task_navigation.tests.floors import LASER_TASK, arena_truth

THERE = Run(
    ended_well=True, near_enough=True, path_length_m=2.0, distance_to_goal_m=0.0, shortest_path_m=2.0, collisions=0
)


def changed(**changes: Any) -> dict[str, float]:
    return score(Run(**{**THERE.__dict__, **changes}))


# changes, SPL, SoftSPL
BY_HAND = [
    ({}, 1.0, 1.0),
    ({"path_length_m": 4.0}, 0.5, 0.5),  # twice the shortest way
    ({"path_length_m": 1.9}, 1.0, 1.0),  # a goal that may be missed by 20 cm can be reached on less
    ({"path_length_m": 2.5, "distance_to_goal_m": 0.1}, 0.8, 0.95 * 0.8),
    ({"near_enough": False, "distance_to_goal_m": 1.0}, 0.0, 0.5),  # half of it done, and no detour
    ({"near_enough": False, "distance_to_goal_m": 3.0, "path_length_m": 1.0}, 0.0, 0.0),  # farther than at the start
    ({"ended_well": False}, 0.0, 1.0),
    ({"path_length_m": 0.0, "near_enough": False, "distance_to_goal_m": 2.0}, 0.0, 0.0),
]


@pytest.mark.parametrize(("changes", "spl", "soft_spl"), BY_HAND)
def test_the_scores_are_those_worked_out_by_hand(changes: dict[str, Any], spl: float, soft_spl: float) -> None:
    scores = changed(**changes)

    assert tuple(scores) == NAMES
    assert scores["SPL"] == pytest.approx(spl)
    assert scores["SoftSPL"] == pytest.approx(soft_spl)
    assert scores["success"] == (1.0 if spl else 0.0)


runs = st.builds(
    Run,
    ended_well=st.booleans(),
    near_enough=st.booleans(),
    path_length_m=st.floats(0, 1e3),
    distance_to_goal_m=st.floats(0, 1e3),
    shortest_path_m=st.floats(1e-3, 1e3),
    collisions=st.integers(0, 3),
)


@given(runs)
def test_spl_is_at_most_success_and_all_stay_between_zero_and_one(run: Run) -> None:
    scores = score(run)

    assert 0.0 <= scores["SPL"] <= scores["success"] <= 1.0
    assert 0.0 <= scores["SoftSPL"] <= 1.0


@given(runs, st.floats(0, 100), st.floats(0, 100))
def test_neither_a_longer_way_nor_a_farther_end_is_ever_better(run: Run, detour_m: float, farther_m: float) -> None:
    worse = Run(
        **{
            **run.__dict__,
            "path_length_m": run.path_length_m + detour_m,
            "distance_to_goal_m": run.distance_to_goal_m + farther_m,
        }
    )

    assert score(worse)["SPL"] <= score(run)["SPL"]
    assert score(worse)["SoftSPL"] <= score(run)["SoftSPL"]


def test_a_missing_run_is_no_success_and_has_no_distance() -> None:
    combined = combine([changed(path_length_m=4.0), changed(), {}, {}])

    assert combined["success"] == 0.5
    assert combined["SPL"] == pytest.approx((0.5 + 1.0) / 4)
    assert combined["path_length_m"] == pytest.approx(3.0)
    assert combine([{}]) == {"SPL": 0.0, "success": 0.0, "SoftSPL": 0.0}


@given(st.lists(runs, min_size=1, max_size=6))
def test_the_order_of_runs_makes_no_difference(some: list[Run]) -> None:
    rows = [score(run) for run in some]

    assert combine(rows) == pytest.approx(combine(rows[::-1]))


def ended_at(x: float, y: float, *, episode: int = 2, path_length_m: float = 2.0, **changes: Any) -> Any:
    """Return a result of `arena:1`, episode 2: from (0.05, -1.6) to (-1.4, -0.65), with a chair in between."""
    selection = select(
        Catalog(load()), RunRequest(task=LASER_TASK, robot="sample_robot", environment="arena:1", episode=episode)
    )
    assert selection.episode is not None
    rows = [[0, 0.0, 0.05, -1.6, 0.0], [None, 1.0, x, y, 0.0], [1, 2.0, x, y, 0.5]]
    track = {"scene": "arena:1", "path_length_m": path_length_m, "collisions": 0, "rows": rows}
    provenance = {"failure": None, "restarts": 0, "selection": {"episode": selection.episode.provenance()}}
    result = {"provenance": provenance, "track": [track], "results": {"success": 1.0}}
    for key, value in changes.items():
        (track if key in track else provenance)[key] = value
    return result


def scored(result: Result) -> dict[str, float]:
    return evaluate(result, [arena_truth()])


def test_a_run_that_ends_at_its_goal_is_measured_by_the_shortest_way() -> None:
    scores = scored(ended_at(-1.4, -0.65))

    # Around the chair at (-1, -1), radius 25 cm, with a robot of 20 cm: two tangents and the arc between.
    away, left = math.hypot(1.05, 0.6), math.hypot(0.4, 0.35)
    between = abs(math.remainder(math.atan2(-0.6, 1.05) - math.atan2(0.35, -0.4), 2 * math.pi))
    arc = between - math.acos(0.45 / away) - math.acos(0.45 / left)
    shortest_m = math.sqrt(away**2 - 0.45**2) + math.sqrt(left**2 - 0.45**2) + 0.45 * arc
    assert scores["success"] == 1.0
    assert scores["SPL"] == pytest.approx(shortest_m / 2.0, rel=0.01)
    assert scores["distance_to_goal_m"] == 0.0


def test_the_way_that_is_left_goes_around_what_is_between() -> None:
    scores = scored(ended_at(0.05, -1.6, path_length_m=0.0))

    assert scores["distance_to_goal_m"] == pytest.approx(1.955424, abs=1e-5)
    assert scores["success"] == 0.0
    assert scores["SoftSPL"] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize(
    "changes",
    [
        {"failure": {"class": "timeout", "why": "The limit is used up."}},
        {"failure": {"class": "collision", "why": "The robot hit something."}, "collisions": 1},
        {"restarts": 1},
        {"driven_by_hand": 2},
        {"taken_over": {"times": 1, "duration_s": 3.5}},
    ],
)
def test_who_hits_something_runs_out_of_time_begins_anew_or_is_helped_has_no_success(changes: dict[str, Any]) -> None:
    scores = scored(ended_at(-1.4, -0.65, **changes))

    assert (scores["success"], scores["SPL"]) == (0.0, 0.0)
    assert scores["SoftSPL"] > 0.9


def test_the_way_before_the_last_attempt_is_no_shortcut() -> None:
    spent = {"restarts": 2, "collisions": 2, "path_length_m": 20.0}
    scores = scored(ended_at(-1.4, -0.65, restarts=2, spent=spent))

    assert (scores["success"], scores["collisions"], scores["path_length_m"]) == (0.0, 2.0, 20.0)
    assert scores["SoftSPL"] < 0.11


def test_twenty_centimetres_off_is_near_enough_and_more_is_not() -> None:
    assert scored(ended_at(-1.5, -0.5))["success"] == 1.0
    assert scored(ended_at(-1.55, -0.5))["success"] == 0.0


def test_a_robot_that_believes_to_be_off_the_plan_has_a_distance_all_the_same() -> None:
    assert scored(ended_at(-9.0, -0.65))["distance_to_goal_m"] == pytest.approx(7.6, abs=0.1)


def test_an_object_is_reached_within_a_metre_of_its_box() -> None:
    selection = select(
        Catalog(load()),
        RunRequest(
            task="navigation:object_goal:ground_truth",
            robot="carter_lowres",
            environment="miniroom:1",
            episode=5,
        ),
    )
    assert selection.episode is not None
    goal = selection.episode.data["goal"]
    truth = _miniroom()
    x, y, _ = goal["instances"][0]["centroid"]
    start = selection.episode.data["start_pose"][4:6]
    result = ended_at(x, y)
    result["provenance"]["selection"]["episode"] = selection.episode.provenance()

    assert evaluate(result, [truth])["success"] == 1.0
    assert evaluate(result, [truth])["distance_to_goal_m"] == 0.0
    result["track"][0]["rows"].append([2, 3.0, *start, 0.0])
    missed = evaluate(result, [truth])
    assert missed["success"] == 0.0
    assert missed["distance_to_goal_m"] == pytest.approx(selection.episode.data["shortest_path_m"], abs=1e-5)


def _miniroom() -> GroundTruth:
    from benchbot.evaluation.ground_truths import GroundTruths

    return GroundTruths.of(Catalog(load()), None).find("miniroom:1", {"floor_plan"})


@pytest.mark.parametrize("lack", ["track", "episode"])
def test_a_result_that_does_not_say_where_the_robot_went_cannot_be_scored(lack: str) -> None:
    result = ended_at(0.0, 0.0)
    if lack == "track":
        del result["track"]
    else:
        del result["provenance"]["selection"]["episode"]

    with pytest.raises(BenchbotError, match="does not say where the robot went") as caught:
        scored(result)
    assert lack in caught.value.why


def test_a_result_of_another_list_is_refused_with_both_hashes() -> None:
    result = ended_at(0.0, 0.0)
    result["provenance"]["selection"]["episode"]["sha256"] = "0" * 64

    with pytest.raises(BenchbotError, match="not those of this result") as caught:
        scored(result)
    assert "000000000000" in caught.value.why


@given(runs)
def test_every_score_keeps_to_the_bounds_that_the_method_gives_it(run: Run) -> None:
    method = load().record("evaluators", "navigation")
    scores = score(run)

    assert set(scores) == set(method.scores)
    for name, value in scores.items():
        least, greatest = method.score(name).least, method.score(name).greatest
        assert least is not None
        assert least <= value <= (math.inf if greatest is None else greatest)
