"""Compiled kernels are kept on disk, by whichever processes, and found there again."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from benchbot_sim_taichi import kernel_cache as kept
from plugins.sim_taichi.tests.rooms import ceiling_lamp
from tests.ray_tracing import WARM

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

DEPTH = """
import sys
from pathlib import Path
from benchbot.plugin import Pose
from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer

cache, scene = map(Path, sys.argv[1:])
renderer = Renderer(load_scene(scene), Lighting(), cache_dir=cache)
renderer.render(Pose((0.0, 0.0, 1.0)).matrix(), Intrinsics(16, 16, 8.0, 8.0, 8.0, 8.0), rgb=False)
"""
"""Compiles some kernels, which takes a fraction of the time of all."""
WITHOUT_HASTE = "import benchbot_sim_taichi._front_end as front_end; front_end.hasten = lambda taichi: None; " + WARM

KILLED_AFTER_ITS_FIRST_FRAME = (
    MINIROOM.replace('("image_rgb", "laser")', '("image_depth", "laser")')
    + "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
)


KILLED_BEFORE_ITS_KERNELS_RUN = DEPTH.replace(
    "cache, scene",
    """import os, signal
from benchbot_sim_taichi.kernels import first_hits
launch = type(first_hits.meet._primal).launch_kernel
def killed(kernel, *arguments):
    if kernel.func.__name__ == "meet":
        os.kill(os.getpid(), signal.SIGKILL)
    return launch(kernel, *arguments)
type(first_hits.meet._primal).launch_kernel = killed
cache, scene""",
    1,
)


def kernels(cache: Path) -> dict[str, int]:
    """When each compiled kernel was written, by the hash that it is found by."""
    return {path.name: path.stat().st_mtime_ns for path in (cache / "kernels").glob("T*.tic")}


def warm(cache: Path, script: str = WARM, *arguments: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", script, str(cache), *map(str, arguments)])


def test_several_processes_may_fill_the_cache_at_once(tmp_path: Path, kernel_cache: Path) -> None:
    scene = ceiling_lamp(tmp_path / "room.glb")
    processes = [warm(tmp_path, DEPTH, scene) for _ in range(2)]
    assert [process.wait() for process in processes] == [0, 0]
    filled = kernels(tmp_path)
    assert filled
    assert filled.keys() <= kernels(kernel_cache).keys(), "where other tests of this process may have added theirs"
    assert warm(tmp_path, DEPTH, scene).wait() == 0
    assert kernels(tmp_path) == filled, "all that were asked for were there"


def test_processes_that_are_killed_after_their_first_frame_have_not_compiled_in_vain(tmp_path: Path) -> None:
    processes = [warm(tmp_path, KILLED_AFTER_ITS_FIRST_FRAME) for _ in range(2)]
    assert [process.wait() for process in processes] == [-signal.SIGKILL] * 2
    compiled = kernels(tmp_path)
    assert compiled
    assert warm(tmp_path, KILLED_AFTER_ITS_FIRST_FRAME).wait() == -signal.SIGKILL
    assert kernels(tmp_path) == compiled, "all that were asked for were there"
    assert not (tmp_path / "kernels" / kept.LOCK).exists()


def test_a_process_that_is_killed_before_it_takes_a_frame_has_not_compiled_in_vain(
    tmp_path: Path, kernel_cache: Path
) -> None:
    scene = ceiling_lamp(tmp_path / "room.glb")
    assert warm(tmp_path, KILLED_BEFORE_ITS_KERNELS_RUN, scene).wait() == -signal.SIGKILL
    compiled = kernels(tmp_path)
    assert compiled
    assert compiled.keys() <= kernels(kernel_cache).keys()


def test_a_run_after_warming_compiles_nothing(tmp_path: Path, demo: Path) -> None:
    shutil.copytree(demo / "cache", tmp_path, dirs_exist_ok=True)
    warmed = kernels(tmp_path)
    assert warmed
    for options in ({}, {"quality": "fast"}, {"quality": "path", "samples": 1}):
        run = MINIROOM.replace("Path(sys.argv[1]))", f"Path(sys.argv[1]), {options})")
        assert run != MINIROOM
        assert warm(tmp_path, run).wait() == 0
        assert kernels(tmp_path) == warmed


def test_kernels_are_the_same_for_any_number_of_threads_and_whether_or_not_taichis_front_end_is_hastened(
    tmp_path: Path, kernel_cache: Path
) -> None:
    cache = tmp_path / "cache"
    shutil.copytree(kernel_cache, cache)
    before = kernels(cache)
    for threads, script in (("1", WARM), ("3", WITHOUT_HASTE)):
        command = [sys.executable, "-c", script, str(cache)]
        subprocess.run(command, env={**os.environ, "TI_CPU_MAX_NUM_THREADS": threads}, check=True)
        assert kernels(cache) == before, "workers of few threads find those of a machine with many"


def test_the_lock_of_a_process_that_was_killed_while_it_wrote_is_taken_away(tmp_path: Path) -> None:
    lock = kept.prepare(tmp_path) / kept.LOCK
    lock.touch()
    kept.prepare(tmp_path)
    assert lock.exists(), "whoever made it may still be writing"
    long_ago = time.time() - 2 * kept.LONGEST_LOCK_S
    os.utime(lock, (long_ago, long_ago))
    kept.prepare(tmp_path)
    assert not lock.exists()
