"""Track: where a robot really went, noted after every control tick of its platform and kept by the session."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

from benchbot.core.documents import TrackedScene
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.motion import Outcome
from benchbot.core.platform import Holonomic, Platform, Witnessed

ROW_DISTANCE_M, ROW_ANGLE_RAD = 0.05, math.radians(5)
"""Distance and angle from the last row of a track at which another row is added."""
COLUMNS = ("observation", "time_s", "x_m", "y_m", "yaw_rad")

OBJECT_COLUMNS = ("time_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
OBJECT_ROW_M, OBJECT_ROW_QUATERNION = 1e-3, 1e-3
"""By how much an object's position, or a part of its quaternion, differs from its last row where another is added."""

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

    def drive_sideways(
        self, lateral_mps: float, angular_radps: float, duration_s: float, linear_mps: float = 0.0
    ) -> None:
        """Apply one control tick of a holonomic base, and add the pose after it to the path."""
        cast(Holonomic, self._platform).drive_sideways(lateral_mps, angular_radps, duration_s, linear_mps)
        self._follow()

    def navigate(self, goal: Pose) -> Iterator[Outcome | None]:
        """Follow a platform that navigates to a pose by itself."""
        for outcome in getattr(self._platform, "navigate", lambda _: ())(goal):
            self._follow()
            yield outcome

    def manipulate(self, action: str, arguments: Mapping[str, Any]) -> Iterator[str | None]:
        """Follow a platform whose arm moves; raises BenchbotError where it has none."""
        move = getattr(self._platform, "manipulate", None)
        if move is None:
            raise BenchbotError(
                f"The robot has no arm for '{action}'.",
                "Its declaration connects this action, and its simulator or driver moves a base only.",
                f"Remove '{action}' from the robot's connections, or give it a type that moves arms.",
                failure=FailureClass.PLATFORM,
            )
        for outcome in move(action, arguments):
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
    _objects: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    _witnessed: Witnessed | None = None

    def follow(self, here: Waypoint, path: DrivenPath | None, *, collided: bool) -> None:
        """Add the path that led to `here`; where it is not known, it counts as straight."""
        if path is None:
            path = DrivenPath(0.0 if self._here is None else _distance_m(self._here, here))
        self.length_m += path.length_m
        self.collided |= collided
        self.rows += [(None, place) for place in path.waypoints]
        self._here = here

    def witness(self, witnessed: Witnessed | None, time_s: float) -> None:
        """Add a row for each object that has moved since its last one."""
        if witnessed is None:
            return
        self._witnessed = witnessed
        for name, pose in witnessed.objects.items():
            rows = self._objects.setdefault(name, [])
            row = (time_s, *pose.translation_xyz, *pose.rotation_xyzw)
            if not rows or not _is_near(rows[-1], row):
                rows.append(row)

    def observed(self, number: int) -> None:
        """Add the row of an observation, the `number`-th since the run began, taken where the robot is now."""
        if self._here is None:
            return
        if self.rows and self.rows[-1] == (None, self._here):
            self.rows.pop()
        self.rows.append((number, self._here))

    def as_dict(self, source: str) -> TrackedScene:
        """Return the track as a result has it; `source` says whose pose it is: `simulation`, `robot` or `recording`."""
        witnessed = self._witnessed
        moved: dict[str, Any] = {}
        if witnessed is not None:
            moved["objects"] = [
                {"name": name, "columns": list(OBJECT_COLUMNS), "rows": [_rounded(row) for row in rows]}
                for name, rows in self._objects.items()
            ]
            moved["held"] = sorted(witnessed.held)
            moved["energy_j"] = round(witnessed.energy_j, _DIGITS)
            moved["end_effector_path_m"] = round(witnessed.end_effector_path_m, _DIGITS)
        return {
            "scene": self.scene,
            "source": source,
            "path_length_m": round(self.length_m, _DIGITS),
            "collisions": int(self.collided),
            "columns": list(COLUMNS),
            "rows": [[number, *_rounded(place)] for number, place in self.rows],
            **moved,  # type: ignore[typeddict-item]
        }


def _rounded(row: tuple[float, ...]) -> list[float]:
    # Adding zero makes one of minus zero.
    return [round(value, _DIGITS) + 0.0 for value in row]


def _is_near(row: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return math.dist(row[1:4], other[1:4]) < OBJECT_ROW_M and all(
        abs(one - two) < OBJECT_ROW_QUATERNION for one, two in zip(row[4:], other[4:], strict=True)
    )


def waypoint(pose: Pose, clock_s: float) -> Waypoint:
    """Return the waypoint of a robot whose base has this pose."""
    x, y, _ = pose.translation_xyz
    return Waypoint(clock_s, x, y, pose.yaw_rad)


def _distance_m(a: Waypoint, b: Waypoint) -> float:
    return math.hypot(b.x_m - a.x_m, b.y_m - a.y_m)
