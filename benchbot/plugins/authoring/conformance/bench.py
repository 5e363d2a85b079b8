"""What platforms are tried on: one robot in one scene."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchbot.core import resources
from benchbot.core.channels import GIVEN_BY_EPISODES, OBSERVATIONS
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.platform import Localisation, Platform, PlatformSpec, Scene
from benchbot.plugins.authoring.conformance.properties import Wrong

Declared = str | Path | Mapping[str, Any]
"""A declaration: its name among what is installed, its file, or its content."""

SEED = 7


@dataclass(frozen=True)
class Bench:
    """A way to make platforms of one robot, and the scene that it is put into."""

    create: Callable[[PlatformSpec], Platform]
    spec: PlatformSpec
    scene: Scene
    real: bool = False
    position_tolerance_m: float = 0.02
    angle_tolerance_rad: float = 0.04

    @property
    def channels(self) -> tuple[str, ...]:
        """What the robot offers to observe."""
        return tuple(
            name for name in OBSERVATIONS if name in self.spec.robot["connections"] and name not in GIVEN_BY_EPISODES
        )

    @contextmanager
    def fresh(self) -> Iterator[Platform]:
        """Make a platform, and close it at the end."""
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
        """Return the way from one pose to another."""
        x, y, _ = (before.inverse() @ after).translation_xyz
        return cls(x, y, wrap_angle_rad(after.yaw_rad - before.yaw_rad))


@dataclass(frozen=True)
class Found:
    """A declaration and the folder that its paths are relative to."""

    data: Mapping[str, Any] = field(hash=False)
    folder: Path
    path: Path | None = None
    distribution: str = "benchbot"


def find(kind: str, declared: Declared, catalog: Catalog | None = None) -> Found:
    """Return a declaration of a pool (`robots`, …) by name, by file or as it is; raises BenchbotError, as schemas do.

    What is given as it is has its paths relative to the current folder. Names are those of the `catalog`, by default
    of what is installed, read anew.
    """
    from benchbot.core.declarations.catalog import KINDS
    from benchbot.core.plugin_manager import load

    if isinstance(declared, Mapping):
        schema.check(dict(declared), KINDS[kind], Path(f"(the {KINDS[kind]} that is checked)"))
        return Found(declared, Path.cwd())
    if isinstance(declared, Path):
        document = schema.read(declared)
        schema.check(document, KINDS[kind], declared)
        return Found(document, declared.parent, declared)
    declaration: Declaration = (catalog or Catalog(load())).get(kind, declared)
    return Found(declaration.data, declaration.path.parent, declaration.path, declaration.distribution)


def bench_of(
    create: Callable[[PlatformSpec], Platform],
    robot: Declared,
    environment: Declared,
    localisation: Localisation = "ground_truth",
    cache_dir: Path | None = None,
    **settings: Any,
) -> Bench:
    """Return the bench for a robot in an environment; the cache is the user's unless one is given."""
    place = find("environments", environment)
    cache = cache_dir or resources.cache_dir()
    ask = print if settings.get("real") else None
    spec = PlatformSpec(find("robots", robot).data, localisation, cache, place.data.get("options", {}), ask=ask)
    return Bench(create, spec, Scene(place.data, place.folder), **settings)


def drive(platform: Platform, linear_mps: float, angular_radps: float, duration_s: float) -> Moved:
    """Hold a command for a while, come to rest, and return how far the base has moved."""
    before = platform.pose()
    period_s = platform.control_period_s
    for _ in range(max(1, round(duration_s / period_s))):
        platform.drive(linear_mps, angular_radps, period_s)
    rest(platform)
    return Moved.between(before, platform.pose())


def rest(platform: Platform) -> None:
    """Brake until the robot is at rest; raises `Wrong` for one that does not come to rest within five seconds."""
    started_s = platform.clock()
    while max(map(abs, platform.velocity)) > 1e-3:
        if platform.clock() - started_s > 5.0:
            raise Wrong(
                f"It still moves at {platform.velocity} after five seconds of drive(0, 0, …).",
                "Brake as fast as the robot's limits allow, and say in `velocity` how fast it really is.",
            )
        platform.drive(0.0, 0.0, platform.control_period_s)
