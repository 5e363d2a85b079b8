"""Shadow rays go to the lights that matter where they start."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi.light_grid import BY_POWER, HEADER
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.lights import LIGHT_STRIDE
from benchbot_sim_taichi.renderer import Renderer
from plugins.sim_taichi.tests.glb import Glb

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


def shares(renderer: Renderer, point: tuple[float, float, float]) -> np.ndarray:
    """What share of the rays to lamps each lamp's triangle gets in the block of a point."""
    near = renderer.irradiance.near
    shape, count = near[4:7].astype(int), int(near[7])
    x, y, z = np.floor((np.array(point) - near[:3]) * near[3]).astype(int)
    row = HEADER + ((x * shape[1] + y) * shape[2] + z) * count
    return np.diff(near[row : row + count], prepend=0.0)


@pytest.mark.parametrize(("x", "side"), [(-2.6, -1), (-0.5, -1), (0.5, 1), (2.6, 1)])
def test_rays_go_to_the_lamp_of_their_own_room(two_rooms: Renderer, x: float, side: int) -> None:
    lamps = np.asarray(two_rooms.device.lights[1]).reshape(-1, LIGHT_STRIDE)
    own = np.sign(lamps[:, 0]) == side
    assert shares(two_rooms, (x, 0.3, 1.0))[own].sum() > 0.9


def test_no_light_is_left_out(two_rooms: Renderer) -> None:
    lamps = np.asarray(two_rooms.device.lights[1]).reshape(-1, LIGHT_STRIDE)
    by_power = np.diff(lamps[:, 12], prepend=0.0)
    for point in ((-3.0, -1.0, 0.5), (0.0, 0.0, 1.0), (3.5, 1.5, 2.2)):
        found = shares(two_rooms, point)
        assert found.sum() == pytest.approx(1.0, abs=1e-6)
        assert (found >= 0.99 * BY_POWER * by_power - 1e-6).all()
