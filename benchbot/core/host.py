"""Host: the seam behind which a platform runs in this process, or in a child process that may crash."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, cast

from benchbot.core.channels import Observations
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Platform, Scene, TakeOver
from benchbot.core.track import DrivenPath, TrackedPlatform


@dataclass(frozen=True)
class Status:
    """The robot's state: true pose in the map frame, and seconds since the scene was loaded.

    `path` is what it has driven since the last status; None where no path is tracked. `taken_over_s` says for how
    long a person has had it, each time since the last status.
    """

    pose: Pose
    clock_s: float
    collided: bool
    path: DrivenPath | None = None
    taken_over_s: tuple[float, ...] = ()


class Host(Protocol):
    """Loads scenes, executes whole actions and observes; every method may raise BenchbotError(failure="platform")."""

    def load(self, scene_index: int, seed: int) -> Status:
        """Put the robot into the clean start state of a scene of the selection."""

    def act(self, action: str, arguments: Mapping[str, float], goal: Pose | None) -> tuple[Outcome, Status]:
        """Execute one action to its end; `goal` is the trajectory pose that `move_next` drives to."""

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels, all of one instant. The arrays are the caller's to keep."""

    def halt(self, why: str) -> None:
        """Stop a real robot in the middle of an action, for good; called from another thread."""

    def close(self) -> None:
        """Stop the robot and release everything. Safe to call twice."""


class InProcessHost:
    """A host in the caller's own process: no isolation, no overhead."""

    def __init__(self, platform: Platform, scenes: Sequence[Scene], motion: MotionConfig) -> None:
        self._platform = platform
        self._scenes = scenes
        self._motion = motion
        self._tracked = TrackedPlatform(platform)

    def change_scenes(self, scenes: Sequence[Scene]) -> None:
        """Use other scenes from the next `load` on."""
        self._scenes = scenes

    def load(self, scene_index: int, seed: int) -> Status:
        """Put the robot into the clean start state of a scene of the selection."""
        self._platform.load(self._scenes[scene_index], seed)
        self._tracked.begin()
        return self.status()

    def act(self, action: str, arguments: Mapping[str, float], goal: Pose | None) -> tuple[Outcome, Status]:
        """Execute one action to its end."""
        outcome = execute(cast(Platform, self._tracked), action, arguments, goal, self._motion)
        return outcome, self.status()

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels, all of one instant."""
        return self._platform.observe(channels)

    def status(self) -> Status:
        """Return the robot's state."""
        platform = self._platform
        pose, clock_s = platform.pose(), platform.clock()
        taken_over_s = platform.taken_over_s() if isinstance(platform, TakeOver) else ()
        return Status(pose, clock_s, platform.collided, self._tracked.take(), taken_over_s)

    def halt(self, why: str) -> None:
        """Stop a real robot in the middle of an action, for good."""
        self._platform.halt(why)

    def close(self) -> None:
        """Stop the robot and release everything."""
        self._platform.close()
