"""The track: where a robot really went, noted tick by tick beside its platform and kept by the session."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.platform import Platform

ROW_DISTANCE_M, ROW_ANGLE_RAD = 0.05, math.radians(5)
"""A robot that has moved so far, or turned so far, since the last row of its track gets another one."""
COLUMNS = ("observation", "time_s", "x_m", "y_m", "yaw_rad")

_DIGITS = 6


class Waypoint(NamedTuple):
    """Where a robot was: seconds since its scene was loaded, metres and radians in the map frame."""

    time_s: float
    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(frozen=True)
class Way:
    """What was driven since the last look: its length, summed over control ticks, and places along it."""

    length_m: float = 0.0
    waypoints: tuple[Waypoint, ...] = ()


class Trail:
    """Follows a platform and sums up its way; `note` it after every control tick."""

    def __init__(self, platform: Platform) -> None:
        self._platform = platform

    def begin(self) -> None:
        """Start where the platform is now."""
        self._length_m = 0.0
        self._waypoints: list[Waypoint] = []
        self._here = self._marked = self._look()

    def note(self) -> None:
        """Take in where the last control tick has led."""
        try:
            here = self._look()
        except BenchbotError:
            # A real robot may lose its pose for a moment: whether it needs one to drive is not for a track to say.
            return
        before, self._here = self._here, here
        self._length_m += _distance_m(before, self._here)
        turned_rad = abs(wrap_angle_rad(self._here.yaw_rad - self._marked.yaw_rad))
        if _distance_m(self._marked, self._here) >= ROW_DISTANCE_M or turned_rad >= ROW_ANGLE_RAD:
            self._waypoints.append(self._here)
            self._marked = self._here

    def take(self) -> Way:
        """Return the way since this was last asked for."""
        way = Way(self._length_m, tuple(self._waypoints))
        self._length_m, self._waypoints, self._marked = 0.0, [], self._here
        return way

    def _look(self) -> Waypoint:
        return waypoint(self._platform.pose(), self._platform.clock())


class _Followed:
    """A platform whose every control tick is noted."""

    def __init__(self, platform: Platform, trail: Trail) -> None:
        self._platform = platform
        self._trail = trail

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        self._platform.drive(linear_mps, angular_radps, duration_s)
        self._trail.note()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._platform, name)


def followed(platform: Platform, trail: Trail) -> Platform:
    """Return the platform, with every control tick noted in the trail."""
    return cast(Platform, _Followed(platform, trail))


@dataclass
class Track:
    """Where the robot went in one scene: a row for each observation, and those of the ways between them."""

    scene: str
    length_m: float = 0.0
    collided: bool = False
    rows: list[tuple[int | None, Waypoint]] = field(default_factory=list)
    _here: Waypoint | None = None

    def follow(self, here: Waypoint, way: Way | None, *, collided: bool) -> None:
        """Take in where the robot is now. Without its way, it counts as straight."""
        if way is None:
            way = Way(0.0 if self._here is None else _distance_m(self._here, here))
        self.length_m += way.length_m
        self.collided |= collided
        self.rows += [(None, place) for place in way.waypoints]
        self._here = here

    def observed(self, number: int) -> None:
        """Note that the robot has observed, for the `number`-th time since its run began, where it is now."""
        if self._here is None:
            return
        if self.rows and self.rows[-1] == (None, self._here):
            self.rows.pop()
        self.rows.append((number, self._here))

    def as_dict(self, source: str) -> dict[str, Any]:
        """Return what a result says of it; `source` is whose pose it is: `simulation` or `robot`."""
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
