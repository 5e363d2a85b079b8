"""The plug-in offers its simulator and robots, and costs nothing until a robot is simulated."""

import subprocess
import sys
from pathlib import Path

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import PlatformSpec
from benchbot.core.plugin_manager import Plugins, installed
from benchbot_sim_taichi.simulator import RayTracedSimulator

LIST_EVERYTHING = """
import sys
from benchbot.core import plugin_manager
from benchbot.core.declarations import catalog
found = catalog.Catalog(plugin_manager.load())
found.plugins.pool("simulators")
found.names("robots")
print(*{"taichi", "numpy", "pygltflib", "PIL"} & set(sys.modules))
"""


def test_it_offers_a_simulator_and_five_robots() -> None:
    catalog = Catalog(Plugins([info for info in installed() if info.distribution == "benchbot-sim-taichi"]))
    assert catalog.names("robots") == ["carter", "carter_lidar", "carter_lowres", "carter_omni", "carter_realistic"]
    carter = catalog.get("robots", "carter").data
    platform = catalog.plugins.record("simulators", "sim_taichi").create(
        PlatformSpec(carter, "ground_truth", Path("unused"))
    )
    assert isinstance(platform, RayTracedSimulator)
    platform.close()


def test_listing_imports_nothing_heavy() -> None:
    listing = subprocess.run([sys.executable, "-c", LIST_EVERYTHING], capture_output=True, text=True, check=True)
    assert listing.stdout.strip() == ""


@pytest.mark.xdist_group("renderer")
def test_warming_leaves_compiled_kernels_in_the_cache(kernel_cache: Path) -> None:
    warm = Catalog(Plugins(installed())).plugins.record("simulators", "sim_taichi").warm
    assert str(kernel_cache) in warm(kernel_cache)
    assert any((kernel_cache / "kernels").rglob("*.tic"))
