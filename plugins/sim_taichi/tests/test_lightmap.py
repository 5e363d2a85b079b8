"""Light at the nodes of surfaces."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import _ti, charts, lightmap
from benchbot_sim_taichi.kernels.lightmap import LIGHT_WORDS
from benchbot_sim_taichi.renderer import Renderer
from benchbot_sim_taichi.surface_cells import CELL_STRIDE
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.glb import Glb

pytestmark = pytest.mark.xdist_group("renderer")


def test_points_of_a_rectangle_lie_in_rows_along_its_sides(tmp_path: Path, kernel_cache: Path) -> None:
    """Not along the diagonal in which its two triangles meet: strips beside a moulding would have spots."""
    _ti.start("cpu", kernel_cache)
    glb = Glb()
    glb.box("shelf", (0, 0, 0), (0.99, 0.29, 0.1), glb.material())
    scene = load_scene(glb.write(tmp_path / "shelf.glb"))

    positions, normals = charts.find(scene).places_in(scene)

    top = positions[normals[:, 2] > 0.9, :2]
    across, down = top[:, 0] / (0.99 / 40), top[:, 1] / (0.29 / 12)
    assert len(top) == 41 * 13
    assert np.abs(across - np.rint(across)).max() < 0.2
    assert np.abs(down - np.rint(down)).max() < 0.2


@pytest.mark.parametrize("gap_m", [0.03, 0.2])
def test_all_light_of_a_lamp_arrives_however_close_it_is(tmp_path: Path, kernel_cache: Path, gap_m: float) -> None:
    """A ceiling's irradiance, summed up over its area, is the power of the face below it (Lambert): pi L A."""
    glb = Glb()
    glb.box("ceiling", (-4, -4, 2.0), (4, 4, 2.1), glb.material((0.5,) * 3))
    top = 2.0 - gap_m
    glb.box("lamp", (-0.2, -0.2, top - 1e-3), (0.2, 0.2, top), glb.material((0.0,) * 3, emission=(10.0,) * 3))
    scene = load_scene(glb.write(tmp_path / "ceiling.glb"))
    renderer = Renderer(scene, rooms.NIGHT, cache_dir=kernel_cache)

    direct = lightmap.light_directly(renderer.scene, renderer.device, renderer.near_lights, 0)

    positions, normals = direct.found.places_in(renderer.scene)
    below = (np.abs(positions[:, 2] - 2.0) < 1e-3) & (normals[:, 2] < -0.9)
    arrived = (_ti.download(direct.raw).reshape(len(positions), -1)[below, 0] * direct.found.area_m2[below]).sum()
    assert arrived == pytest.approx(np.pi * 10.0 * 0.4**2, rel=0.02)


@pytest.mark.parametrize(("first", "last"), [(0, 10), (12, 15)], ids=["what is averaged", "found by chance"])
def test_what_is_smoothed_keeps_its_sum(first: int, last: int, kernel_cache: Path) -> None:
    """Light that is averaged only moves: nodes at an edge, or where a shadow begins, count as all others."""
    _ti.start("cpu", kernel_cache)
    from benchbot_sim_taichi.kernels import smoothing
    from benchbot_sim_taichi.kernels.bake import RAW_STRIDE

    width, height = 12, 7
    y, x = np.divmod(np.arange(width * height), width)
    of_chart = np.column_stack(
        [np.arange(width * height), x, y, *(np.full(width * height, n) for n in (width, height))]
    )
    raw = np.random.default_rng(0).random((width * height, RAW_STRIDE)).astype(np.float32)
    raw[x < 5, :3] *= 0.1
    raw[:, 11] = 1.0
    values = [
        _ti.upload(array.ravel())
        for array in (raw, of_chart.astype(np.int32), np.arange(width * height, dtype=np.int32))
    ]
    smoothed = _ti.upload(np.zeros(raw.size, np.float32))

    smoothing.smooth(*values, smoothed, width * height, 0, 2, 0.1, 1, first, last)

    after = _ti.download(smoothed).reshape(raw.shape)
    assert np.abs(after[:, first:last] - raw[:, first:last]).max() > 0.1
    assert after.sum(axis=0) == pytest.approx(raw.sum(axis=0), rel=1e-5)


