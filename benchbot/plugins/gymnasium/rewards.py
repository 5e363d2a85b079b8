"""Rewards of steps. They may use what the task hides, such as the true pose."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from benchbot.core.channels import Observations
from benchbot.core.documents import GroundTruth, Result
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.geometry import Pose
from benchbot.core.motion import Outcome
from benchbot.core.records import Evaluator
from benchbot.plugins.gymnasium.commands import Command


@dataclass(frozen=True)
class Transition:
    """The state after a reset or a step.

    `step` counts from 1, 0 is a reset; `command` is None then. `observations` are BenchBot's, as the platform gave them
    (docs/wire.md), of the task's channels; `observe` gives others of the same instant. `base` is the true pose of the
    robot's base in the map frame, `robot` its declaration.
    """

    step: int
    scene_number: int
    command: Command | None
    outcome: Outcome | None
    collided: bool
    base: Pose
    observations: Observations
    observe: Callable[[Iterable[str]], Observations]
    robot: Mapping[str, Any]
    distance_to_goal_m: float = math.nan
    """The straight distance from the base to the point to go to; NaN where the task has none."""
    arrived: bool = False
    """Whether the robot rests within the task's distance of its goal."""


class Reward(Protocol):
    """A function of transitions, or a callable object that remembers earlier ones.

    It is called at every reset too, with `step` 0, to start over; what it returns then is not used.
    """

    def __call__(self, transition: Transition, /) -> float:
        """Return the reward of the step; finite."""


class Collision:
    """-1 for the step that touches something, else 0."""

    def __call__(self, transition: Transition, /) -> float:
        """Return -1 at a collision."""
        return -1.0 if transition.collided else 0.0


class PointGoal:
    """The metres by which a step came nearer to the goal, less 0.01, and 2.5 for arriving.

    As in E. Wijmans et al., "DD-PPO: Learning Near-Perfect PointGoal Navigators from 2.5 Billion Frames" (ICLR 2020),
    but along the straight line, which needs no floor plan. It is 0 where the task has no point to go to.
    """

    def __init__(self, success: float = 2.5, slack: float = 0.01) -> None:
        self.success, self.slack = success, slack
        self._left_m = math.nan

    def __call__(self, transition: Transition, /) -> float:
        """Return the metres won, and what arriving is worth."""
        before_m, self._left_m = self._left_m, transition.distance_to_goal_m
        if math.isnan(self._left_m):
            return 0.0
        return before_m - self._left_m - self.slack + (self.success if transition.arrived else 0.0)


