"""What every test that renders starts from: kernels and the light of the miniroom, worked out once for all of them."""

import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

WARM = "import sys; from pathlib import Path; from benchbot_sim_taichi.warm import warm; warm(Path(sys.argv[1]))"
MINIROOM = """
import sys
from pathlib import Path
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.plugin_manager import load
from benchbot_sim_taichi.simulator import RayTracedSimulator

catalog = Catalog(load())
(room,) = catalog.environments("miniroom:1")
robot = catalog.get("robots", "carter_lowres").data
simulator = RayTracedSimulator(PlatformSpec(robot, "ground_truth", Path(sys.argv[1])))
simulator.load(Scene(room.data, room.path.parent), 0)
simulator.observe(("image_rgb", "laser"))
"""


@pytest.fixture(scope="session")
def kernel_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache folder of this worker's own, in which all kernels and the light of `miniroom:1` are.

    The worker that asks first makes it, in processes of their own: the runtime stores kernels when a process ends.
    The others copy what it made, which nobody writes to again.
    """
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    made, done = folder / "ray_tracing", folder / "ray_tracing.done"
    with (folder / "ray_tracing.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            for script in (WARM, MINIROOM):
                subprocess.run([sys.executable, "-c", script, str(made)], check=True)
            done.touch()
    return shutil.copytree(made, tmp_path_factory.mktemp("kernels") / "cache")