def test_what_one_node_in_many_finds_leaves_no_spots(tmp_path: Path, kernel_cache: Path) -> None:
    """A lamp of 4 cm lights the wall beside it, whose middle one ray from the wall opposite meets, or none."""
    room = Glb()
    room.box("room", (-1, -1, 0), (1, 1, 2), room.material((0.5,) * 3), inward=True)
    glowing = room.material((0.0,) * 3, emission=(50.0,) * 3)
    room.box("lamp", (-0.02, 0.90, 0.98), (0.02, 0.94, 1.02), glowing)

    positions, _, straight, stored = _lit_by_night(room.write(tmp_path / "room.glb"), kernel_cache)

    opposite = (positions[:, 1] < -0.999) & (np.abs(positions[:, [0, 2]] - (0.0, 1.0)).max(axis=1) < 0.6)
    x, z = (positions[opposite][:, [0, 2]] - (0.0, 1.0)).T
    indirect = (stored - straight)[opposite]
    evenly = np.column_stack([np.ones_like(x), x, z, x * x, x * z, z * z])
    spots = np.abs(indirect - evenly @ np.linalg.lstsq(evenly, indirect, rcond=None)[0]) / indirect.mean()
    assert len(spots) > 2000
    assert spots.max() < 0.2
    assert np.sqrt((spots**2).mean()) < 0.055


def test_a_wall_keeps_its_light_beside_what_stands_before_it(tmp_path: Path, kernel_cache: Path) -> None:
    """Behind furniture it is dark, which the wall that is seen beside it shall not be averaged with."""
    black = Glb()
    black.box("wall", (-0.6, 0, 0), (0.6, 0.1, 1.2), black.material((0.0,) * 3))
    black.box("chest", (-0.3, -0.02, 0.3), (0.3, -0.01, 0.9), black.material((0.0,) * 3))
    black.box("lamp", (-0.05, -1.1, 0.55), (0.05, -1.0, 0.65), black.material((0.0,) * 3, emission=(1.0,) * 3))

    positions, normals, raw, stored = _lit_by_night(black.write(tmp_path / "wall.glb"), kernel_cache)

    beyond_m = np.abs(positions[:, [0, 2]] - (0.0, 0.6)).max(axis=1) - 0.3
    beside = (normals[:, 1] < -0.9) & (np.abs(positions[:, 1]) < 1e-3) & (beyond_m > 0.02) & (beyond_m < 0.05)
    assert beside.sum() > 80
    assert stored[beside].sum() == pytest.approx(raw[beside].sum(), rel=0.1)


def test_what_cells_mix_hardly_shows_in_the_light_of_points(tmp_path: Path, kernel_cache: Path) -> None:
    """In a box that reflects half of its light, cells a fifth too bright add 5 %: a second round halves that."""
    glb = Glb()
    glb.box("box", (-0.3,) * 3, (0.3,) * 3, glb.material((0.5,) * 3, emission=(1.0,) * 3), inward=True)
    renderer = Renderer(load_scene(glb.write(tmp_path / "box.glb")), rooms.NIGHT, cache_dir=kernel_cache)

    right, brighter = (
        _red(
            lightmap.bake(renderer.scene, renderer.device, _cells(renderer, gain), renderer.near_lights, None, 0)
        ).mean()
        for gain in (1.0, 1.2)
    )

    assert right < brighter < 1.035 * right


def _cells(renderer: Renderer, gain: float = 1.0) -> lightmap.Cells:
    """A renderer's cells, with `gain` times the light that they get by way of others."""
    light = renderer.irradiance
    values = light.cells.reshape(-1, CELL_STRIDE).copy()
    values[:, 9:12] *= gain
    return _ti.upload(light.grid), _ti.upload(values.ravel()), _ti.upload(light.layout)


def _red(stored: lightmap.Lightmap) -> np.ndarray:
    """Irradiance of red at each node: exponent and eight bits of the fraction, in the lower half of the first word."""
    return ((_ti.download(stored.light)[::LIGHT_WORDS].astype(np.uint32) & 0xFFFF) << 15).view(np.float32)


def _lit_by_night(scene_path: Path, cache: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions and normals (N, 3) of nodes, their raw red straight from lamps, and all that is kept."""
    renderer = Renderer(load_scene(scene_path), rooms.NIGHT, cache_dir=cache)
    scene, near = renderer.scene, renderer.near_lights
    direct = lightmap.light_directly(scene, renderer.device, near, 0)
    straight = _ti.download(direct.raw).reshape(direct.found.count, -1)[:, 0].copy()
    stored = lightmap.bake(scene, renderer.device, _cells(renderer), near, direct, 0)
    return *direct.found.places_in(scene), straight, _red(stored)
