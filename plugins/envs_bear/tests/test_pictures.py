"""Pictures of the environments: nothing burns out by day, lamps light the room by night."""

from pathlib import Path

import numpy as np
import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import Scene
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene_file import scene_file
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer

pytestmark = pytest.mark.xdist_group("renderer")

SMALL = Intrinsics.from_horizontal_fov(96, 54, 90.0)
OPTICAL = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.05], [0.0, 0.0, 0.0, 1.0]])


def pictures(name: str, kernel_cache: Path) -> tuple[np.ndarray, np.ndarray]:
    """Colours (N, H, W, 3) along the way, and the cosine between each view and the sun."""
    (environment,) = Catalog(plugin_manager.load()).environments(name)
    data = environment.data
    lighting = Lighting.from_mapping(data["lighting"])
    scene = load_scene(scene_file(environment.path.parent / data["map_path"], kernel_cache))
    renderer = Renderer(scene, lighting, cache_dir=kernel_cache)
    way = np.stack([pose.matrix() @ OPTICAL for pose in Scene(data, environment.path.parent).trajectory[::6]])
    return renderer.render_batch(way, SMALL).rgb, way[:, :3, 2] @ lighting.sun.direction


@pytest.mark.parametrize("name", ["miniroom:1", "miniroom:2"])
def test_by_day_no_more_than_one_percent_burns_out(name: str, kernel_cache: Path) -> None:
    shown, toward_sun = pictures(name, kernel_cache)
    away = shown[toward_sun < np.cos(np.radians(50.0))]  # half of the picture's diagonal
    assert len(away) > 3
    assert (away.max(axis=-1) == 255).mean(axis=(1, 2)).max() <= 0.01
    assert 90 < shown.mean() < 180


def test_by_night_lamps_light_the_room_nearly_white(kernel_cache: Path) -> None:
    shown, _ = pictures("miniroom:5", kernel_cache)
    red, _, blue = shown.mean(axis=(0, 1, 2))
    assert 70 < shown.mean() < 130
    assert 1.0 < red / blue < 1.6
