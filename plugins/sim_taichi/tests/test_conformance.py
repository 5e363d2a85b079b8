"""The plug-in keeps the promises that `benchbot.testing` checks; pictures are small, so that they cost little."""

from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from benchbot.testing import check_plugin, check_simulator, conform
from plugins.sim_taichi.tests.test_simulator import MINIROOM, ROBOTS

ray_traced = pytest.mark.xdist_group("renderer")


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-sim-taichi"))


@ray_traced
@pytest.mark.parametrize("name", ["carter_lowres", "carter_lidar"])
def test_the_simulator_conforms(name: str, kernel_cache: Path) -> None:
    conform(check_simulator("sim_taichi", small(name), MINIROOM, cache_dir=kernel_cache))


def small(name: str) -> dict[str, Any]:
    """Return a robot with a camera of 32 x 18 pixels."""
    robot = schema.read(ROBOTS / f"{name}.yaml")
    camera = {"width": 32, "height": 18, "fx": 16, "fy": 16, "cx": 16, "cy": 9}
    return robot | {"camera": robot["camera"] | camera}
