"""The plug-in's hooks: robots and one simulator. Taichi is imported when a run starts."""

from collections.abc import Iterable
from pathlib import Path

from benchbot.plugin import Simulator, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_robots() -> Iterable[Path]:
    """Yield the robots that are simulated."""
    yield Path(__file__).parent / "robots"


@hookimpl
def benchbot_simulators() -> Iterable[Simulator]:
    """Yield `sim_taichi`."""
    yield Simulator(
        "sim_taichi",
        create=target("benchbot_sim_taichi.simulator:RayTracedSimulator"),
        warm=target("benchbot_sim_taichi.warm:warm"),
        device=target("benchbot_sim_taichi.devices:described"),
    )
