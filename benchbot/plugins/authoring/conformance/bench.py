"""Finding the subject of a check, and the test bench for platforms: one robot in one scene."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from benchbot.core import resources
from benchbot.core.channels import GIVEN_BY_EPISODES, OBSERVATIONS
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import KINDS, Catalog, Declaration, name_of
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.light_records import Executor, Recorder
from benchbot.core.platform import Localisation, Platform, PlatformSpec, Scene
from benchbot.core.plugin_manager import load
from benchbot.core.records import Evaluator, RobotDriver, Simulator
from benchbot.plugins.authoring.conformance.properties import Violation

Declared = str | Path | Mapping[str, Any]
"""A declaration: its name among what is installed, its file, or its content."""

Record = TypeVar("Record", Evaluator, Executor, Recorder, RobotDriver, Simulator)

SEED = 7
LARGEST_SEED = 2**256 - 1
"""The largest that a platform is loaded with: a run with a secret has keys of 256 bits."""


def find_record(kind: str, record: Record | str) -> Record:
    """Return a record as it is given, or by its name among the installed ones of a kind (`evaluators`, …)."""
    if isinstance(record, str):
        installed: Record = load().record(kind, record)
        return installed
    return record


def find_declaration(kind: str, declared: Declared, catalog: Catalog | None = None) -> Declaration:
    """Return a declaration of a pool (`robots`, …) by name, by file or by content; raises BenchbotError, as schemas do.

    Paths in content are relative to the current folder. Names are those of the `catalog`, by default of what is
    installed, read anew.
    """
    if isinstance(declared, str):
        return (catalog or Catalog(load())).get(kind, declared)
    if isinstance(declared, Path):
        path, data = declared, schema.read(declared)
    else:
        path, data = Path(f"(the {KINDS[kind]} that is checked)"), dict(declared)
    schema.check(data, KINDS[kind], path)
    return Declaration(kind, name_of(kind, data, path), path, "benchbot", data)


@dataclass(frozen=True)
class Bench:
    """A way to create platforms of one robot, and the scene that it is put into."""

    create: Callable[[PlatformSpec], Platform]
    spec: PlatformSpec
    scene: Scene
    real: bool = False
    position_tolerance_m: float = 0.02
    angle_tolerance_rad: float = 0.04

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that the robot offers to observe."""
        return tuple(
            name for name in OBSERVATIONS if name in self.spec.robot["connections"] and name not in GIVEN_BY_EPISODES
        )

    @contextmanager
    def fresh(self) -> Iterator[Platform]:
        """Create a platform, and close it at the end."""
        platform = self.create(self.spec)
        try:
            yield platform
        finally:
            platform.close()


@dataclass(frozen=True)
class Moved:
    """How far the base has moved in its own frame: metres ahead and to the left, and radians counter-clockwise."""

    ahead_m: float
    left_m: float
    turned_rad: float

    @classmethod
    def between(cls, before: Pose, after: Pose) -> "Moved":
        """Return the motion from one pose to another."""
        x, y, _ = (before.inverse() @ after).translation_xyz
        return cls(x, y, wrap_angle_rad(after.yaw_rad - before.yaw_rad))

    @property
    def distance_m(self) -> float:
        """The length of the straight line."""
        return math.hypot(self.ahead_m, self.left_m)


def make_bench(
    create: Callable[[PlatformSpec], Platform],
    robot: Declared,
    environment: Declared,
    localisation: Localisation = "ground_truth",
    cache_dir: Path | None = None,
    **settings: Any,
) -> Bench:
    """Return the bench for a robot in an environment; the cache is the user's unless one is given."""
    place = find_declaration("environments", environment)
    cache = cache_dir or resources.cache_dir()
    ask = print if settings.get("real") else None
    declared = find_declaration("robots", robot).data
    spec = PlatformSpec(declared, localisation, cache, place.data.get("options", {}), ask=ask)
    return Bench(create, spec, Scene(place.data, place.path.parent), **settings)


def drive(platform: Platform, linear_mps: float, angular_radps: float, duration_s: float) -> Moved:
    """Hold a command for some seconds, brake, and return how far the base has moved."""
    before = platform.pose()
    period_s = platform.control_period_s
    for _ in range(max(1, round(duration_s / period_s))):
        platform.drive(linear_mps, angular_radps, period_s)
    rest(platform)
    return Moved.between(before, platform.pose())


def rest(platform: Platform) -> None:
    """Brake until the robot is at rest; raises `Violation` for one that does not come to rest within five seconds."""
    started_s = platform.clock()
    while max(map(abs, platform.velocity)) > 1e-3:
        if platform.clock() - started_s > 5.0:
            raise Violation(
                f"It still moves at {platform.velocity} after five seconds of drive(0, 0, …).",
                "Brake as fast as the robot's limits allow, and say in `velocity` how fast it really is.",
            )
        platform.drive(0.0, 0.0, platform.control_period_s)
