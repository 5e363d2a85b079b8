"""The plug-in's hooks: robots and one simulator. MuJoCo is imported when a run starts."""

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
    """Yield `sim_mujoco`."""
    yield Simulator(
        "sim_mujoco",
        create=target("benchbot_sim_mujoco.simulator:MujocoSimulator"),
        warm=target("benchbot_sim_mujoco.opengl:try_out"),
        device=target("benchbot_sim_mujoco.opengl:described"),
    )
