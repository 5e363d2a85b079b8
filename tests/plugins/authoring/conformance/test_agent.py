"""The first example conforms as a class and as a command; each agent that breaks one promise is found out."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.api import ActionResult, Agent, Observations
from benchbot.plugins.examples import hello_passive
from benchbot.testing import check_agent
from tests.plugins.authoring.conformance.reading import all_is_well, broken, warned


class Passive(Agent):
    def is_done(self, action_result: ActionResult) -> bool:
        return action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, Any]]:
        return "move_next", {}

    def save_result(
        self, filename: str, empty_results: dict[str, Any], results_format_fns: Mapping[str, Callable[..., Any]]
    ) -> None:
        Path(filename).write_text(json.dumps(empty_results))


def test_a_class_and_a_command_conform() -> None:
    assert all_is_well(check_agent(Passive))
    assert all_is_well(check_agent([sys.executable, hello_passive.__file__]))


def test_an_agent_is_tried_in_the_task_that_it_is_for() -> None:
    assert "'move_next' is not an action of the task 'sample:active'" in str(
        broken(check_agent(Passive, "sample:active"))
    )


class NeverDone(Passive):
    def is_done(self, action_result: ActionResult) -> bool:
        return False

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, Any]]:
        return "move_angle", {"angle": 10.0}


class GoesOn(Passive):
    def is_done(self, action_result: ActionResult) -> bool:
        return action_result is ActionResult.FINISHED


class SavesNothing(Passive):
    def save_result(self, filename: str, *_: Any) -> None:
        pass


class SavesNonsense(Passive):
    def save_result(self, filename: str, *_: Any) -> None:
        Path(filename).write_text(json.dumps({"results": {"objects": [{}], "class_list": []}}))


class NeedsTwoScenes(Passive):
    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, Any]]:
        if observations["scene_number"]:
            raise IndexError("only one scene")
        return "move_next", {}


class IsLazy(Passive):
    def is_done(self, action_result: ActionResult) -> bool:
        return True


class WandersByChance(Passive):
    random = np.random.default_rng(0)

    def __init__(self) -> None:
        self.left = 3

    def is_done(self, action_result: ActionResult) -> bool:
        self.left -= 1
        return self.left < 0 or super().is_done(action_result)

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, Any]]:
        return "move_angle", {"angle": float(self.random.uniform(-90, 90))}


@pytest.mark.parametrize(
    ("agent", "task", "subject", "words"),
    [
        (NeverDone, "sample:active", "to the end", "has not come to an end"),
        (GoesOn, None, "after a collision", "unavailable due to: COLLISION"),
        (SavesNothing, None, "to the end", "saved no result"),
        (SavesNonsense, None, "to the end", "breaks the format"),
        (NeedsTwoScenes, None, "two scenes", "only one scene"),
    ],
)
def test_a_broken_promise_is_found_out(agent: type[Agent], task: str | None, subject: str, words: str) -> None:
    assert words in broken(check_agent(agent, task, steps=20))[subject]


def test_an_agent_that_does_nothing_or_anything_is_warned() -> None:
    assert "took no action" in warned(check_agent(IsLazy))["to the end"]
    assert "acts differently" in warned(check_agent(WandersByChance, "sample:active"))["run again"]


def test_a_task_that_is_not_there_is_told_before_anything_runs() -> None:
    assert list(broken(check_agent(Passive, "sample:pasive"))) == ["task"]


def test_a_command_that_hangs_is_ended() -> None:
    findings = check_agent([sys.executable, "-c", "import time; time.sleep(600)"], timeout_s=1.0)
    assert "has not come to an end" in broken(findings)["to the end"]
