"""`Agent`, which a solution implements, and `ActionResult`, which it gets after each action."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from typing import Any

from benchbot.core import channels


class ActionResult(Enum):
    """The state after an action; the values are those of BenchBot v2."""

    SUCCESS = (0,)
    """The action was carried out; go on."""
    FINISHED = (1,)
    """The action was carried out, and the trajectory of this scene is at its end."""
    COLLISION = 2
    """The robot has hit something; no action is possible any more."""


class Observations(channels.Observations, total=False):
    """A step as a solution observes it: the channels of its task, and the number of the scene, from 0."""

    scene_number: int


class Agent(ABC):
    """A solution: chooses actions from observations, knows when it is done, and saves its results."""

    last_outcome: str | None = None
    """`BenchBot.last_outcome`, as `BenchBot.run` last told it: before `is_done` and `pick_action` are called."""

    @abstractmethod
    def is_done(self, action_result: ActionResult) -> bool:
        """Say whether the current scene is done, given the result of the last action."""

    @abstractmethod
    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, Mapping[str, Any]]:
        """Return the next action and its keyword arguments, for example `("move_distance", {"distance": 0.5})`."""

    @abstractmethod
    def save_result(
        self,
        filename: str,
        empty_results: dict[str, Any],
        results_format_fns: Mapping[str, Callable[..., Any]],
    ) -> None:
        """Write the results as JSON to `filename`: `empty_results` with its `results` filled in."""
