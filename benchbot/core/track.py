"""Track: where a robot really went, noted after every control tick of its platform and kept by the session."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from benchbot.core.documents import TrackedScene
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.motion import Outcome
from benchbot.core.platform import Platform

ROW_DISTANCE_M, ROW_ANGLE_RAD = 0.05, math.radians(5)
"""Distance and angle from the last row of a track at which another row is added."""
COLUMNS = ("observation", "time_s", "x_m", "y_m", "yaw_rad")

_DIGITS = 6


class Waypoint(NamedTuple):
    """A place on a track: seconds since the scene was loaded, metres and radians in the map frame."""

    time_s: float
    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(frozen=True)
class DrivenPath:
    """A path that was driven: its length, summed over control ticks, and waypoints along it."""

    length_m: float = 0.0
    waypoints: tuple[Waypoint, ...] = ()


class TrackedPlatform:
    """A platform that sums up its own path, control tick by control tick, from `begin` on."""

    def __init__(self, platform: Platform) -> None:
        self._platform = platform

    def __getattr__(self, name: str) -> Any:
        return getattr(self._platform, name)

    def begin(self) -> None:
        """Start the path where the platform is now."""
        self._length_m = 0.0
        self._waypoints: list[Waypoint] = []
        self._here = self._marked = self._waypoint()

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Apply one control tick, and add the pose after it to the path."""
        self._platform.drive(linear_mps, angular_radps, duration_s)
        self._follow()

    def navigate(self, goal: Pose) -> Iterator[Outcome | None]:
        """Follow a platform that navigates to a pose by itself."""
        for outcome in getattr(self._platform, "navigate", lambda _: ())(goal):
            self._follow()
            yield outcome

    def take(self) -> DrivenPath:
        """Return the path that was driven since the last call, or since `begin`."""
        path = DrivenPath(self._length_m, tuple(self._waypoints))
        self._length_m, self._waypoints, self._marked = 0.0, [], self._here
        return path

    def _follow(self) -> None:
        try:
            here = self._waypoint()
        except BenchbotError:
            # A real robot may lose its pose for a moment: whether it needs one to drive is not for a track to say.
            return
        self._length_m += _distance_m(self._here, here)
        self._here = here
        turned_rad = abs(wrap_angle_rad(here.yaw_rad - self._marked.yaw_rad))
        if _distance_m(self._marked, here) >= ROW_DISTANCE_M or turned_rad >= ROW_ANGLE_RAD:
            self._waypoints.append(here)
            self._marked = here

    def _waypoint(self) -> Waypoint:
        return waypoint(self._platform.pose(), self._platform.clock())


@dataclass
class Track:
    """The robot's path in one scene: a row for each observation, and rows for the waypoints between them."""

    scene: str
    length_m: float = 0.0
    collided: bool = False
    rows: list[tuple[int | None, Waypoint]] = field(default_factory=list)
    _here: Waypoint | None = None

    def follow(self, here: Waypoint, path: DrivenPath | None, *, collided: bool) -> None:
        """Add the path that led to `here`; where it is not known, it counts as straight."""
        if path is None:
            path = DrivenPath(0.0 if self._here is None else _distance_m(self._here, here))
        self.length_m += path.length_m
        self.collided |= collided
        self.rows += [(None, place) for place in path.waypoints]
        self._here = here

    def observed(self, number: int) -> None:
        """Add the row of an observation, the `number`-th since the run began, taken where the robot is now."""
        if self._here is None:
            return
        if self.rows and self.rows[-1] == (None, self._here):
            self.rows.pop()
        self.rows.append((number, self._here))

    def as_dict(self, source: str) -> TrackedScene:
        """Return the track as a result has it; `source` says whose pose it is: `simulation`, `robot` or `recording`."""
        return {
            "scene": self.scene,
            "source": source,
            "path_length_m": round(self.length_m, _DIGITS),
            "collisions": int(self.collided),
            "columns": list(COLUMNS),
            # Adding zero makes one of minus zero.
            "rows": [[number, *(round(value, _DIGITS) + 0.0 for value in place)] for number, place in self.rows],
        }


def waypoint(pose: Pose, clock_s: float) -> Waypoint:
    """Return the waypoint of a robot whose base has this pose."""
    x, y, _ = pose.translation_xyz
    return Waypoint(clock_s, x, y, pose.yaw_rad)


def _distance_m(a: Waypoint, b: Waypoint) -> float:
    return math.hypot(b.x_m - a.x_m, b.y_m - a.y_m)
