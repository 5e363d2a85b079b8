"""Budgets: limits count over all attempts of an episode, and a result says what these have spent."""

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core import results
from benchbot.core.budget import Spent, overrun
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.plugin_manager import load
from benchbot.core.progress import State
from benchbot.core.request import Limits, RunRequest
from benchbot.core.selection import select
from benchbot.core.session import Session
from tests.core.test_session import RailHost, session


def drive(ride: Session, distance_m: float = 0.5) -> None:
    ride.step("move_distance", {"distance": distance_m})


def document_of(ride: Session) -> dict[str, Any]:
    """What is left of a ride: the provenance of a real selection around it, as JSON."""
    chosen = select(Catalog(load()), RunRequest("sample:active", "sample_robot", "arena:1"))
    ride.selection = chosen
    document: dict[str, Any] = json.loads(json.dumps(results.failed(ride)))
    schema.check(document, "result", Path("result.json"))
    return document


@pytest.mark.parametrize(
    ("limits", "why"),
    [
        (Limits(steps=5), "5 steps"),
        (Limits(simulated_time_s=5), "5 seconds of simulated time"),
    ],
)
def test_a_reset_does_not_give_back_what_is_spent(limits: Limits, why: str) -> None:
    ride = session("move_distance", limits=limits)
    for steps in (2, 2, 1):
        ride.reset()
        for _ in range(steps):
            drive(ride)
    with pytest.raises(BenchbotError, match="reached its limit") as caught:
        ride.reset()
    assert (caught.value.failure, why in caught.value.why) == (FailureClass.TIMEOUT, True)
    assert (ride.progress.state, ride.progress.spent.steps, ride.progress.spent.restarts) == (State.FAILED, 5, 2)


@pytest.mark.parametrize("late", [lambda ride: ride.step(None), lambda ride: ride.next_scene()])
def test_wall_time_counts_over_attempts_and_for_looks_and_scenes(late: Callable[[Session], object]) -> None:
    ride = session("move_distance", scenes=2, limits=Limits(wall_time_s=1000))
    ride.progress.started_s -= 5000  # the solution was on its way: nobody's time
    ride.reset()
    drive(ride)
    ride.progress.started_s -= 600
    ride.reset()
    ride.step(None)
    ride.progress.started_s -= 400
    with pytest.raises(BenchbotError, match="reached its limit"):
        late(ride)
    assert ride.progress.failure is FailureClass.TIMEOUT


def test_restarts_beyond_the_limit_are_refused_and_nothing_is_lost() -> None:
    ride = session("move_distance", limits=Limits(restarts=1))
    ride.reset()
    ride.reset()  # it has not moved: nothing is put back
    drive(ride)
    ride.reset()
    drive(ride)
    with pytest.raises(BenchbotError, match="may not be put back again"):
        ride.reset()
    drive(ride)
    assert (ride.progress.steps, ride.progress.state, ride.progress.failure) == (2, State.DIRTY, None)


def test_a_collision_without_restarts_is_the_end() -> None:
    ride = session("move_distance", limits=Limits(restarts=0))
    ride.reset()
    drive(ride, 9)
    with pytest.raises(BenchbotError, match="may not be put back again"):
        ride.reset()
    assert (ride.progress.state, ride.progress.failure) == (State.COLLIDED, FailureClass.COLLISION)


def test_whoever_has_seen_the_next_scene_has_moved() -> None:
    ride = session("move_distance", scenes=2, limits=Limits(restarts=0))
    ride.reset()
    ride.next_scene()
    with pytest.raises(BenchbotError, match="may not be put back again"):
        ride.reset()


def test_a_result_ends_an_episode_only_where_several_follow_one_another() -> None:
    for one_episode, restarts in ((False, 0), (True, 1)):
        ride = session("move_distance")
        ride.one_episode = one_episode
        ride.reset()
        drive(ride)
        ride.handed_in = True
        ride.reset()
        assert (ride.progress.spent.restarts, ride.progress.spent.steps) == (restarts, restarts)


def test_a_result_says_what_all_attempts_have_spent() -> None:
    ride = session("move_distance")
    for distance_m in (9, 9, 0.5):
        ride.reset()
        ride.step(None)
        drive(ride, distance_m)
    provenance = document_of(ride)["provenance"]
    assert (provenance["steps"], provenance["restarts"], provenance["failure"]) == (1, 2, None)
    assert provenance["spent"] == {
        "steps": 3, "looks": 3, "restarts": 2, "collisions": 2, "path_length_m": 18.5, "simulated_time_s": 3.0,
    }  # fmt: skip


def test_a_result_of_one_attempt_stays_as_it_was_and_is_all_there_is() -> None:
    ride = session("move_distance")
    ride.reset()
    ride.step(None)
    drive(ride)
    document = document_of(ride)
    assert "spent" not in document["provenance"]
    assert Spent.of(document) == Spent(1, 1, 0, 0, 0.5, 1.0)


TAKEN = st.lists(st.sampled_from(["reset", "look", "move", "crash", "next"]), max_size=30)


@given(TAKEN, st.integers(1, 6), st.integers(0, 3))
def test_no_order_of_requests_gets_around_the_limits(taken: list[str], steps: int, restarts: int) -> None:
    host = RailHost()
    ride = session("move_distance", host=host, scenes=2, limits=Limits(steps=steps, restarts=restarts))
    requests = {
        "reset": ride.reset,
        "look": lambda: ride.step(None),
        "move": lambda: drive(ride, 0.1),
        "crash": lambda: drive(ride, 9),
        "next": ride.next_scene,
    }
    for name in ["reset", *taken]:
        with suppress(BenchbotError):
            requests[name]()
    spent = ride.progress.spent
    assert spent.steps == host.steps <= steps
    assert spent.restarts <= restarts


@pytest.mark.parametrize(
    ("spent", "why"),
    [
        ({"steps": 198, "restarts": 4}, "It has taken 198 steps, and its limit is 100."),
        ({"steps": 100, "restarts": 4}, "It has taken 4 restarts, and its limit is 3."),
        ({"steps": 100, "restarts": 3}, None),
    ],
)
def test_a_result_beyond_its_limits_is_found(spent: dict[str, int], why: str | None) -> None:
    selection = {"limits": {"steps": 100, "restarts": 3}}
    assert overrun({"provenance": {"steps": 40, "spent": spent, "selection": selection}}) == why
    assert overrun({"provenance": {"steps": 40, "spent": spent, "selection": {}}}) is None
    assert overrun({}) is None


def test_the_time_of_a_real_robot_is_read_by_its_own_key() -> None:
    result = {"provenance": {"steps": 2, "restarts": 0, "robot_time_s": 7.0}}
    again = {"provenance": {"robot_time_s": 2.0, "spent": {"steps": 4, "restarts": 1, "robot_time_s": 9.0}}}
    assert (Spent.of(result).simulated_time_s, Spent.of(again).simulated_time_s) == (7.0, 9.0)
    spent = Spent(simulated_time_s=9.0).repeatable("robot_time_s")
    assert spent["robot_time_s"] == 9.0
    assert "simulated_time_s" not in spent
