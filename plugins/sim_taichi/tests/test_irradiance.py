"""Light that cells of surfaces hold, where it can be reckoned by hand or traced by paths."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi.lamps import Lamps
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.reflectance import ALBEDO_STEPS, albedo_table
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchbot_sim_taichi.surface_cells import CELL_STRIDE
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.8])
def test_a_closed_room_holds_as_much_light_as_its_lamp_gives(tmp_path: Path, kernel_cache: Path, albedo: float) -> None:
    """Energy balance: all surfaces together get power of the lamp / (1 - reflectance)."""
    radiance, radius, width = 100.0, 0.05, 2.0
    scene = load_scene(rooms.lit_box(tmp_path / "box.glb", albedo, radiance, radius, width))
    renderer = Renderer(scene, Lighting(exposure=0.1), cache_dir=kernel_cache)
    power = np.pi * radiance * 4 * np.pi * radius**2
    cells = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)
    cells = cells[np.abs(cells[:, :3]).max(axis=1) > 0.9 * width / 2]  # without those of the lamp
    # Of light from all about, the surface itself mirrors what `reflectance` says of the roughest.
    cosine = np.linspace(0.0, 1.0, ALBEDO_STEPS) ** 2
    scale, bias = albedo_table().reshape(ALBEDO_STEPS, ALBEDO_STEPS, 2)[-1].T
    mirrored = float(np.trapezoid(2.0 * cosine * (0.04 * scale + bias), cosine))
    reflectance = (1.0 - mirrored) * albedo + mirrored
    # Cells at edges are smaller and darker; light that has been reflected is the same everywhere, near enough.
    distance = np.linalg.norm(cells[:, :3], axis=1)
    cosine = -(cells[:, :3] * cells[:, 3:6]).sum(axis=1) / distance
    straight = np.pi * radiance * radius**2 * (cosine / distance**2).mean()
    reflected = power / (6 * width**2) * reflectance / (1 - reflectance)
    assert cells[:, 6:9].mean() == pytest.approx(straight + reflected, rel=0.02)


def test_light_stays_in_its_room(tmp_path: Path, kernel_cache: Path) -> None:
    """Cells of the ceiling reach across the wall, and so do those that they are averaged with."""
    scene = load_scene(rooms.lit_and_dark_room(tmp_path / "rooms.glb"))
    renderer = Renderer(scene, Lighting(exposure=0.1), cache_dir=kernel_cache)
    cells = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)
    ceiling = cells[(np.abs(cells[:, :2]).max(axis=1) < 0.9) & (cells[:, 2] > 0.9) & (cells[:, 5] < -0.9)]
    beside, lit, dark = (
        ceiling[rows, 6] for rows in (np.abs(ceiling[:, 0] + 0.1) < 0.04, ceiling[:, 0] < -0.05, ceiling[:, 0] > 0.05)
    )

    assert dark.max() < 0.02 * lit.mean()
    assert beside.mean() > 0.9 * ceiling[np.abs(ceiling[:, 0] + 0.2) < 0.04, 6].mean()


def test_a_floor_under_an_even_sky_gets_pi_times_its_radiance(tmp_path: Path, kernel_cache: Path) -> None:
    even = Sky(zenith=(1.0, 1.0, 1.0), horizon=(1.0, 1.0, 1.0), ground=(0.0, 0.0, 0.0))
    lighting = Lighting(sun=Sun(irradiance=(0.0, 0.0, 0.0)), sky=even, exposure=1.0)
    renderer = Renderer(load_scene(rooms.plaza(tmp_path / "plaza.glb")), lighting, cache_dir=kernel_cache)
    values = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)
    open_floor = (values[:, 5] > 0.9) & (np.abs(values[:, 0:2]).max(axis=1) > 2.0) & (values[:, 2] < 0.1)
    assert values[open_floor, 6].mean() == pytest.approx(np.pi, rel=0.02)


def test_a_windows_light_reaches_the_room_and_falls_off(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    renderer = Renderer(scene, Lighting(lamps=Lamps(on=())), cache_dir=kernel_cache)
    values = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)
    floor = (values[:, 5] > 0.9) & (np.abs(values[:, 2]) < 0.05) & (np.abs(values[:, 0] - 1.0) < 0.4)
    near = values[floor & (values[:, 1] > 2.0) & (values[:, 1] < 2.6), 12].mean()
    far = values[floor & (values[:, 1] < 0.6), 12].mean()
    assert near > 1.5 * far > 0


def test_light_on_the_outer_sill_stays_outdoors(tmp_path: Path, kernel_cache: Path) -> None:
    """The pane stands within a cell, which holds some of the sill on either side of it."""
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb", pane_color=(0.02, 0.02, 0.02)))
    lighting = Lighting(sun=Sun(azimuth_deg=90.0, elevation_deg=50.0), lamps=Lamps(on=()))
    values = Renderer(scene, lighting, cache_dir=kernel_cache).irradiance.cells.reshape(-1, CELL_STRIDE)
    sill = values[(values[:, 5] > 0.9) & (np.abs(values[:, 2] - 0.9) < 0.02) & (np.abs(values[:, 0] - 1.6) < 0.3)]

    inside = sill[sill[:, 1] < 3.045, 6]

    assert len(inside) > 0
    assert inside.max() < 0.1 * lighting.sun.irradiance[0]


def test_the_open_skys_light_on_the_outer_sill_stays_outdoors(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb", pane_color=(0.02, 0.02, 0.02)))
    dull = Lighting(sun=Sun(irradiance=(0.0,) * 3), sky=Sky(*[(1.0,) * 3] * 3), lamps=Lamps(on=()), exposure=1.0)
    values = Renderer(scene, dull, cache_dir=kernel_cache).irradiance.cells.reshape(-1, CELL_STRIDE)
    sill = values[(values[:, 5] > 0.9) & (np.abs(values[:, 2] - 0.9) < 0.02) & (np.abs(values[:, 0] - 1.6) < 0.3)]

    inside, outside = sill[sill[:, 1] < 3.045], sill[sill[:, 1] > 3.055]

    assert len(inside) > 0
    assert len(outside) > 0
    assert inside[:, 9].max() < 0.1
    assert outside[:, 9].max() > 1.0


def test_the_ceiling_within_a_lamps_canopy_lights_no_room(tmp_path: Path, kernel_cache: Path) -> None:
    renderer = Renderer(
        load_scene(rooms.lamp_on_its_canopy(tmp_path / "lamp.glb")), rooms.NIGHT, cache_dir=kernel_cache
    )

    cells = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)

    ceiling = cells[(cells[:, 2] > 2.69) & (cells[:, 5] < -0.9)]
    assert len(ceiling) > 2000
    assert np.abs(ceiling[:, :2]).max(axis=1).min() > 0.15


@pytest.mark.parametrize("height_m", [0.01, 0.02])
def test_what_is_striped_by_sun_and_shadow_sends_on_the_sunshine_of_its_stripes(
    tmp_path: Path, kernel_cache: Path, height_m: float
) -> None:
    """Slats stand on the floor every 6 cm; nodes lie where they meet it, which is in the shadow more often than not."""
    scene = load_scene(rooms.board_above_slats(tmp_path / "slats.glb", height_m))
    lighting = Lighting(sun=Sun(azimuth_deg=0.0, elevation_deg=45.0), sky=Sky(*[(0.0,) * 3] * 3), exposure=1.0)
    renderer = Renderer(scene, lighting, cache_dir=kernel_cache)
    up = looking((0.0, 0.0, 0.3), 90.0, 90.0)
    narrow = Intrinsics.from_horizontal_fov(16, 16, 20.0)

    cells = renderer.irradiance.cells.reshape(-1, CELL_STRIDE)

    board = cells[(np.abs(cells[:, 2] - 1.0) < 1e-3) & (cells[:, 5] < -0.9)]
    paths = path_trace(renderer, up, narrow, samples_per_pixel=1024, brightest=np.inf) / renderer.exposure
    assert len(board) > 0
    assert 0.6 / np.pi * board[:, 9:12].mean(axis=0) == pytest.approx(paths.mean(axis=(0, 1)), rel=0.04)
