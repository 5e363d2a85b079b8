"""What this plug-in offers; light, so that listing it costs nothing."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.plugin import Simulator, hookimpl

if TYPE_CHECKING:
    from benchbot.plugin import Platform, PlatformSpec


@hookimpl
def benchbot_robots() -> Iterable[Path]:
    """Yield the robots that are simulated."""
    yield Path(__file__).parent / "robots"


@hookimpl
def benchbot_simulators() -> Iterable[Simulator]:
    """Yield `sim_taichi`."""
    yield Simulator("sim_taichi", _create, _warm)


def _create(spec: "PlatformSpec") -> "Platform":
    from benchbot_sim_taichi.simulator import RayTracedSimulator

    return RayTracedSimulator(spec)


def _warm(cache_dir: Path) -> str:
    from benchbot_sim_taichi.warm import warm

    return warm(cache_dir)
