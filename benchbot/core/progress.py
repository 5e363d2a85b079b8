"""Progress of a session: the state of its scene, the answer to each step, and counters."""

import time
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from benchbot.core.budget import Spent
from benchbot.core.errors import FailureClass
from benchbot.core.motion import Outcome

if TYPE_CHECKING:
    from benchbot.core.channels import Observations
else:
    # A recording's process decodes steps by their types, and takes channels of a platform's own as well.
    Observations = dict[str, Any]


class State(StrEnum):
    """The state of the current scene. `failed` means that the episode cannot go on: see the failure class."""

    CLEAN = "clean"
    DIRTY = "dirty"
    COLLIDED = "collided"
    FINISHED = "finished"
    FAILED = "failed"


class ActionResult(StrEnum):
    """The result of a step, as a solution is told it."""

    SUCCESS = "SUCCESS"
    FINISHED = "FINISHED"
    COLLISION = "COLLISION"


@dataclass(frozen=True)
class Step:
    """The answer to a step: observations by channel, the result, and the actions that may follow."""

    observations: Observations
    result: ActionResult
    actions: tuple[str, ...]
    state: State
    scene_number: int
    outcome: Outcome | None = None


@dataclass
class Progress:
    """The part of a session's state that can be watched while it runs.

    `failure_fix` is the remedy of a platform's failure. `ends_run` says that it is a safety stop: there is no way back.
    `waiting_for` is what the operator of a real robot is asked to do before it can go on, `preparing` what a simulator
    does where that takes long. `before` is what the episode had spent when the robot was put back.
    """

    state: State = State.CLEAN
    scene_number: int = 0
    steps: int = 0
    trajectory_index: int = 0
    trajectory_length: int = 0
    last_action: str | None = None
    pose_xyyaw: tuple[float, float, float] = (0.0, 0.0, 0.0)
    simulated_time_s: float = 0.0
    """By the robot's clock, since the reset: real seconds when `time_is_simulated` is false."""
    frames: int = 0
    looks: int = 0
    collisions: int = 0
    path_length_m: float = 0.0
    before: Spent = Spent()  # noqa: RUF009 - it is frozen
    failure: FailureClass | None = None
    failure_why: str | None = None
    failure_fix: str | None = None
    ends_run: bool = False
    waiting_for: str | None = None
    preparing: str | None = None
    time_is_simulated: bool = True
    started_s: float = field(default_factory=time.monotonic)
    paused_since_s: float | None = None
    paused_s: float = 0.0
    """Seconds for which it was paused, without the pause that there may be now."""

    @property
    def spent(self) -> Spent:
        """What the episode has spent, over all its attempts."""
        if not self.frames:  # the time until there is something to see is nobody's
            return self.before
        counts = self.steps, self.looks, 0, self.collisions, self.path_length_m
        return self.before + Spent(*counts, self.simulated_time_s, self.wall_time_s)

    @property
    def time_key(self) -> str:
        """The key of the robot's time in documents: of a real robot it is not called simulated."""
        return "simulated_time_s" if self.time_is_simulated else "robot_time_s"

    @property
    def wall_time_s(self) -> float:
        """Seconds since the session began, without those in which it was paused."""
        now_s = time.monotonic()
        since_s = self.paused_since_s
        return (now_s if since_s is None else since_s) - self.started_s - self.paused_s

    @property
    def paused(self) -> bool:
        """True while the solution's next step is held back."""
        return self.paused_since_s is not None

    def pause(self) -> None:
        """Stop the clock, unless it stands still already."""
        if self.paused_since_s is None:
            self.paused_since_s = time.monotonic()

    def go_on(self) -> None:
        """Let the clock run, unless it runs already."""
        since_s = self.paused_since_s
        if since_s is not None:
            self.paused_s += time.monotonic() - since_s
            self.paused_since_s = None
