"""What panes and cut-outs take from the light that the default quality stores and shows."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import camera_response
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.quality import FAST, REALTIME
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchbot_sim_taichi.surface_cells import CELL_STRIDE
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.glb import Glb

pytestmark = pytest.mark.xdist_group("renderer")

TINT = (0.9, 0.5, 0.25)
BLACK = Sky((0, 0, 0), (0, 0, 0), (0, 0, 0))
NOON = Lighting(sun=Sun(azimuth_deg=0, elevation_deg=90, irradiance=(5, 5, 5)), sky=BLACK, exposure=0.2)
NIGHT = Lighting(sun=Sun(irradiance=(0, 0, 0)), sky=BLACK, exposure=0.5)
HEAD_ON = 1 - 2 * 0.04 / 1.04


def passed(layers: int) -> npt.NDArray[np.float64]:
    """What so many panes let pass of light that meets them head-on."""
    return (HEAD_ON * np.array(TINT)) ** layers


def floor_below(path: Path, layers: int, lighting: Lighting, cache: Path) -> npt.NDArray[np.float64]:
    """Irradiance (3,) in the middle of a floor, below so many panes and a small lamp."""
    glb = Glb()
    glb.box("floor", (-0.8, -0.8, -0.1), (0.8, 0.8, 0.0), glb.material((0.5, 0.5, 0.5)))
    glb.box("lamp", (-0.05, -0.05, 2.9), (0.05, 0.05, 2.95), glb.material(emission=(50, 50, 50)))
    corners, quad = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], float), np.array([[0, 1, 2], [0, 2, 3]])
    for layer in range(layers):
        glb.add(f"pane {layer}", corners + np.array([0, 0, 1 + 0.5 * layer]), quad, glb.material(TINT, glass=True))
    renderer = Renderer(load_scene(glb.write(path)), lighting, cache_dir=cache)
    cells = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)
    here = (cells[:, 5] > 0.9) & (np.abs(cells[:, 2]) < 0.05) & (np.abs(np.abs(cells[:, :2]) - 0.4).max(1) < 0.2)
    mean: npt.NDArray[np.float64] = cells[here, 6:9].mean(0).astype(np.float64)
    return mean


@pytest.mark.parametrize("lighting", [NOON, NIGHT], ids=["sun", "lamp"])
@pytest.mark.parametrize("layers", [1, 2])
def test_panes_tint_and_dim_what_comes_through_them(
    tmp_path: Path, kernel_cache: Path, lighting: Lighting, layers: int
) -> None:
    bare = floor_below(tmp_path / "bare.glb", 0, lighting, kernel_cache)
    seen = floor_below(tmp_path / "panes.glb", layers, lighting, kernel_cache)
    assert seen / bare == pytest.approx(passed(layers), rel=0.02)


@pytest.mark.parametrize("quality", [REALTIME, FAST], ids=lambda quality: quality.name)
def test_a_wall_behind_a_pane_is_seen_as_paths_show_it(tmp_path: Path, kernel_cache: Path, quality: object) -> None:
    glb = Glb()
    glb.box("wall", (3, -1, -1), (3.1, 1, 1), glb.material((0, 0, 0), emission=(1, 1, 1), ior=1.0))
    glb.box("pane", (1, -1, -1), (1.01, 1, 1), glb.material(TINT, glass=True))
    scene = load_scene(glb.write(tmp_path / "a.glb"))
    renderer = Renderer(scene, NIGHT, cache_dir=kernel_cache, quality=quality)  # type: ignore[arg-type]
    picture = renderer.render(looking((0, 0, 0), 0.0), Intrinsics.from_horizontal_fov(32, 32, 4.0))
    paths = Renderer(scene, NIGHT, cache_dir=kernel_cache)
    radiance = path_trace(
        paths, looking((0, 0, 0), 0.0), Intrinsics.from_horizontal_fov(8, 8, 4.0), samples_per_pixel=64
    )
    assert (radiance / paths.exposure).mean((0, 1)) == pytest.approx(passed(2), rel=0.05)
    without = Renderer(load_scene(wall(tmp_path / "b.glb", passed(2))), NIGHT, cache_dir=kernel_cache, quality=quality)  # type: ignore[arg-type]
    without.exposure = renderer.exposure  # white is not the same where a pane tints what it mirrors
    same = without.render(looking((0, 0, 0), 0.0), Intrinsics.from_horizontal_fov(32, 32, 4.0))
    assert picture.rgb.mean((0, 1)) == pytest.approx(same.rgb.mean((0, 1)), abs=2)


def wall(path: Path, radiance: npt.NDArray[np.float64]) -> Path:
    glb = Glb()
    emission = (float(radiance[0]), float(radiance[1]), float(radiance[2]))
    glb.box("wall", (3, -1, -1), (3.1, 1, 1), glb.material((0, 0, 0), emission=emission, ior=1.0))
    return glb.write(path)


def test_clear_glass_cannot_be_seen_in_even_light(tmp_path: Path, kernel_cache: Path) -> None:
    """What each of its layers does not let pass it mirrors, of light that is the same from everywhere."""
    even = Lighting(sun=Sun(irradiance=(0, 0, 0)), sky=Sky((1, 1, 1), (1, 1, 1), (1, 1, 1)), exposure=0.3)
    scene = load_scene(rooms.bottle(tmp_path / "bottle.glb"))
    renderer = Renderer(scene, even, cache_dir=kernel_cache)
    frame = renderer.render(looking((0.0, -1.0, 0.0), 90.0, 0.0), Intrinsics.from_horizontal_fov(96, 72, 40.0))

    assert (frame.instance > 0).mean() > 0.1
    assert np.ptp(frame.rgb) <= 1


def test_what_is_not_cut_out_casts_a_shadow(tmp_path: Path, kernel_cache: Path) -> None:
    sun = Sun(azimuth_deg=180, elevation_deg=10, irradiance=(5, 5, 5))
    scene = load_scene(rooms.fence(tmp_path / "fence.glb"))
    renderer = Renderer(scene, Lighting(sun=sun, sky=BLACK, exposure=0.2), cache_dir=kernel_cache)
    cells = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)
    behind = (cells[:, 3] < -0.9) & (np.abs(cells[:, 0] - 3) < 0.05) & (np.abs(cells[:, 2] - 1) < 0.5)
    kept, cut = (behind & (np.abs(cells[:, 1] - y) < 0.3) for y in (0.5, -0.5))
    assert kept.any()
    assert (cells[kept, 22] == 0).all()
    assert (cells[cut, 22] == 1).all()
    assert cells[cut, 6].mean() > 20 * cells[kept, 6].mean()


def test_a_window_to_a_narrow_yard_lights_its_room_and_a_screen_before_a_window_does_not(
    tmp_path: Path, kernel_cache: Path
) -> None:
    """A fifth of the ways out of the window lead to the sky: as many as of a house with a courtyard."""
    glb = Glb()
    grey, black = glb.material((0.6,) * 3), glb.material((0, 0, 0), ior=1.0)
    glb.box("ground", (-1, -2, -0.2), (4, 6, 0), grey)
    glb.box("ceiling", (0, 0, 2.5), (3, 3, 2.6), grey)
    for name, low, high in (
        ("left", (-0.1, 0, 0), (0, 6, 2.6)),
        ("right", (3, 0, 0), (3.1, 6, 2.6)),
        ("back", (0, -0.1, 0), (3, 0, 2.6)),
        ("below", (0, 3, 0), (3, 3.1, 1)),
        ("above", (0, 3, 2), (3, 3.1, 2.6)),
    ):
        glb.box(name, low, high, grey)
    glb.box("opposite", (0, 5.4, 0), (3, 5.5, 4), black)
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    for name, y, bottom, top in (("pane", 3.05, 1, 2), ("screen", 2.2, 0, 2)):
        corners = np.array([[0, y, bottom], [3, y, bottom], [3, y, top], [0, y, top]], float)
        glb.add(name, corners, quad, glb.material((1, 1, 1), glass=True))
    sky = Lighting(sun=Sun(irradiance=(0, 0, 0)), sky=Sky((1, 1, 1), (1, 1, 1), (0, 0, 0)), exposure=1.0)
    renderer = Renderer(load_scene(glb.write(tmp_path / "yard.glb")), sky, cache_dir=kernel_cache)
    camera, pose = Intrinsics.from_horizontal_fov(24, 24, 20.0), looking((1.5, 1.5, 1.2), 90.0, -35.0)

    assert renderer.device.lights[2] == 2
    paths = path_trace(renderer, pose, camera, samples_per_pixel=256)
    seen = renderer.render(pose, camera).rgb.astype(float)
    wanted = camera_response.srgb_bytes(camera_response.filmic(paths)).astype(float)
    assert seen.mean((0, 1)) == pytest.approx(wanted.mean((0, 1)), abs=6)


def test_sunshine_that_a_pane_mirrors_leaves_no_dapples(tmp_path: Path, kernel_cache: Path) -> None:
    """The sun falls on a sill alone; few rays from the wall beside it are mirrored there by the pane above it."""
    glb = Glb()
    white = glb.material((0.8,) * 3)
    for name, low, high in (
        ("floor", (0, 0, -0.1), (3, 3.1, 0)),
        ("ceiling", (0, 0, 2.5), (3, 3.1, 2.6)),
        ("left", (-0.1, 0, 0), (0, 3.1, 2.6)),
        ("right", (3, 0, 0), (3.1, 3.1, 2.6)),
        ("back", (0, -0.1, 0), (3, 0, 2.6)),
        ("below", (0, 2.7, 0), (3, 3.1, 1)),
        ("above", (0, 2.7, 1.8), (3, 3.1, 2.6)),
        ("beside", (0, 2.7, 0), (1, 3.1, 2.6)),
    ):
        glb.box(name, low, high, white)
    corners = np.array([[1, 3.05, 1], [3, 3.05, 1], [3, 3.05, 1.8], [1, 3.05, 1.8]], float)
    glb.add("pane", corners, np.array([[0, 1, 2], [0, 2, 3]]), glb.material((1, 1, 1), glass=True))
    sun = Lighting(sun=Sun(azimuth_deg=90, elevation_deg=70, irradiance=(50, 50, 50)), sky=BLACK)
    renderer = Renderer(load_scene(glb.write(tmp_path / "sill.glb")), sun, cache_dir=kernel_cache)
    seen = renderer.render(looking((1.5, 1.5, 1.4), 180.0), Intrinsics.from_horizontal_fov(64, 64, 60.0)).rgb[..., 1]
    tiles = seen.astype(float).reshape(8, 8, 8, 8)
    assert (tiles.max((1, 3)) - tiles.min((1, 3))).max() <= 12  # the slope is 8
