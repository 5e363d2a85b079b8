"""Colours of vertices as a texture."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.scene import Instance, Material, SceneGeometry
from benchbot_scenes.vertex_colors import bake, linear_to_srgb, srgb_to_linear


def _scene(count: int, seed: int) -> SceneGeometry:
    rng = np.random.default_rng(seed)
    return SceneGeometry(
        vertices=rng.random((3 * count, 3)).astype(np.float32),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        triangle_instance=np.ones(count, np.int32),
        triangle_material=(np.arange(count) % 2).astype(np.int32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (3 * count, 1)),
        uvs=np.zeros((3 * count, 2), np.float32),
        materials=(Material("one"), Material("two")),
        instances=(Instance(1, "thing", None),),
    )


@settings(max_examples=30)
@given(count=st.integers(1, 40), seed=st.integers(0, 1000))
def test_bilinear_look_up_blends_linearly_within_a_triangle(count: int, seed: int) -> None:
    scene = _scene(count, seed)
    rng = np.random.default_rng(seed + 1)
    # A gentle slope of colour: the fourth texel of each triangle is not clipped then.
    colors = (0.4 + 0.1 * rng.random((count, 3, 3))).astype(np.float32)
    painted = bake(scene, colors, np.ones(count, bool))
    image = srgb_to_linear(painted.images[0][..., :3] / 255.0)
    weights = rng.dirichlet([1, 1, 1], count)
    uv = (painted.uvs[painted.triangles] * weights[..., None]).sum(axis=1)
    expected = (colors * weights[..., None]).sum(axis=1)
    assert np.abs(_look_up(image, uv) - expected).max() < 0.006
    assert painted.vertices[painted.triangles] == pytest.approx(scene.vertices[scene.triangles])


def test_what_has_no_colour_stays_as_it_is() -> None:
    scene = _scene(6, 0)
    is_colored = np.array([True, False, False, True, False, False])
    painted = bake(scene, np.ones((6, 3, 3), np.float32), is_colored)
    assert (painted.triangle_material[~is_colored] == scene.triangle_material[~is_colored]).all()
    assert {painted.materials[m].name for m in painted.triangle_material[is_colored]} == {"one painted", "two painted"}
    assert len(painted.vertices) == len(scene.vertices)
    assert bake(scene, np.ones((6, 3, 3), np.float32), np.zeros(6, bool)) is scene


def test_srgb_and_back() -> None:
    values = np.linspace(0, 1, 256)
    assert srgb_to_linear(linear_to_srgb(values)) == pytest.approx(values, abs=1e-5)


def _look_up(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    right, down = (x - column)[:, None], (y - row)[:, None]
    upper = image[row, column] * (1 - right) + image[row, np.minimum(column + 1, width - 1)] * right
    below = np.minimum(row + 1, height - 1)
    lower = image[below, column] * (1 - right) + image[below, np.minimum(column + 1, width - 1)] * right
    return np.asarray(upper * (1 - down) + lower * down)
