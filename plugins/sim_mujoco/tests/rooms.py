"""Rooms and robots of the tests."""

from importlib.resources import files
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_sim_mujoco.simulator import MujocoSimulator

ROBOTS = Path(str(files("benchbot_sim_mujoco"))) / "robots"
MINIROOM = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"


def room(**changes: Any) -> Scene:
    """Return miniroom:1, with changes."""
    return Scene(schema.read(MINIROOM) | changes, MINIROOM.parent)


def simulator(options: dict[str, Any] | None = None, **changes: Any) -> MujocoSimulator:
    """Return a simulator of a robot with a small camera, not yet loaded."""
    robot = schema.read(ROBOTS / "carter_lowres_mujoco.yaml") | changes
    return MujocoSimulator(PlatformSpec(robot, "ground_truth", Path("unused"), options or {}))
