"""A scene's light is worked out by another process while a first picture's kernels compile, and is the same light."""

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from plugins.sim_taichi.tests.rooms import ceiling_lamp

PICTURE = """
import sys
from pathlib import Path
import numpy as np
from benchbot.plugin import Pose
from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import irradiance, light_process, lightmap, progress
from benchbot_sim_taichi.lamps import Lamps
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer

cache, scene, picture = map(Path, sys.argv[1:])
light_process.processors = lambda: 2
{before}
renderer = Renderer(load_scene(scene), Lighting(lamps=Lamps(scale=0.5)), cache_dir=cache)
np.save(picture, renderer.render(Pose((-2.0, 0.0, 1.0)).matrix(), Intrinsics(32, 32, 16.0, 16.0, 16.0, 16.0)).rgb)
"""
BY_ANOTHER = PICTURE.format(before="progress.listen(print); irradiance.solve = lightmap.bake = None")
BY_ITSELF = PICTURE.format(before="light_process.processors = lambda: 1")
IN_VAIN = PICTURE.format(before="sys.executable = 'false'")

KILLED = PICTURE.format(
    before="""
import os, signal, subprocess

class Started(subprocess.Popen):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        print(self.pid, flush=True)

subprocess.Popen = Started
lightmap.none = lambda scene: os.kill(os.getpid(), signal.SIGKILL)
"""
)


@pytest.fixture(scope="module")
def of_one_process(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> npt.NDArray[np.uint8]:
    """The picture of a process that works out its light by itself."""
    folder = tmp_path_factory.mktemp("itself")
    return picture(BY_ITSELF, folder, kernel_cache)[0]


def picture(script: str, folder: Path, kernel_cache: Path) -> tuple[npt.NDArray[np.uint8], str]:
    """Return what a process shows, whose cache has compiled kernels alone, and what it tells."""
    cache = folder / "cache"
    shutil.copytree(kernel_cache / "kernels", cache / "kernels")
    scene = ceiling_lamp(folder / "room.glb")
    command = [sys.executable, "-c", script, *map(str, (cache, scene, folder / "picture.npy"))]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return np.load(folder / "picture.npy"), done.stdout


def test_the_light_of_another_process_is_the_same(
    tmp_path: Path, kernel_cache: Path, of_one_process: npt.NDArray[np.uint8]
) -> None:
    shown, told = picture(BY_ANOTHER, tmp_path, kernel_cache)
    assert of_one_process.std() > 1.0
    np.testing.assert_array_equal(shown, of_one_process)
    assert "the simulator lights surfaces: 0 % of" in told


def test_a_process_that_dies_is_done_without(
    tmp_path: Path, kernel_cache: Path, of_one_process: npt.NDArray[np.uint8]
) -> None:
    np.testing.assert_array_equal(picture(IN_VAIN, tmp_path, kernel_cache)[0], of_one_process)


def test_the_process_ends_with_the_one_that_asks(tmp_path: Path, kernel_cache: Path) -> None:
    with pytest.raises(subprocess.CalledProcessError) as ended:
        picture(KILLED, tmp_path, kernel_cache)
    assert ended.value.returncode == -signal.SIGKILL
    arguments = Path(f"/proc/{int(ended.value.stdout)}/cmdline")
    while arguments.exists() and arguments.read_bytes():  # which a process has none of that nobody waits for
        time.sleep(0.02)
    assert not list(tmp_path.rglob("lightmap-*.npz"))
