"""Commands to the robot in one step, and the default action space that stands for them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from benchbot.core.channels import ACTIONS, MANIPULATION
from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean
from benchbot.core.selection import Selection

NEXT_SCENE = "next_scene"
ROUNDING = 1e-5
"""By how much the argument of a float32 policy may exceed 1."""


@dataclass(frozen=True)
class Move:
    """An action of the task with its argument in its own unit (m, degrees), or `next_scene`."""

    action: str
    argument: float = 0.0


@dataclass(frozen=True)
class Velocity:
    """A velocity that is held for a while, in whole control ticks of the platform; the robot need not stop after it."""

    linear_mps: float
    angular_radps: float
    duration_s: float


Command = Move | Velocity


def action_names(selection: Selection) -> tuple[str, ...]:
    """Return the action of each number of the `action` space: the task's, in the order of `channels.ACTIONS`.

    A task of several scenes has one more at the end: `next_scene`. Raises BenchbotError for a task that moves an arm.
    """
    arm = [name for name in selection.actions if name in MANIPULATION]
    if arm:
        raise BenchbotError(
            f"The task '{selection.task.name}' is no environment of Gymnasium.",
            f"Its action {arm[0]} takes several numbers, and an action here has one.",
            "Write a solution with benchbot.api, or choose a task whose actions move a base.",
        )
    names = tuple(name for name in ACTIONS if name in selection.actions)
    return (*names, NEXT_SCENE) if len(selection.environments) > 1 else names


def action_space(names: tuple[str, ...]) -> spaces.Dict:
    """Return `{action: Discrete(n), argument: Box(-1, 1, (1,))}`; no `argument` when no action has one."""
    space: dict[str, spaces.Space[Any]] = {"action": spaces.Discrete(len(names))}
    if any(_has_argument(name) for name in names):
        space["argument"] = spaces.Box(-1.0, 1.0, (1,), np.float32)
    return spaces.Dict(space)


def known(move: Move, names: tuple[str, ...]) -> Move:
    """Return a move that the task has; raises BenchbotError for another."""
    if move.action not in names:
        raise BenchbotError(
            f"This task has no action '{move.action}'.",
            f"Its actions: {', '.join(names)}.{did_you_mean(move.action, list(names))}",
            "Choose moves of these, or another task.",
        )
    return move


@dataclass(frozen=True)
class Goal:
    """The point that a robot has to go to in the map frame, metres, and how near is there."""

    x: float
    y: float
    success_m: float

    @classmethod
    def of(cls, selection: Selection) -> "Goal | None":
        """Return the goal of a selection's episode; None where it has no point to go to."""
        episode = selection.episode
        if episode is None or "position" not in episode.data["goal"]:
            return None
        x, y, *_ = episode.data["goal"]["position"]
        return cls(float(x), float(y), float(episode.listed.data["success_distance_m"]))

    def distance_m(self, x: float, y: float) -> float:
        """Return the straight distance from a place."""
        away_x, away_y = x - self.x, y - self.y
        return math.sqrt(away_x * away_x + away_y * away_y)

    def reached(self, distance_m: float) -> bool:
        """Return whether a robot at rest at this distance has arrived."""
        return distance_m <= self.success_m


def decode(
    action: Any, names: tuple[str, ...], largest: Mapping[str, float], moves: Sequence[Move] | None = None
) -> Command:
    """Return the command that an element of the action space stands for; a command stands for itself.

    `largest` is the value of an argument of 1, by action, in its own unit; `moves` are those of discrete actions.
    Raises BenchbotError for anything else.
    """
    if isinstance(action, Move | Velocity):
        return action
    if moves is not None:
        number = int(action)
        if not 0 <= number < len(moves):
            raise BenchbotError(
                f"There is no move {number}.",
                f"The moves: {', '.join(f'{i} {move.action} {move.argument:g}' for i, move in enumerate(moves))}.",
                "Take an element of env.action_space.",
                failure=FailureClass.AGENT,
            )
        return moves[number]
    try:
        number = int(action["action"])
        share = float(np.asarray(action["argument"]).item()) if "argument" in action else 0.0
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise _wrong(action, names, f"It cannot be read ({type(error).__name__}: {error}).") from error
    if not 0 <= number < len(names):
        raise _wrong(action, names, f"There is no action {number}.")
    if not abs(share) <= 1.0 + ROUNDING:
        raise _wrong(action, names, f"The argument {share} is not between -1 and 1.")
    name = names[number]
    return Move(name, share * largest[name]) if _has_argument(name) else Move(name)


def _has_argument(name: str) -> bool:
    return name != NEXT_SCENE and ACTIONS[name].argument is not None


def _wrong(action: Any, names: tuple[str, ...], why: str) -> BenchbotError:
    numbers = ", ".join(f"{number} {name}" for number, name in enumerate(names))
    return BenchbotError(
        f"{action!r} is not an action of this environment.",
        f"{why} The actions: {numbers}.",
        "Take an element of env.action_space, such as env.action_space.sample(), or a Move or Velocity.",
        failure=FailureClass.AGENT,
    )
