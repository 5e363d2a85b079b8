"""Path tracing against what can be worked out by hand."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi.kernels.path import BOTH, LIGHTS_ONLY, LOBES_ONLY
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.glb import Glb

pytestmark = pytest.mark.xdist_group("renderer")

TINY = Intrinsics.from_horizontal_fov(16, 12, 80.0)
UNBOUNDED = 1e9
DARK = Lighting(sun=Sun(irradiance=(0, 0, 0)), sky=Sky((0, 0, 0), (0, 0, 0), (0, 0, 0)), exposure=1.0)
WHITE = Lighting(sun=Sun(irradiance=(0, 0, 0)), sky=Sky((1, 1, 1), (1, 1, 1), (1, 1, 1)), exposure=1.0)


def exposed(renderer: Renderer, pose: np.ndarray, samples: int, **options: Any) -> npt.NDArray[Any]:
    """Mean radiance (3,) of a tiny picture, before exposure."""
    picture = path_trace(renderer, pose, TINY, samples_per_pixel=samples, brightest=UNBOUNDED, **options)
    mean: npt.NDArray[Any] = picture.mean(axis=(0, 1)) / renderer.exposure
    return mean


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.8])
def test_a_furnace_glows_with_the_sum_of_all_reflections(tmp_path: Path, kernel_cache: Path, albedo: float) -> None:
    """A closed box that emits 1 everywhere holds 1 / (1 - reflectance); at grazing angles all that is matt shines."""
    glb = Glb()
    walls = glb.material((albedo,) * 3, emission=(1.0, 1.0, 1.0), ior=1.0)
    glb.box("furnace", (-1, -1, -1), (1, 1, 1), walls, inward=True)
    renderer = Renderer(load_scene(glb.write(tmp_path / "a.glb")), DARK, cache_dir=kernel_cache)
    mean = exposed(renderer, looking((0.3, 0.2, 0.1), 30.0), 64, bounces=60)
    assert mean == pytest.approx(np.full(3, 1 / (1 - albedo)), rel=0.02)


@pytest.mark.parametrize(("metallic", "roughness"), [(1.0, 0.0), (1.0, 0.3), (1.0, 1.0), (0.0, 0.05), (0.0, 1.0)])
def test_nothing_white_gives_back_more_than_it_gets(
    tmp_path: Path, kernel_cache: Path, metallic: float, roughness: float
) -> None:
    """White furnace: a ball under an even sky is never brighter than the sky; a perfect mirror is as bright."""
    glb = Glb()
    glb.sphere("ball", (0, 0, 0), 1.0, glb.material((1, 1, 1), metallic=metallic, roughness=roughness))
    renderer = Renderer(load_scene(glb.write(tmp_path / "a.glb")), WHITE, cache_dir=kernel_cache)
    picture = (
        path_trace(renderer, looking((-1.8, 0, 0), 0.0), TINY, samples_per_pixel=256, brightest=UNBOUNDED)
        / renderer.exposure
    )
    assert picture.max() < 1.02
    if metallic == 1.0 and roughness < 0.5:
        assert picture.min() > 0.9
    if metallic == 0.0:
        assert picture[4:8, 6:10].mean() == pytest.approx(1.0, abs=0.02)


def test_both_ways_to_find_light_agree(tmp_path: Path, kernel_cache: Path) -> None:
    """Light sampling alone, lobes alone and both together have one mean: lamp, window with panes, sky and sun."""
    lighting = Lighting(sun=Sun(azimuth_deg=80.0, elevation_deg=30.0, irradiance=(1e-3,) * 3), exposure=0.5)
    glb = Glb()
    walls = glb.material((0.5, 0.5, 0.5), roughness=0.3)
    glb.box("room", (-2, -2, 0), (2, 2, 2.5), walls, inward=True)
    glb.box("lamp", (-0.6, -0.6, 2.0), (0.6, 0.6, 2.1), glb.material(emission=(2.0, 1.0, 0.5)))
    renderer = Renderer(load_scene(glb.write(tmp_path / "a.glb")), lighting, cache_dir=kernel_cache)
    pose = looking((-1.5, -1.2, 1.0), 40.0)
    both = exposed(renderer, pose, 256)
    assert exposed(renderer, pose, 256, strategies=LIGHTS_ONLY) == pytest.approx(both, rel=0.03)
    assert exposed(renderer, pose, 256, strategies=LOBES_ONLY) == pytest.approx(both, rel=0.03)


@pytest.mark.parametrize("strategies", [BOTH, LIGHTS_ONLY, LOBES_ONLY])
def test_a_closed_lamp_is_dark_within_whichever_way_light_is_found(
    tmp_path: Path, kernel_cache: Path, strategies: int
) -> None:
    """Two shells of a shade would else be an oven whose glow comes out between them at the rim."""
    glb = Glb()
    glb.box("lamp", (-1, -1, -1), (1, 1, 1), glb.material((0.8,) * 3, emission=(1.0, 1.0, 1.0)))
    renderer = Renderer(load_scene(glb.write(tmp_path / "a.glb")), DARK, cache_dir=kernel_cache)
    assert not exposed(renderer, looking((0.0, 0.0, 0.0), 0.0), 16, strategies=strategies).any()
    assert exposed(renderer, looking((-3.0, 0.0, 0.0), 0.0), 16, strategies=strategies).all()


def test_windows_found_by_chance_give_the_light_of_windows_looked_for(tmp_path: Path, kernel_cache: Path) -> None:
    lighting = Lighting(sun=Sun(irradiance=(0, 0, 0)), exposure=0.5)
    renderer = Renderer(load_scene(rooms.furnished_room(tmp_path / "room.glb")), lighting, cache_dir=kernel_cache)
    pose = looking((0.6, 0.4, 1.05), 50)
    both = exposed(renderer, pose, 512)
    assert exposed(renderer, pose, 512, strategies=LIGHTS_ONLY) == pytest.approx(both, rel=0.03)
    assert exposed(renderer, pose, 1024, strategies=LOBES_ONLY) == pytest.approx(both, rel=0.04)


def test_the_seed_decides(tmp_path: Path, kernel_cache: Path) -> None:
    renderer = Renderer(load_scene(rooms.plaza(tmp_path / "a.glb")), Lighting(exposure=0.1), cache_dir=kernel_cache)
    pose = looking((-2.0, 0.0, 1.0), 0.0)
    one, two, other = (path_trace(renderer, pose, TINY, samples_per_pixel=2, seed=seed) for seed in (5, 5, 6))
    assert one.tobytes() == two.tobytes() != other.tobytes()


def behind_glass(path: Path, lighting: Lighting, cache: Path, thickness: float, **glass: Any) -> npt.NDArray[Any]:
    """Mean radiance of a glowing wall behind a slab of glass that fills the view."""
    glb = Glb()
    glb.box("wall", (3, -1, -1), (3.1, 1, 1), glb.material((0, 0, 0), emission=(1, 1, 1), ior=1.0))
    pane = glb.material((1.0, 0.5, 0.25), glass=True, **glass)
    if thickness:
        glb.box("glass", (1, -1, -1), (1 + thickness, 1, 1), pane)
    else:
        corners = np.array([[1, 1, -1], [1, -1, -1], [1, -1, 1], [1, 1, 1]], float)
        glb.add("glass", corners, np.array([[0, 1, 2], [0, 2, 3]]), pane)
    renderer = Renderer(load_scene(glb.write(path)), lighting, cache_dir=cache)
    narrow = Intrinsics.from_horizontal_fov(8, 8, 4.0)
    picture = path_trace(renderer, looking((0, 0, 0), 0.0), narrow, samples_per_pixel=512) / renderer.exposure
    mean: npt.NDArray[Any] = picture.mean(axis=(0, 1))
    return mean


def test_a_pane_mirrors_eight_percent_and_tints_the_rest(tmp_path: Path, kernel_cache: Path) -> None:
    seen = behind_glass(tmp_path / "a.glb", DARK, kernel_cache, 0.0)
    passed = 1 - 2 * 0.04 / 1.04
    assert seen == pytest.approx(passed * np.array([1.0, 0.5, 0.25]), rel=0.02)


def test_solid_glass_mirrors_at_both_faces_and_tints_at_both(tmp_path: Path, kernel_cache: Path) -> None:
    seen = behind_glass(tmp_path / "a.glb", DARK, kernel_cache, 0.5, solid=True, ior=1.5)
    once = np.array([1.0, 0.5, 0.25]) ** 2 * 0.96**2
    inside_twice = np.array([1.0, 0.5, 0.25]) ** 2 * 0.04**2
    assert seen == pytest.approx(once * (1 + inside_twice), rel=0.02)
