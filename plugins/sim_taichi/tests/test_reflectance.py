"""The reflectance model by itself: energy, and the table that the kernels read."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from benchbot_sim_taichi.reflectance import ALBEDO_STEPS, albedo_table

TABLE = albedo_table().reshape(ALBEDO_STEPS, ALBEDO_STEPS, 2).astype(float)


def mirrored(specular: float, roughness: float, cosine: float) -> float:
    """Directional albedo as the kernels look it up."""
    row, column = roughness * (ALBEDO_STEPS - 1), np.sqrt(cosine) * (ALBEDO_STEPS - 1)
    i, j = min(int(row), ALBEDO_STEPS - 2), min(int(column), ALBEDO_STEPS - 2)
    down, right = row - i, column - j
    a, b = (TABLE[i, j] * (1 - right) + TABLE[i, j + 1] * right) * (1 - down) + (
        TABLE[i + 1, j] * (1 - right) + TABLE[i + 1, j + 1] * right
    ) * down
    return float(specular * a + b)


def integrated(specular: float, roughness: float, cosine: float, steps: int = 256) -> float:
    """The same by brute force over the directions that light leaves in (glTF 2.0, appendix B)."""
    alpha = max(roughness, 0.03) ** 2
    height = (np.arange(steps) + 0.5) / steps
    angle = np.pi * (np.arange(steps) + 0.5) / steps
    z, phi = np.meshgrid(height, angle)
    leaving = np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)
    view = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
    half = leaving + view
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    distribution = alpha**2 / (np.pi * (half[..., 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    smith = [0.5 * (np.sqrt(alpha**2 + (1 - alpha**2) * c**2) / c - 1) for c in (z, np.asarray(cosine))]
    visible = 1 / (1 + smith[0] + smith[1])
    fresnel = specular + (1 - specular) * (1 - (half @ view).clip(0, 1)) ** 5
    value = fresnel * distribution * visible / (4 * cosine)
    return float(value.mean() * 2 * np.pi)


@given(specular=st.floats(0, 1), roughness=st.floats(0, 1), cosine=st.floats(0, 1))
@example(specular=1.0, roughness=0.0625, cosine=1.0)
def test_no_more_is_mirrored_than_arrives(specular: float, roughness: float, cosine: float) -> None:
    assert 0 <= mirrored(specular, roughness, cosine) <= 1.0 + 1e-9


@given(specular=st.floats(0, 1), roughness=st.floats(0.4, 1), cosine=st.floats(0.1, 1))
def test_the_table_is_the_integral(specular: float, roughness: float, cosine: float) -> None:
    assert mirrored(specular, roughness, cosine) == pytest.approx(integrated(specular, roughness, cosine), abs=0.012)


@given(albedo=st.floats(0, 1), metallic=st.floats(0, 1), roughness=st.floats(0.4, 1), cosine=st.floats(0.1, 1))
def test_both_lobes_together_give_back_no_more_than_arrives(
    albedo: float, metallic: float, roughness: float, cosine: float
) -> None:
    specular = 0.04 * (1 - metallic) + albedo * metallic
    matt = albedo * (1 - metallic) * (1 - mirrored(specular, roughness, cosine))
    assert integrated(specular, roughness, cosine) + matt <= 1.01
