"""The rewards with a name, of many environments at once: the same numbers as `rewards` gives each of them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from benchbot.core.geometry import Pose
from benchbot.plugins.gymnasium.rewards import REWARDS, Coverage, PointGoal, RewardChoice, laser_in_base

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
SWEPT_AT_ONCE = 64  # about 2 MB of working memory each


@dataclass(frozen=True)
class Transitions:
    """`rewards.Transition` of M environments, the numbers of which are `robots`.

    `scans` returns the laser's ranges (M, beams) of all of them, `base` the true pose of the m-th.
    """

    robots: Indices
    collided: NDArray[np.bool_]
    distance_to_goal_m: Floats
    arrived: NDArray[np.bool_]
    scans: Callable[[], Floats]
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
    """`rewards.Coverage`: a map of what each environment has seen, of one size for all, which grows."""

    def __init__(self, count: int) -> None:
        self._one = Coverage()
        self._seen = np.zeros((count, 0, 0), bool)
        self._first = np.zeros(2, np.int64)

    def __call__(self, transitions: Transitions, /, *, reset: bool) -> Floats:
        """Return the areas newly seen, m²."""
        robots = transitions.robots
        if not len(robots):
            return np.zeros(0)
        ranges_m = transitions.scans()
        angles_rad = np.linspace(-np.pi, np.pi, ranges_m.shape[1], endpoint=False)
        scanners = [transitions.base(row) @ laser_in_base(transitions.declaration) for row in range(len(robots))]
        places = np.array([(*each.translation_xyz[:2], each.yaw_rad) for each in scanners])
        if reset:
            self._seen[robots] = False
        counts = np.zeros(len(robots), np.int64)
        for first in range(0, len(robots), SWEPT_AT_ONCE):
            some = slice(first, first + SWEPT_AT_ONCE)
            row, cells = self._one.swept_cells(ranges_m[some], angles_rad, places[some])
            self._grow(cells)
            _, columns, lines = self._seen.shape
            column, line = cells - self._first[:, None]
            seen, place = self._seen.reshape(-1), (robots[some][row] * columns + column) * lines + line
            is_new = ~seen[place]
            _, once = np.unique(place[is_new], return_index=True)
            seen[place[is_new]] = True
            counts[some] = np.bincount(row[is_new][once], minlength=len(counts[some]))
        areas_m2: Floats = counts.astype(np.float64) * self._one.cell_m**2
        return areas_m2

    def _grow(self, cells: NDArray[np.int64]) -> None:
        """Make room for cells (2, K)."""
        if not cells.size:
            return
        low, high, size = cells.min(1), cells.max(1) + 1, np.array(self._seen.shape[1:])
        if size.all():
            low, high = np.minimum(low, self._first), np.maximum(high, self._first + size)
        if (low == self._first).all() and (high - low == size).all():
            return
        larger = np.zeros((len(self._seen), *(high - low)), bool)
        if size.all():
            x, y = self._first - low
            larger[:, x : x + size[0], y : y + size[1]] = self._seen
        self._seen, self._first = larger, low


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
