"""What the sample plug-in offers; light, so that listing it costs nothing."""

import os
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.plugin import AssetPack, BenchbotError, RobotDriver, Simulator, TuiScreen, hookimpl

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

    from benchbot.core.platform import Platform, PlatformSpec


@hookimpl
def benchbot_robots() -> "Iterable[Traversable]":
    """Yield `sample_robot`, `sample_careful_robot` and `sample_real_robot`."""
    yield files("benchbot_sample") / "robots"


@hookimpl
def benchbot_environments() -> "Iterable[Traversable]":
    """Yield `arena:1`, `arena:2`, and the variants of `faulty`, where something goes wrong on purpose."""
    yield files("benchbot_sample") / "environments"


@hookimpl
def benchbot_tasks() -> "Iterable[Traversable]":
    """Yield `sample:passive`, `sample:active`, `sample:noisy`, `sample:two_scenes`, `sample:goal` and `sample:lost`."""
    yield files("benchbot_sample") / "tasks"


@hookimpl
def benchbot_episodes() -> "Iterable[Traversable]":
    """Yield three ways across `arena:1`."""
    yield files("benchbot_sample") / "episodes"


@hookimpl
def benchbot_simulators() -> Iterable[Simulator]:
    """Yield `sim_sample`."""
    yield Simulator("sim_sample", _create_simulated, device=device)


@hookimpl
def benchbot_robot_drivers() -> Iterable[RobotDriver]:
    """Yield `real_sample`."""
    yield RobotDriver("real_sample", _create)


@hookimpl
def benchbot_screens() -> Iterable[TuiScreen]:
    """Yield `arenas`."""
    yield TuiScreen("arenas", "benchbot_sample.screen:ArenasScreen", "The arenas that are installed.")


@hookimpl
def benchbot_asset_packs() -> Iterable[AssetPack]:
    """Yield `sample_toys`, which holds nothing."""
    yield AssetPack("sample_toys", Path(str(files("benchbot_sample") / "assets" / "catalogue.json")))


def _create_simulated(spec: "PlatformSpec") -> "Platform":
    from benchbot_sample.simulator import TracedSimulator

    return TracedSimulator(spec)


def device(options: Mapping[str, Any]) -> str:
    """Return the device of options; there is a GPU where $SAMPLE_GPU names it."""
    gpu = os.environ.get("SAMPLE_GPU")
    if options.get("device", "auto") == "cpu" or (gpu is None and options.get("device") != "cuda"):
        return "cpu"
    if gpu is None:
        raise BenchbotError("There is no GPU here.", "$SAMPLE_GPU names none.", "Leave --device out.")
    return f"cuda: {gpu}"


def _create(spec: "PlatformSpec") -> "Platform":
    from benchbot_sample.simulator import SampleSimulator

    return SampleSimulator(spec)
