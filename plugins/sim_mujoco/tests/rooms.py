"""Rooms and robots of the tests."""

from importlib.resources import files
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_sim_mujoco.simulator import MujocoSimulator
from plugins.sim_taichi.tests.glb import Glb

ROBOTS = Path(str(files("benchbot_sim_mujoco"))) / "robots"


def scene(path: Path, **changes: Any) -> Scene:
    """Return an environment of a GLB file, with the robot at the origin, looking along +x."""
    environment = {"name": "room", "variant": 1, "type": "sim_taichi", "map_path": path.name}
    start = {"start_pose": [1, 0, 0, 0, 0, 0, 0], "object_labels": ["crate", "table"]}
    return Scene(environment | start | changes, path.parent)


def workshop(path: Path) -> Path:
    """10 x 6 m around the origin: a crate ahead, one on a table to the left, a lamp that hangs on the right."""
    glb = Glb()
    grey, wood = glb.material(), glb.material((0.5, 0.3, 0.1))
    glb.box("floor", (-5, -3, -0.1), (5, 3, 0.0), grey)
    glb.box("wall east", (5, -3, 0), (5.1, 3, 2.5), grey)
    glb.box("wall west", (-5.1, -3, 0), (-5, 3, 2.5), grey)
    glb.box("crate", (1.35, -0.2, 0), (1.75, 0.2, 0.7), wood, class_name="crate")
    glb.box("table", (0.5, 2.0, 0), (1.5, 2.6, 0.7), wood, class_name="table")
    glb.box("small crate", (0.9, 2.2, 0.7), (1.1, 2.4, 0.9), wood, class_name="crate")
    glb.box("lamp", (-0.1, -2.1, 2.0), (0.1, -1.9, 2.2), grey)
    return glb.write(path)


def kitchen(path: Path) -> Path:
    """6 x 6 m around the origin: a table ahead, on it a block, in front, and a plate, to the left."""
    glb = Glb()
    grey, wood, red = glb.material(), glb.material((0.5, 0.3, 0.1)), glb.material((0.7, 0.1, 0.1))
    glb.box("floor", (-3, -3, -0.1), (3, 3, 0.0), grey)
    glb.box("table", (0.4, -0.5, 0.7), (1.2, 0.5, 0.74), wood, class_name="table")
    glb.box("block", (0.55, -0.03, 0.74), (0.61, 0.03, 0.83), red, class_name="cup")
    glb.box("plate", (0.5, 0.15, 0.74), (0.7, 0.35, 0.75), grey, class_name="tray")
    return glb.write(path)


def simulator(
    options: dict[str, Any] | None = None,
    cache_dir: Path = Path("unused"),
    robot_name: str = "carter_lowres_mujoco",
    **changes: Any,
) -> MujocoSimulator:
    """Return a simulator of a robot with a small camera, not yet loaded."""
    robot = schema.read(ROBOTS / f"{robot_name}.yaml") | changes
    return MujocoSimulator(PlatformSpec(robot, "ground_truth", cache_dir, options or {}))
