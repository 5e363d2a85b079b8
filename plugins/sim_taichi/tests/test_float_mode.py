"""A process in which pictures were taken reckons as any other."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import _float_mode
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")

SMALL = Intrinsics.from_horizontal_fov(32, 24, 90.0)
TAICHI_ALONE = (
    "import taichi, sys; taichi.init(arch=taichi.cpu); print(float('2e-311') == 0.0, sys.float_info.min / 2 == 0.0)"
)


def test_tiny_numbers_are_what_they_are_after_a_picture(tmp_path: Path, kernel_cache: Path) -> None:
    renderer = Renderer(load_scene(rooms.plaza(tmp_path / "plaza.glb")), Lighting(), cache_dir=kernel_cache)

    renderer.render(looking((-2.0, 0.0, 1.0), 0.0), SMALL)

    assert json.loads("2e-311").hex() == "0x0.003ae8249c7a2p-1022"
    assert sys.float_info.min / 2 > 0.0
    assert (np.full(100, np.finfo(np.float32).tiny) / np.float32(4) > 0).all()


def test_taichi_alone_would_make_zeros_of_them() -> None:
    """Without this, the way around it may go."""
    told = subprocess.run([sys.executable, "-c", TAICHI_ALONE], capture_output=True, text=True, check=True).stdout

    assert told.splitlines()[-1] == "True True"


def test_the_mode_is_put_back_after_a_failure_too() -> None:
    with pytest.raises(ZeroDivisionError), _float_mode.kept():
        1 / 0  # noqa: B018

    assert sys.float_info.min / 2 > 0.0
