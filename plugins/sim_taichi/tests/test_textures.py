"""Texels, what is seen of them, and the tone curve."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import camera_response, textures
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.glb import Glb


def unpack(texels: np.ndarray, is_color: bool) -> np.ndarray:
    bits = texels.view(np.uint32)
    values = np.stack([bits & 1023, (bits >> 10) & 1023, (bits >> 20) & 1023], axis=-1) / 1023.0
    return values**2 if is_color else values


@given(height=st.integers(1, 40), width=st.integers(1, 40), level=st.integers(0, 255))
def test_every_mip_level_of_an_even_image_is_even(height: int, width: int, level: int) -> None:
    image = np.full((height, width, 4), level, np.uint8)
    store = textures.pack((image,), {0})
    linear = textures.srgb_to_linear(np.array(level / 255))
    assert unpack(store.texels, is_color=True) == pytest.approx(float(linear), abs=2e-3)


def test_levels_halve_down_to_one_texel() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (16, 8, 4), np.uint8)
    store = textures.pack((image,), set())
    assert store.table.tolist() == [0, 8, 16, 5]
    assert len(store.texels) == 16 * 8 + 8 * 4 + 4 * 2 + 2 * 1 + 1
    assert unpack(store.texels[-1:], is_color=False)[0] == pytest.approx(image[..., :3].mean((0, 1)) / 255, abs=5e-3)


def test_images_follow_one_another() -> None:
    small, large = np.zeros((1, 1, 4), np.uint8), np.full((2, 2, 4), 255, np.uint8)
    store = textures.pack((small, large), set())
    assert store.table.reshape(-1, 4).tolist() == [[0, 1, 1, 1], [1, 2, 2, 2]]
    assert (unpack(store.texels[1:], is_color=False) == 1).all()


def test_srgb_bytes_are_those_of_the_standard() -> None:
    linear = np.array([0.0, 0.0021, 0.18, 0.5, 1.0], np.float32)
    assert camera_response.srgb_bytes(linear).tolist() == [0, 7, 118, 188, 255]


@pytest.mark.xdist_group("renderer")
@pytest.mark.parametrize("mirrored", [False, True], ids=["as it lies", "mirrored"])
def test_a_tiled_floor_into_the_distance_is_what_each_pixel_sees_of_it(
    tmp_path: Path, kernel_cache: Path, *, mirrored: bool
) -> None:
    tiles = np.full((256, 256, 3), 190, np.uint8)
    for line in (0, 1):
        tiles[line::32] = tiles[:, line::32] = 25
    corners = np.array([[-8, -8, 0], [8, -8, 0], [8, 8, 0], [-8, 8, 0]], float)
    turned = np.array([[0.88, 0.48], [-0.48, 0.88]]) * 0.5
    glb = Glb()
    glb.add(
        "floor",
        corners,
        np.array([[0, 1, 2], [0, 2, 3]]),
        glb.material(image=tiles),
        normals=np.tile((0.0, 0.0, 1.0), (4, 1)),
        uvs=corners[:, :2] * (-1 if mirrored else 1, 1) @ turned,
    )
    renderer = Renderer(load_scene(glb.write(tmp_path / "floor.glb")), Lighting(), cache_dir=kernel_cache)
    pose = looking((-6.0, -4.0, 0.6), 33.0, -8.0)
    seen = renderer.render(pose, Intrinsics.from_horizontal_fov(80, 45, 80.0)).rgb.astype(float)
    finer = renderer.render(pose, Intrinsics.from_horizontal_fov(640, 360, 80.0)).rgb.astype(float)
    mean = finer.reshape(45, 8, 80, 8, 3).mean((1, 3))
    # It is 4.8, and would be 9.5 if images were filtered by one width for both ways.
    assert np.sqrt(((seen - mean)[20:] ** 2).mean()) < 6.0
