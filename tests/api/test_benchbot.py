import json
import os
import signal
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import benchbot.api
from benchbot.api import ActionResult, Agent, BenchBot, BenchbotError, Observations
from benchbot.core.errors import FailureClass
from benchbot.supervisor.backend import Backend

StartBackend = Callable[..., Backend]


class Walker(Agent):
    """Takes the first action there is, with the arguments it is made with, until the scene or its patience ends."""

    def __init__(self, patience: int = 100, **arguments: Any) -> None:
        self.arguments = arguments
        self.patience = patience
        self.seen: list[Observations] = []
        self.results: list[ActionResult] = []

    def is_done(self, action_result: ActionResult) -> bool:
        self.results.append(action_result)
        return action_result is not ActionResult.SUCCESS or len(self.seen) >= self.patience

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, Any]]:
        self.seen.append(observations)
        return action_list[0], self.arguments

    def save_result(
        self, filename: str, empty_results: dict[str, Any], results_format_fns: Mapping[str, Callable[..., Any]]
    ) -> None:
        thing = results_format_fns["create_object"](num_classes=31)
        thing["label_probs"][0] = 1.0
        empty_results["results"]["objects"].append(thing)
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


def test_an_agent_runs_to_the_end_and_its_result_is_completed(
    start_backend: StartBackend, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    backend = start_backend(seed=5)
    result_path = tmp_path / "mine" / "result"
    monkeypatch.setenv("BENCHBOT_RESULT", str(result_path))
    agent = Walker()
    BenchBot(agent).run()
    assert agent.results == [ActionResult.SUCCESS] * 3 + [ActionResult.FINISHED]
    document = json.loads(result_path.read_text("utf-8"))
    assert document["results"]["objects"][0]["label_probs"][0] == 1.0
    assert document["provenance"]["steps"] == 3
    assert document["provenance"]["selection"]["seed"] == 5
    assert document == json.loads(Path(backend.state.result).read_text("utf-8"))


def test_every_scene_is_run_once(start_backend: StartBackend) -> None:
    start_backend("sample:two_scenes", "arena:1:2")
    agent = Walker()
    BenchBot().run(agent)
    assert [seen["scene_number"] for seen in agent.seen] == [0, 0, 0, 1, 1, 1]
    assert agent.results == ([ActionResult.SUCCESS] * 3 + [ActionResult.FINISHED]) * 2


def test_a_collision_ends_the_episode_with_a_result(start_backend: StartBackend) -> None:
    start_backend("sample:active")
    agent = Walker(distance=30)
    bot = BenchBot(agent)
    bot.run()
    assert agent.results == [ActionResult.SUCCESS, ActionResult.COLLISION]
    document = json.loads(Path(bot.result_filename).read_text("utf-8"))
    assert document["provenance"]["failure"]["class"] == "collision"
    assert bot.actions == []
    with pytest.raises(BenchbotError, match="after a collision"):
        bot.next_scene()


def test_a_loop_of_ones_own(start_backend: StartBackend, capsys: pytest.CaptureFixture[str]) -> None:
    start_backend("sample:active")
    bot = BenchBot()
    observations, result = bot.reset()
    assert result is ActionResult.SUCCESS
    assert set(observations) == {*bot.observations, "scene_number"}
    first, _ = bot.step("move_distance", distance=0.25)
    second, _ = bot.step("move_distance", {"distance": -0.25})
    moved = first["poses"]["base_link"]["translation_xyz"] - observations["poses"]["base_link"]["translation_xyz"]
    np.testing.assert_allclose(moved, [0.25, 0, 0], atol=0.02)
    again, result = bot.step(None)
    np.testing.assert_equal(again, second)
    bot.reset()
    printed = capsys.readouterr().out
    assert "Waiting to establish connection to a running supervisor ... Connected!\n" in printed
    assert "Sending action 'move_distance' with args: {'distance': 0.25}\n" in printed
    assert "Dirty robot state detected. Performing reset ... Complete.\n" in printed


def test_a_solution_learns_that_its_robot_was_blocked(start_backend: StartBackend) -> None:
    start_backend("sample:active", robot="sample_careful_robot")
    bot = BenchBot()
    bot.reset()
    told = [bot.last_outcome]
    _, result = bot.step("move_distance", distance=30)
    told.append(bot.last_outcome)
    bot.step("move_angle", angle=10)
    told.append(bot.last_outcome)
    bot.step(None)
    told.append(bot.last_outcome)
    assert result is ActionResult.SUCCESS
    assert told == [None, "blocked", "reached", None]


def test_an_agent_learns_how_its_actions_ended(start_backend: StartBackend) -> None:
    start_backend("sample:active", robot="sample_careful_robot")

    class Curious(Walker):
        def is_done(self, action_result: ActionResult) -> bool:
            told.append(self.last_outcome)
            return super().is_done(action_result)

    told: list[str | None] = []
    BenchBot(Curious(patience=2, distance=30)).run()
    assert told == [None, "blocked", "blocked"]


def test_what_was_seen_can_be_written_on(start_backend: StartBackend) -> None:
    start_backend()
    observations, _ = BenchBot().reset()
    for name in ("image_rgb", "image_depth"):
        observations[name] += 1
        assert observations[name].flags.aligned


def test_reset_of_a_clean_scene_keeps_it(start_backend: StartBackend) -> None:
    start_backend("sample:two_scenes", "arena:1:2")
    bot = BenchBot()
    assert bot.reset()[0]["scene_number"] == 0
    assert bot.next_scene() is True
    assert [bot.reset()[0]["scene_number"] for _ in range(2)] == [1, 1]
    assert bot.next_scene() is False
    bot.step("move_next")
    assert bot.reset()[0]["scene_number"] == 0


def test_what_is_run_can_be_asked(start_backend: StartBackend) -> None:
    start_backend()
    bot = BenchBot(auto_start=False)
    assert bot.actions == ["move_next"]
    assert set(bot.config) == {"task", "robot", "environments", "results"}
    assert bot.task_details["name"] == "sample:passive"
    assert [scene["name"] for scene in bot.environment_details] == ["arena"]
    assert bot.empty_results()["task_details"] == bot.task_details
    assert set(bot.results_functions()) == {"create", "create_object", "validate"}
    assert bot.empty_results()["results"]["objects"] == []


def test_results_functions_tell_what_is_wrong(start_backend: StartBackend) -> None:
    start_backend()
    functions = BenchBot().results_functions()
    assert functions["validate"](functions["create"]()) is None
    with pytest.raises(BenchbotError) as caught:
        functions["validate"]({"objects": [{"label_probs": [1]}], "class_list": ["cup", "chair"]})
    assert "objects[0]" in caught.value.why


def test_a_mistake_is_raised_as_the_supervisor_says_it(start_backend: StartBackend) -> None:
    start_backend()
    bot = BenchBot()
    with pytest.raises(BenchbotError, match="'move_nxt' is not an action") as caught:
        bot.step("move_nxt")
    assert "Did you mean 'move_next'?" in caught.value.why
    assert caught.value.failure is FailureClass.AGENT


def test_the_traceback_of_a_mistake_ends_one_call_below_the_line_that_made_it(start_backend: StartBackend) -> None:
    start_backend()
    bot = BenchBot()
    with pytest.raises(ValueError, match="'move_nxt' is not an action") as caught:
        bot.step("move_nxt")

    told = "".join(traceback.format_exception(caught.value))
    assert told.count("Traceback (most recent call last)") == 1
    assert [frame.name for frame in traceback.extract_tb(caught.value.__traceback__)][1:] == ["step"]


def test_a_result_that_breaks_its_format_is_refused(start_backend: StartBackend) -> None:
    start_backend()

    class Sloppy(Walker):
        def save_result(self, filename: str, empty_results: dict[str, Any], results_format_fns: Any) -> None:
            Path(filename).write_text(json.dumps({**empty_results, "results": []}))

    with pytest.raises(BenchbotError, match="breaks the format") as caught:
        BenchBot(Sloppy()).run()
    assert caught.value.failure is FailureClass.AGENT


@pytest.mark.parametrize("text", [None, "{", "NaN"])
def test_a_result_that_is_none_is_told(start_backend: StartBackend, text: str | None) -> None:
    start_backend()

    class Silent(Walker):
        def save_result(self, filename: str, empty_results: dict[str, Any], results_format_fns: Any) -> None:
            if text is not None:
                Path(filename).write_text(text)

    with pytest.raises(BenchbotError) as caught:
        BenchBot(Silent()).run()
    assert caught.value.failure is FailureClass.AGENT


def test_an_agent_must_be_one() -> None:
    bot = BenchBot(auto_start=False)
    with pytest.raises(BenchbotError, match="'str' is not an agent"):
        bot.set_agent("me")  # type: ignore[arg-type]
    with pytest.raises(BenchbotError, match="no agent"):
        bot.run()
    bot.set_agent(None)


def test_without_a_back_end_one_is_told_what_to_start() -> None:
    with pytest.raises(BenchbotError, match="No BenchBot run") as caught:
        BenchBot()
    assert "benchbot run" in caught.value.fix


def test_a_supervisor_that_is_killed_is_told(start_backend: StartBackend) -> None:
    backend = start_backend()
    bot = BenchBot()
    os.kill(backend.state.pid, signal.SIGKILL)
    with pytest.raises(BenchbotError, match="supervisor is gone") as caught:
        bot.step("move_next")
    assert caught.value.failure is FailureClass.INFRASTRUCTURE


def test_a_platform_that_dies_is_told_and_reset_brings_another(start_backend: StartBackend) -> None:
    start_backend(environment="faulty:crash")
    bot = BenchBot()
    bot.step("move_next")
    with pytest.raises(BenchbotError, match="The simulator died") as caught:
        bot.step("move_next")
    assert caught.value.failure is FailureClass.PLATFORM
    observations, result = bot.reset()
    assert result is ActionResult.SUCCESS
    assert observations["image_rgb"].shape == (32, 48, 3)


def test_an_address_of_ones_own(start_backend: StartBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    backend = start_backend()
    connection = backend.state.connection
    assert BenchBot(supervisor_address=connection.url).actions == ["move_next"]
    monkeypatch.setenv("BENCHBOT_TOKEN", "wrong")
    with pytest.raises(BenchbotError, match="does not know you"):
        BenchBot(supervisor_address=connection.url)


@pytest.mark.parametrize("address", ["https://127.0.0.1:1", "http://127.0.0.1:port", "http://", "ftp://x"])
def test_an_address_that_is_none_is_told(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_TOKEN", "token")
    with pytest.raises(BenchbotError, match="not the address"):
        BenchBot(supervisor_address=address)


def test_the_place_of_the_result_follows_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert Path(benchbot.api.RESULT_LOCATION) == tmp_path / "state" / "result.json"
    monkeypatch.setenv("BENCHBOT_RESULT", str(tmp_path / "elsewhere"))
    assert str(tmp_path / "elsewhere") == benchbot.api.RESULT_LOCATION
