"""Splats that are moved as a whole, and their colours as spherical harmonics."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from benchbot_scenes.splats import (
    HARMONIC_0,
    HARMONIC_1,
    Splats,
    colors_of_harmonics,
    covariances,
    harmonics_of_colors,
    joined,
    transformed,
)


def cloud(seed: int, count: int = 20) -> Splats:
    random = np.random.default_rng(seed)
    turns = Rotation.random(count, random_state=seed).as_quat()
    return Splats(
        positions_m=random.normal(size=(count, 3)).astype(np.float32),
        rotations=turns.astype(np.float32),
        scales_m=random.uniform(0.01, 0.5, (count, 3)).astype(np.float32),
        opacities=random.uniform(0.1, 0.9, count).astype(np.float32),
        colors=random.uniform(size=(count, 3)).astype(np.float32),
        color_slopes=random.normal(size=(count, 3, 3)).astype(np.float32),
    )


def seen(splats: Splats, direction: np.ndarray) -> np.ndarray:
    return np.asarray(splats.colors + splats.color_slopes @ direction)


@settings(max_examples=30)
@given(st.integers(0, 2**31), st.floats(0.01, 100.0))
def test_shapes_places_and_colours_turn_together(seed: int, scale: float) -> None:
    splats, turn = cloud(seed), Rotation.random(random_state=seed + 1).as_matrix()
    offset = np.random.default_rng(seed).normal(size=3)
    moved = transformed(splats, turn, scale=scale, offset=offset)
    np.testing.assert_allclose(moved.positions_m, scale * splats.positions_m @ turn.T + offset, rtol=1e-4, atol=1e-5)
    expected = scale**2 * turn @ covariances(splats) @ turn.T
    np.testing.assert_allclose(covariances(moved), expected, rtol=1e-3, atol=1e-5 * scale**2)
    direction = Rotation.random(random_state=seed + 2).as_matrix()[0]
    np.testing.assert_allclose(seen(moved, turn @ direction), seen(splats, direction), atol=1e-4)


def test_harmonics_are_those_of_files() -> None:
    """Degree 1 in the order -y, z, -x, as the code of 3DGS evaluates it."""
    random = np.random.default_rng(0)
    constant, linear = random.normal(size=(5, 3)), random.normal(size=(5, 3, 3))
    colors, slopes = colors_of_harmonics(constant, linear)
    x, y, z = direction = np.array([0.36, -0.48, 0.8])
    expected = 0.5 + HARMONIC_0 * constant + HARMONIC_1 * (-y * linear[:, 0] + z * linear[:, 1] - x * linear[:, 2])
    np.testing.assert_allclose(colors + slopes @ direction, expected, rtol=1e-5)


def test_harmonics_come_back() -> None:
    splats = cloud(1)
    colors, slopes = colors_of_harmonics(*harmonics_of_colors(splats))
    np.testing.assert_allclose(colors, splats.colors, atol=1e-6)
    np.testing.assert_allclose(slopes, splats.color_slopes, atol=1e-6)


def test_clouds_are_joined_in_order() -> None:
    first, second = cloud(1, 3), cloud(2, 4)
    both = joined([first, second])
    assert both is not None
    assert both.count == 7
    np.testing.assert_array_equal(both.part(slice(3, 7)).rotations, second.rotations)
    assert joined([]) is None


def test_a_cloud_that_stays_is_the_same() -> None:
    splats = cloud(3)
    moved = transformed(splats)
    assert moved.rotations is splats.rotations
    assert moved.positions_m == pytest.approx(splats.positions_m)
