"""Verification: actions that a result has recorded are taken again, and every claim is held against what is seen."""

import json
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core import randomness
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.core.request import Limits
from benchbot.core.session import Session
from benchbot.plugins.bundles import replay
from benchbot.plugins.bundles.replay import Verification
from tests.plugins.bundles.conftest import StartHost

Make = Callable[..., dict[str, Any]]
Verify = Callable[[dict[str, Any]], Verification]
ACTIONS = st.one_of(
    st.none(),
    st.tuples(st.just("move_distance"), st.fixed_dictionaries({"distance": st.floats(-0.4, 0.9)})),
    st.tuples(st.just("move_angle"), st.fixed_dictionaries({"angle": st.floats(-90, 90) | st.integers(-90, 90)})),
)


@pytest.fixture(scope="module")
def verify(start_host: StartHost) -> Verify:
    return lambda document: replay.verify(document, Catalog(load()), start_host)


def changed(document: dict[str, Any], pointer: str, value: Any) -> dict[str, Any]:
    copy: dict[str, Any] = json.loads(json.dumps(document))
    *way, last = [int(key) if key.isdigit() else key for key in pointer.split("/")]
    place: Any = copy
    for key in way:
        place = place[key]
    place[last] = value
    return copy


@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.lists(ACTIONS, max_size=5), st.sampled_from(["sample:active", "sample:noisy", "sample:goal"]))
def test_any_drive_can_be_verified(verify: Verify, made: Make, taken: list[Any], task: str) -> None:
    def drive(session: Session) -> None:
        session.reset()
        for action in taken:
            if session.actions or action is None:
                session.step(*(action or (None,)))

    verification = verify(made(drive, task=task, seed=5))

    assert verification.problems == ()
    assert verification.software == ()


def test_several_scenes_settings_and_a_reset_are_replayed(verify: Verify, made: Make) -> None:
    def drive(session: Session) -> None:
        session.reset()
        session.step("move_next")
        session.reset()
        session.step("move_next")
        session.next_scene()
        session.step(None)

    document = made(drive, "sample:two_scenes", "arena:1:2", settings={"lighting.time": "21:30"})
    verification = verify(document)
    assert (verification.verified, verification.observations) == (True, 4)


