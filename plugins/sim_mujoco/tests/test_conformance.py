"""The plug-in keeps the promises that `benchbot.testing` checks; pictures are small, so that they cost little."""

from pathlib import Path

from benchbot.core.declarations import schema
from benchbot.testing import check_plugin, check_simulator, conform
from plugins.sim_mujoco.tests.rooms import ROBOTS, scene, workshop


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-sim-mujoco"))


def test_the_simulator_conforms(tmp_path: Path) -> None:
    robot = schema.read(ROBOTS / "carter_mujoco.yaml")
    camera = {"width": 32, "height": 18, "fx": 16, "fy": 16, "cx": 16, "cy": 9}
    room = scene(workshop(tmp_path / "workshop.glb"))
    declared = {**room.environment, "map_path": str(tmp_path / "workshop.glb")}
    small = robot | {"camera": robot["camera"] | camera}
    conform(check_simulator("sim_mujoco", small, declared, localisation="noisy", cache_dir=tmp_path / "cache"))
