"""Host: the seam behind which a platform runs in this process, or in a child process that may crash."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, cast

from benchbot.core.channels import Observations
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Attended, Platform, Scene
from benchbot.core.track import DrivenPath, TrackedPlatform


@dataclass(frozen=True)
class Status:
    """The robot's state: true pose in the map frame, and seconds since the scene was loaded.

    `path` is what it has driven since the last status; None where no path is tracked.
    """

    pose: Pose
    clock_s: float
    collided: bool
    path: DrivenPath | None = None


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

    @property
    def heartbeat_timeout_s(self) -> float | None:
        """The longest silence of the supervisor in which the robot may move; None for a platform that needs none."""
        return self._platform.heartbeat_timeout_s if isinstance(self._platform, Attended) else None

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
        return Status(self._platform.pose(), self._platform.clock(), self._platform.collided, self._tracked.take())

    def halt(self, why: str) -> None:
        """Stop a real robot in the middle of an action, for good."""
        self._platform.halt(why)

    def close(self) -> None:
        """Stop the robot and release everything."""
        self._platform.close()
