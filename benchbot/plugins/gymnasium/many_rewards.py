"""The rewards with a name, of many environments at once: the same numbers as `rewards` gives each of them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from benchbot.core.channels import Observations
from benchbot.core.geometry import Pose
from benchbot.plugins.gymnasium.rewards import REWARDS, Coverage, PointGoal, RewardChoice, Transition

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Transitions:
    """`rewards.Transition` of M environments, the numbers of which are `robots`.

    `scan` returns the laser's ranges and angles (beams, 2) of the m-th of them, `base` its true pose.
    """

    robots: Indices
    collided: NDArray[np.bool_]
    distance_to_goal_m: Floats
    arrived: NDArray[np.bool_]
    scan: Callable[[int], NDArray[np.float64]]
    base: Callable[[int], Pose]
    declaration: Mapping[str, Any]


class ManyReward(Protocol):
    """A reward of N environments. It is called at every reset too, with `reset`, and what it returns then is unused."""

    def __call__(self, transitions: Transitions, /, *, reset: bool) -> Floats:
        """Return the rewards (M,) of the environments."""


class ManyCollision:
    """`rewards.Collision`."""

    def __init__(self, count: int) -> None:
        pass

    def __call__(self, transitions: Transitions, /, *, reset: bool) -> Floats:
        """Return -1 where something is touched."""
        return np.where(transitions.collided, -1.0, 0.0)


class ManyPointGoal:
    """`rewards.PointGoal`."""

    def __init__(self, count: int) -> None:
        self._one = PointGoal()
        self._left_m = np.full(count, math.nan)

    def __call__(self, transitions: Transitions, /, *, reset: bool) -> Floats:
        """Return the metres won, and what arriving is worth."""
        robots, left_m = transitions.robots, transitions.distance_to_goal_m
        won = self._left_m[robots] - left_m - self._one.slack + np.where(transitions.arrived, self._one.success, 0.0)
        self._left_m[robots] = left_m
        return np.where(np.isnan(left_m), 0.0, won)


class ManyCoverage:
    """`rewards.Coverage`, one environment after the other."""

    def __init__(self, count: int) -> None:
        self._ones = [Coverage() for _ in range(count)]

    def __call__(self, transitions: Transitions, /, *, reset: bool) -> Floats:
        """Return the areas newly seen, m²."""
        rewards = []
        for row, robot in enumerate(transitions.robots.tolist()):
            seen = cast(Observations, {"laser": {"scans": transitions.scan(row)}})
            here = transitions.base(row)
            step = 0 if reset else 1
            one = Transition(step, 0, None, None, False, here, seen, lambda _: seen, transitions.declaration)  # noqa: B023 - not kept
            rewards.append(self._ones[robot](one))
        return np.array(rewards, np.float64)


_MANY: dict[str, Callable[[int], ManyReward]] = {
    "collision": ManyCollision,
    "coverage": ManyCoverage,
    "point_goal": ManyPointGoal,
}


def make(choice: RewardChoice, count: int) -> ManyReward | None:
    """Return the reward of `count` environments; None for one that is asked of each by itself, such as a function."""
    if choice is None:
        return lambda transitions, /, *, reset: np.zeros(len(transitions.robots))
    if isinstance(choice, str):
        return _MANY[choice](count) if choice in REWARDS else None
    if not isinstance(choice, Mapping) or any(name not in REWARDS for name in choice):
        return None
    terms: Sequence[tuple[float, ManyReward]] = [(float(weight), _MANY[name](count)) for name, weight in choice.items()]

    def summed(transitions: Transitions, /, *, reset: bool) -> Floats:
        total = np.zeros(len(transitions.robots))
        for weight, term in terms:
            total = total + weight * term(transitions, reset=reset)
        return total

    return summed
