"""The option `quality`: which there are, and that nothing but colours depends on it."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import quality
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import PATH, REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

POSES = np.stack([looking((0.6, 0.4, 1.05), 50), looking((3.4, 0.4, 1.3), 130)])
SMALL = Intrinsics.from_horizontal_fov(48, 32, 90.0)


def test_options_choose_a_quality() -> None:
    assert quality.from_options({}) == REALTIME
    assert quality.from_options({"quality": "path", "device": "cpu"}) == PATH
    assert quality.from_options({"quality": "reference", "samples": 64}) == Quality("reference", 64)


@pytest.mark.parametrize(
    ("options", "title"),
    [
        ({"quality": "reltime"}, "no quality 'reltime'"),
        ({"quality": None}, "no quality None"),
        ({"samples": 4}, "samples says nothing in the quality realtime"),
        ({"quality": "path", "samples": 0}, "samples is no number of paths"),
        ({"quality": "path", "samples": True}, "samples is no number of paths"),
        ({"quality": "path", "samples": "4"}, "samples is no number of paths"),
    ],
)
def test_mistakes_are_named(options: dict[str, Any], title: str) -> None:
    with pytest.raises(BenchbotError, match=title):
        quality.from_options(options)


@pytest.mark.xdist_group("renderer")
def test_qualities_differ_in_colours_only(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    batches = {
        chosen.name: Renderer(scene, Lighting(), cache_dir=kernel_cache, quality=chosen).render_batch(POSES, SMALL)
        for chosen in (REALTIME, Quality("path", 4), Quality("reference", 48))
    }
    fast = batches["realtime"]
    for name, batch in batches.items():
        assert batch.depth_m.tobytes() == fast.depth_m.tobytes(), name
        assert batch.instance.tobytes() == fast.instance.tobytes(), name
        # Alike at a glance: means of 8 x 8 tiles, and few samples have their noise.
        tiles = [pictures.rgb.reshape(2, 4, 8, 6, 8, 3).mean(axis=(2, 4)) for pictures in (batch, fast)]
        difference = float(np.abs(tiles[0] - tiles[1]).mean())
        assert difference < 14, name
    assert len({batch.rgb.tobytes() for batch in batches.values()}) == 3


@pytest.mark.xdist_group("renderer")
def test_denoising_brings_a_picture_closer_to_the_converged_one(tmp_path: Path, kernel_cache: Path) -> None:
    assert find_spec("pyoidn") is not None
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    converged, denoised = (
        Renderer(scene, Lighting(), cache_dir=kernel_cache, quality=Quality(*chosen)).render(POSES[0], SMALL).rgb
        for chosen in (("reference", 512), ("path", 8))
    )
    noisy = Renderer(scene, Lighting(), cache_dir=kernel_cache, quality=Quality("reference", 8)).render(POSES[0], SMALL)
    error = [np.sqrt(np.mean((picture.astype(float) - converged) ** 2)) for picture in (denoised, noisy.rgb)]
    assert error[0] < 0.7 * error[1]
