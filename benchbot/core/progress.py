"""What a session tells: the state of its scene, the answer to each step, and its progress."""

import time
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from benchbot.core.errors import FailureClass
from benchbot.core.motion import Outcome


class State(StrEnum):
    """Where the current scene stands. `failed` means that the episode cannot go on: see the failure class."""

    CLEAN = "clean"
    DIRTY = "dirty"
    COLLIDED = "collided"
    FINISHED = "finished"
    FAILED = "failed"


class ActionResult(StrEnum):
    """What a solution is told after each step."""

    SUCCESS = "SUCCESS"
    FINISHED = "FINISHED"
    COLLISION = "COLLISION"


@dataclass(frozen=True)
class Step:
    """What a solution gets back: observations by channel, the result, and what it may do next."""

    observations: dict[str, Any]
    result: ActionResult
    actions: tuple[str, ...]
    state: State
    scene_number: int
    outcome: Outcome | None = None


@dataclass
class Progress:
    """What can be watched of a session from outside while it runs.

    `ends_run` says that the failure is a safety stop: there is no way back. `waiting_for` is what the operator of a
    real robot is asked to do before it can go on.
    """

    state: State = State.CLEAN
    scene_number: int = 0
    steps: int = 0
    trajectory_index: int = 0
    trajectory_length: int = 0
    last_action: str | None = None
    pose_xyyaw: tuple[float, float, float] = (0.0, 0.0, 0.0)
    simulated_time_s: float = 0.0
    frames: int = 0
    failure: FailureClass | None = None
    failure_why: str | None = None
    ends_run: bool = False
    waiting_for: str | None = None
    started_s: float = field(default_factory=time.monotonic)
    paused_since_s: float | None = None
    paused_s: float = 0.0
    """How long it was paused, before the pause that there may be now."""

    @property
    def wall_time_s(self) -> float:
        """Seconds since the session began, without those in which it was paused."""
        now_s = time.monotonic()
        since_s = self.paused_since_s
        return (now_s if since_s is None else since_s) - self.started_s - self.paused_s

    @property
    def paused(self) -> bool:
        """Whether whoever runs it holds the solution's next step."""
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
