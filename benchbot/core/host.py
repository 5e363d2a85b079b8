"""Host: the seam behind which a platform runs in this process, or in a child process that may crash."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, cast

from benchbot.core.channels import Observations
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Attended, Platform, Scene, TakeOver, Traceable, WholeActions, Witness, Witnessed
from benchbot.core.track import DrivenPath, TrackedPlatform


@dataclass(frozen=True)
class Status:
    """The robot's state: true pose in the map frame, and seconds since the scene was loaded.

    `path` is what it has driven since the last status; None where no path is tracked. `robot` is what the result
    says of a real robot (`provenance.robot`), None of a simulated one; `machine` is what a simulated one runs on, for
    `provenance.machine`. `at_end` says whether its way is over; None where the trajectory says so.
    `taken_over_s` says for how long a person has had it, each time since the last status. `witnessed` is the truth
    about what the robot can move.
    """

    pose: Pose
    clock_s: float
    collided: bool
    path: DrivenPath | None = None
    robot: dict[str, Any] | None = None
    at_end: bool | None = None
    taken_over_s: tuple[float, ...] = ()
    machine: dict[str, Any] = field(default_factory=dict)
    witnessed: Witnessed | None = None


class Host(Protocol):
    """Loads scenes, executes whole actions and observes; every method may raise BenchbotError(failure="platform")."""

    def prepare(self) -> None:
        """Have a real robot diagnosed before anything moves it; raises BenchbotError when it is broken."""

    def load(self, scene_index: int, seed: int) -> Status:
        """Put the robot into the clean start state of a scene of the selection."""

    def act(self, action: str, arguments: Mapping[str, Any], goal: Pose | None) -> tuple[Outcome, Status]:
        """Execute one action to its end; `goal` is the trajectory pose that `move_next` drives to."""

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels, all of one instant. The arrays are the caller's to keep."""

    def halt(self, why: str) -> None:
        """Stop a real robot in the middle of an action, for good; called from another thread."""

    def close(self) -> None:
        """Stop the robot and release everything. Safe to call twice."""


class InProcessHost:
    """A host in the caller's own process: no isolation, no overhead. `diagnosis` is that of a real robot."""

    def __init__(
        self,
        platform: Platform,
        scenes: Sequence[Scene],
        motion: MotionConfig,
        diagnosis: Mapping[str, Any] | None = None,
    ) -> None:
        self._platform = platform
        self._scenes = scenes
        self._motion = motion
        self._diagnosis = diagnosis
        self._tracked = TrackedPlatform(platform)

    def prepare(self) -> None:
        """Do nothing: whoever made the platform has looked at it."""

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

    def act(self, action: str, arguments: Mapping[str, Any], goal: Pose | None) -> tuple[Outcome, Status]:
        """Execute one action to its end."""
        if isinstance(self._platform, WholeActions):
            return Outcome(self._platform.act(action)), self.status()
        outcome = execute(cast(Platform, self._tracked), action, arguments, goal, self._motion)
        return outcome, self.status()

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels, all of one instant."""
        return self._platform.observe(channels)

    def status(self) -> Status:
        """Return the robot's state."""
        platform = self._platform
        robot = None if self._diagnosis is None else dict(self._diagnosis)
        traced = dict(platform.provenance()) if isinstance(platform, Traceable) else None
        if robot is not None and traced is not None:
            robot["driver"] = traced
        pose, clock_s = platform.pose(), platform.clock()
        taken_over_s = platform.taken_over_s() if isinstance(platform, TakeOver) else ()
        machine = (traced or {}) if robot is None else {}
        witnessed = platform.witnessed() if isinstance(platform, Witness) else None
        driven = self._tracked.take()
        status = Status(pose, clock_s, platform.collided, driven, robot, None, taken_over_s, machine, witnessed)
        if not isinstance(platform, WholeActions):
            return status
        path = None if platform.driven_m is None else DrivenPath(platform.driven_m)
        return replace(status, path=path, at_end=platform.at_end)

    def halt(self, why: str) -> None:
        """Stop a real robot in the middle of an action, for good."""
        self._platform.halt(why)

    def close(self) -> None:
        """Stop the robot and release everything."""
        self._platform.close()