def test_a_result_is_replayed_on_its_device_where_there_is_one_and_nobody_is_accused_where_there_is_none(
    verify: Verify, driven: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = changed(driven, "provenance/machine/device", "cuda: NVIDIA H100")
    other = changed(elsewhere, "actions/0/rows/1/0", "0" * 16)
    assert verify(elsewhere).verified, "no GPU is here, and the same is seen all the same"
    with pytest.raises(BenchbotError, match="cannot be verified on this machine") as refused:
        verify(other)
    assert "simulated on cpu instead of cuda: NVIDIA H100" in refused.value.why

    monkeypatch.setenv("SAMPLE_GPU", "NVIDIA H100")
    assert verify(other).problems[0].startswith("Something else is seen"), "the same device shows what was there"
    assert verify(changed(driven, "provenance/machine/device", "cpu")).verified


def test_a_collision_is_seen_again_and_cannot_be_denied(verify: Verify, made: Make) -> None:
    def drive(session: Session) -> None:
        session.reset()
        session.step("move_distance", {"distance": 9.0})

    document = made(drive)
    assert document["provenance"]["failure"]["class"] == "collision"
    assert verify(document).verified
    (problem,) = verify(changed(document, "provenance/failure", None)).problems
    assert "does not say so" in problem


@pytest.mark.parametrize(
    ("pointer", "value", "said"),
    [
        ("actions/0/rows/1/2", {"distance": 0.6}, "first at observation 1 (arena:1, after move_distance(0.6))"),
        ("actions/0/rows/3/2", {"angle": 31}, "first at observation 3 (arena:1, after move_angle(31))"),
        ("actions/0/rows/2/0", "0" * 16, "first at observation 2 (arena:1, a look)"),
        ("actions/0/rows/0/0", "0" * 16, "first at observation 0 (arena:1, on entering)"),
        ("actions/0/rows/2", ["0" * 16, "fly"], "cannot be done, at observation 2"),
        ("actions/0/rows/1/2", {"distance": "far"}, "cannot be done, at observation 1"),
        ("actions/0/rows/0", ["0" * 16, "move_angle", {"angle": 1}], "cannot be done, at observation 0"),
        ("provenance/selection/seed", 4, None),
        ("provenance/observation_digest", "0" * 64, "wrong about its digest"),
        ("provenance/simulated_time_s", 0.5, "wrong about its simulated time"),
        ("provenance/steps", 1, "wrong about the number of its steps"),
        ("track/0/path_length_m", 0.1, "wrong about where the robot went"),
        ("track/0/collisions", 1, "wrong about where the robot went"),
        ("provenance/failure", {"class": "collision", "why": ""}, "and it does not"),
        ("task_details/name", "sample:easy", "The task is not the one"),
        ("environment_details/0/start_pose", [1, 0, 0, 0, 0, 0, 0], "The environment is not the one"),
    ],
)
def test_whatever_is_changed_is_found_out(
    verify: Verify, driven: dict[str, Any], pointer: str, value: Any, said: str | None
) -> None:
    verification = verify(changed(driven, pointer, value))
    if said is None:  # a seed matters where something is drawn from it, which is not so here
        assert verification.verified
    else:
        assert said in verification.problems[0]


SECRET = 16 * "0f"
KEPT_BACK = {
    "no secret": ({"secret": None}, "The secret of the run is not disclosed in the result."),
    "no seed": ({"seed": None}, "The seed of the run is not disclosed in the result."),
    "another secret": ({"secret": 16 * "f0"}, "is not the one that the run was committed to"),
    "another seed": ({"seed": 4}, "is not the one that the run was committed to"),
    "no commitment": ({"commitment": None}, "is not the one that the run was committed to"),
    "a secret that is none": ({"secret": "hush"}, "is not the one that the run was committed to"),
}


@pytest.mark.parametrize(("change", "said"), KEPT_BACK.values(), ids=KEPT_BACK.keys())
def test_a_run_with_a_secret_is_verified_by_what_it_was_committed_to(
    verify: Verify, made: Make, change: dict[str, Any], said: str
) -> None:
    document = made(lambda session: session.reset(), seed=3, secret=SECRET)
    assert verify(document).verified
    chosen = document["provenance"]["selection"]
    assert (chosen["seed"], chosen["secret"], chosen["commitment"]) == (3, SECRET, randomness.commitment(SECRET, 3))
    changed = {key: value for key, value in (chosen | change).items() if value is not None}
    with pytest.raises(BenchbotError, match=said):
        verify({**document, "provenance": {**document["provenance"], "selection": changed}})


def test_a_failure_that_no_replay_can_show_is_named(verify: Verify, driven: dict[str, Any]) -> None:
    verification = verify(changed(driven, "provenance/failure", {"class": "agent", "why": "It crashed."}))
    assert verification.verified
    assert verification.unproven == ("why the episode failed (agent)",)


def test_a_result_beyond_its_limits_is_found_out(verify: Verify, driven: dict[str, Any]) -> None:
    for limits, problem in (
        ({"steps": 2}, "The episode has reached its limit. The limit of 2 steps is used up."),
        ({"simulated_time_s": 0.1}, "The limit of 0.1 seconds of simulated time is used up."),
        ({"steps": 3, "simulated_time_s": 1000.0, "wall_time_s": 0.0, "restarts": 0}, None),
    ):
        found = verify(changed(driven, "provenance/selection/limits", limits)).problems
        assert found == () if problem is None else problem in found[0]


def test_what_was_spent_before_the_last_attempt_counts(verify: Verify, made: Make) -> None:
    def drive(session: Session) -> None:
        for _ in range(3):
            session.reset()
            session.step("move_distance", {"distance": 0.2})

    document = made(drive, limits=Limits(steps=3))
    verification = verify(document)
    assert verification.verified
    assert verification.unproven == ("what the robot did before it was put back (2 restarts)",)
    assert replay.budgets_in_words(document) == "3 of 3 steps, 2 restarts"
    beyond = verify(changed(document, "provenance/spent/steps", 4))
    assert "cannot be done, at observation 1" in beyond.problems[0]
    too_often = verify(changed(document, "provenance/selection/limits", {"restarts": 1}))
    assert too_often.problems == ("It has taken 2 restarts, and its limit is 1.",)


def test_other_software_is_named(verify: Verify, driven: dict[str, Any]) -> None:
    older = changed(driven, "provenance/plugins/benchbot-sample/sha256", "0" * 64)
    (difference,) = verify(older).software
    assert str(difference).startswith(
        "benchbot-sample: the result is of 1.0 (content 00000000), here it is 1.0 (content"
    )


@pytest.mark.parametrize(
    ("pointer", "value", "why"),
    [
        ("actions", None, "too often"),
        ("provenance", None, "says nothing of what made it"),
        ("provenance/frames", 7, "not that of all its observations"),
        ("provenance/selection/environment", "moon:1", "moon"),
        ("provenance/selection/robot", "sample_real_robot", "does not repeat itself"),
        ("provenance/selection/episode", {"list": "x", "sha256": "0" * 64, "number": 0, "id": "0"}, "has no episodes"),
    ],
)
def test_what_cannot_be_verified_says_why(
    verify: Verify, driven: dict[str, Any], pointer: str, value: Any, why: str
) -> None:
    with pytest.raises(BenchbotError) as caught:
        verify(changed(driven, pointer, value))
    assert why in str(caught.value)


def test_older_results_say_that_they_hold_no_actions(verify: Verify, driven: dict[str, Any]) -> None:
    older = {key: value for key, value in driven.items() if key != "actions"}
    with pytest.raises(BenchbotError, match="cannot be verified") as caught:
        verify(older)
    assert "of an older BenchBot" in caught.value.why