class Coverage:
    """The floor that a step's laser scan swept for the first time in this scene, in square metres.

    Rays count up to `range_m`, in square cells of `cell_m`. The laser is level: it looks over what is lower.
    """

    def __init__(self, cell_m: float = 0.1, range_m: float = 4.0) -> None:
        self.cell_m = cell_m
        self._range_m = range_m
        self._seen: set[int] = set()
        self._scene_number = 0

    def __call__(self, transition: Transition, /) -> float:
        """Return the area newly seen, m²."""
        if transition.step == 0 or transition.scene_number != self._scene_number:
            self._seen.clear()
            self._scene_number = transition.scene_number
        before = len(self._seen)
        self._seen |= self._swept(transition)
        return (len(self._seen) - before) * self.cell_m**2

    def _swept(self, transition: Transition) -> set[int]:
        laser = transition.observations.get("laser") or transition.observe(["laser"])["laser"]
        ranges_m, angles_rad = laser["scans"].T
        scanner = transition.base @ laser_in_base(transition.robot)
        x, y, _ = scanner.translation_xyz
        _, cells = self.swept_cells(ranges_m[None], angles_rad, np.array([[x, y, scanner.yaw_rad]]))
        found: NDArray[np.int64] = np.unique(cells[0] << 32 | cells[1] & 0xFFFFFFFF)
        return set(found.tolist())

    def swept_cells(
        self, ranges_m: NDArray[np.float64], angles_rad: NDArray[np.float64], scanners: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
        """Return cells (2, K) that scanners (M, 3) at x, y and yaw have swept, and the number (K,) of each's scanner.

        They come more than once. `ranges_m` (M, beams) are measured at `angles_rad` (beams,).
        """
        # Beams that are closer together than cells at the far end add nothing.
        every = max(1, math.floor(self.cell_m / self._range_m * len(angles_rad) / (2 * math.pi)))
        along_m = np.arange(0.0, self._range_m, self.cell_m / 2)
        with np.errstate(invalid="ignore"):
            free = along_m < ranges_m[:, ::every, None]  # neither NaN nor -inf is farther than anything
        row, ray, point = np.nonzero(free)
        headings = angles_rad[::every] + scanners[:, 2:]
        cosines, sines, along_m = np.cos(headings)[row, ray], np.sin(headings)[row, ray], along_m[point]
        x, y = scanners[row, 0] + along_m * cosines, scanners[row, 1] + along_m * sines
        return row, np.stack([np.floor(x / self.cell_m), np.floor(y / self.cell_m)]).astype(np.int64)


class MapQuality:
    """By how much the score of the solution's map has grown, measured by an evaluation method (such as `omq`).

    `estimate` returns the solution's result as it stands, a document as it would be saved. The ground truth comes into
    this process, which only training may do. Raises the evaluator's BenchbotError for what cannot be scored.
    """

    def __init__(
        self,
        evaluator: Evaluator,
        ground_truths: Sequence[Mapping[str, Any]],
        estimate: Callable[[], Mapping[str, Any]],
    ) -> None:
        self._evaluator = evaluator
        self._ground_truths = cast(Sequence[GroundTruth], ground_truths)
        self._estimate = estimate
        self._last = 0.0

    def __call__(self, transition: Transition, /) -> float:
        """Return the growth of the method's headline score since the last step."""
        scores = self._evaluator.evaluate(cast(Result, self._estimate()), self._ground_truths)
        score = scores[self._evaluator.headline or next(iter(scores))]
        grown, self._last = score - self._last, score
        return grown


REWARDS: dict[str, Callable[[], Reward]] = {"collision": Collision, "coverage": Coverage, "point_goal": PointGoal}
"""Rewards that can be asked for by name."""

RewardChoice = str | Mapping[str, float] | type | Reward | None


def make(choice: RewardChoice) -> Reward:
    """Return the reward that was asked for: a name, names with weights, a class to make one of, or a reward itself."""
    if choice is None:
        return lambda transition: 0.0
    if isinstance(choice, str):
        return _named(choice)
    if isinstance(choice, Mapping):
        terms = [(float(weight), _named(name)) for name, weight in choice.items()]
        return lambda transition: sum(weight * term(transition) for weight, term in terms)
    made: Reward = choice() if isinstance(choice, type) else choice
    if not callable(made):
        raise BenchbotError(
            f"{choice!r} is not a reward.",
            "A reward is called with a benchbot.gymnasium.Transition and returns a number.",
            f"Pass a function, a class, a name ({', '.join(REWARDS)}) or names with weights.",
        )
    return made


def _named(name: str) -> Reward:
    if name not in REWARDS:
        raise BenchbotError(
            f"'{name}' is not a known reward.",
            f"Known: {', '.join(REWARDS)}.{did_you_mean(name, list(REWARDS))}",
            "Use one of these, or pass a function that takes a benchbot.gymnasium.Transition.",
        )
    return REWARDS[name]()


def laser_in_base(robot: Mapping[str, Any]) -> Pose:
    """Return the pose of the laser in the robot's base frame; the base itself where none is declared."""
    place = robot.get("frames", {}).get(robot.get("laser", {}).get("frame"))
    return Pose() if place is None else Pose.from_xyz_rpy_deg(place["xyz"], place.get("rpy_deg", (0.0, 0.0, 0.0)))
