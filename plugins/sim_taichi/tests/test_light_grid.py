"""Shadow rays go to the lights that matter where they start."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import _ti, light_grid
from benchbot_sim_taichi.light_grid import BY_POWER, HEADER, KINDS, SELDOM
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.lights import LIGHT_STRIDE
from benchbot_sim_taichi.renderer import Renderer
from benchbot_sim_taichi.surface_cells import DIRECTIONS
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.glb import Glb
from plugins.sim_taichi.tests.light_means import mean_of_samples

pytestmark = pytest.mark.xdist_group("renderer")


@pytest.fixture(scope="module")
def two_rooms(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> Renderer:
    """Two rooms of 4 m, one on either side of a wall at x = 0, each with a lamp of its own."""
    glb = Glb()
    paint = glb.material((0.5, 0.5, 0.5))
    glb.box("walls", (-4, -2, 0), (4, 2, 2.5), paint, inward=True)
    glb.box("between", (-0.1, -2, 0), (0.1, 2, 2.5), paint)
    for name, x in (("left", -2.0), ("right", 2.0)):
        glb.sphere(name, (x, 0, 2.0), 0.1, glb.material((0, 0, 0), emission=(20.0,) * 3), 8)
    scene = load_scene(glb.write(tmp_path_factory.mktemp("rooms") / "rooms.glb"))
    return Renderer(scene, Lighting(exposure=0.1), cache_dir=kernel_cache)


UP, NORTH = 4, 2  # ways to face: that of the floor, and of the wall at -y


def row(renderer: Renderer, point: tuple[float, float, float], way: int) -> np.ndarray:
    """What the grid says of surfaces around a point that face one way: how often each kind is sampled, then shares."""
    near = renderer.irradiance.near
    shape, count = near[4:7].astype(int), int(near[7])
    x, y, z = np.floor((np.array(point) - near[:3]) * near[3]).astype(int)
    number = int(near[HEADER + ((x * shape[1] + y) * shape[2] + z) * DIRECTIONS + way])
    found: np.ndarray = near[HEADER + shape.prod() * DIRECTIONS :].reshape(-1, KINDS + count)[number]
    return found


def shares(renderer: Renderer, point: tuple[float, float, float], way: int) -> np.ndarray:
    """What share of the rays to lamps each lamp's triangle gets from surfaces around a point."""
    return np.diff(row(renderer, point, way)[KINDS:], prepend=0.0)


@pytest.mark.parametrize(("x", "side"), [(-2.6, -1), (-0.5, -1), (0.5, 1), (2.6, 1)])
def test_rays_go_to_the_lamp_of_their_own_room(two_rooms: Renderer, x: float, side: int) -> None:
    lamps = np.asarray(two_rooms.device.lights[1]).reshape(-1, LIGHT_STRIDE)
    own = np.sign(lamps[:, 0]) == side
    assert shares(two_rooms, (x, 0.3, 0.1), UP)[own].sum() > 0.85


def test_rays_go_to_the_sides_of_lamps_that_shine_here(two_rooms: Renderer) -> None:
    lamps = np.asarray(two_rooms.device.lights[1]).reshape(-1, LIGHT_STRIDE)
    shines_up = lamps[:, 11] > 0.2
    assert shares(two_rooms, (2.0, 0.3, 0.1), UP)[shines_up].sum() < 0.1
    assert shares(two_rooms, (2.0, -1.9, 2.4), NORTH)[shines_up].sum() > 0.15


def test_no_light_is_left_out(two_rooms: Renderer) -> None:
    lamps = np.asarray(two_rooms.device.lights[1]).reshape(-1, LIGHT_STRIDE)
    by_power = np.diff(lamps[:, 12], prepend=0.0)
    for point in ((-3.0, -1.0, 0.1), (0.0, 0.0, 1.0), (3.5, 1.5, 2.2)):
        for way in range(DIRECTIONS):
            found = shares(two_rooms, point, way)
            assert found.sum() == pytest.approx(1.0, abs=1e-6)
            assert (found >= 0.99 * BY_POWER * by_power - 1e-6).all()


def test_windows_are_sampled_seldom_by_night(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.furnished_room(tmp_path / "room.glb"))
    night = Lighting(sun=Sun(irradiance=(0.0,) * 3), sky=Sky(*[(1e-4,) * 3] * 3), exposure=0.1)
    for lighting, windows in ((night, SELDOM), (Lighting(), 1)):
        renderer = Renderer(scene, lighting, cache_dir=kernel_cache)
        assert row(renderer, (1.5, 1.5, 0.05), UP)[:KINDS].tolist() == [windows, 1]


def test_a_lamp_may_be_all_that_there_is(tmp_path: Path, kernel_cache: Path) -> None:
    glb = Glb()
    glb.sphere("lamp", (0, 0, 1.0), 0.1, glb.material((0, 0, 0), emission=(20.0,) * 3), 8)
    renderer = Renderer(load_scene(glb.write(tmp_path / "lamp.glb")), Lighting(exposure=0.1), cache_dir=kernel_cache)
    by_power = np.asarray(renderer.device.lights[1]).reshape(-1, LIGHT_STRIDE)[:, 12]
    assert row(renderer, (0.0, 0.0, 0.0), UP)[KINDS:].tolist() == by_power.tolist()


@pytest.mark.parametrize("every", [1, SELDOM])
@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-1.0, 0.0, 0.0)])
def test_samples_add_up_to_what_all_lamps_give(
    two_rooms: Renderer, normal: tuple[float, float, float], every: int
) -> None:
    """Whatever the shares are, and however many samples are left out, their mean is that of each lamp in turn."""
    near, lights = two_rooms.irradiance.near.copy(), two_rooms.device.lights
    rows = near[HEADER + int(near[4:7].prod()) * DIRECTIONS :].reshape(-1, KINDS + int(near[7]))
    rows[:, 1] = every
    means, place = np.zeros(3, np.float32), np.array([0.7, 0.4, 0.3, *normal], np.float32)
    mean_of_samples(_ti.upload(near), lights[1], lights[0], lights[3], place, means, 2**15)
    assert means[0] > 0.01
    assert means[1] == pytest.approx(means[0], rel=0.03)
    assert means[2] == pytest.approx(means[0], rel=0.03)


finite = st.floats(0.0, 1e6, width=32)


@given(arrays.arrays(np.float32, arrays.array_shapes(min_dims=2, max_dims=2, max_side=9), elements=finite), st.data())
def test_shares_are_distributions(light: np.ndarray, data: st.DataObject) -> None:
    power = data.draw(arrays.arrays(np.float32, light.shape[1], elements=st.floats(0.125, 1.0, width=32)))
    by_power = np.cumsum(power / power.sum(), dtype=np.float64).astype(np.float32)
    cumulative = light_grid._shares(light, by_power)
    assert (cumulative[:, -1] == 1.0).all()
    assert (np.diff(cumulative, axis=1, prepend=0.0) > 0.0).all()
    assert (np.diff(cumulative, axis=1, prepend=0.0) >= BY_POWER * np.diff(by_power, prepend=0.0) - 1e-6).all()
