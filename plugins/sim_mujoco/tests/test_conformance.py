"""The plug-in keeps the promises that `benchbot.testing` checks; pictures are small, so that they cost little."""

from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from benchbot.testing import check_plugin, check_simulator, conform
from plugins.sim_mujoco.tests.rooms import MINIROOM, ROBOTS


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-sim-mujoco"))


@pytest.mark.parametrize("localisation", ["noisy"])
def test_the_simulator_conforms(localisation: Any, tmp_path: Path) -> None:
    robot = schema.read(ROBOTS / "carter_mujoco.yaml")
    camera = {"width": 32, "height": 18, "fx": 16, "fy": 16, "cx": 16, "cy": 9}
    small = robot | {"camera": robot["camera"] | camera}
    conform(check_simulator("sim_mujoco", small, MINIROOM, localisation=localisation, cache_dir=tmp_path))
