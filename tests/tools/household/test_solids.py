"""Boards and soft bodies are closed and have the size that they were asked for."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from tools.household.implicit import Field, ball, cut, limb, smooth_union, surface, without
from tools.household.model import Mesh
from tools.household.planks import board

lengths = st.floats(0.02, 3.0)


def _solid(mesh: Mesh) -> trimesh.Trimesh:
    joined = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    joined.merge_vertices(merge_norm=True, merge_tex=True)
    return joined


@given(lengths, lengths, lengths, st.floats(0.0005, 0.004), st.sampled_from(["", "x", "y", "z"]))
@settings(max_examples=30, deadline=None)
def test_a_board_is_closed_and_fills_its_box(x: float, y: float, z: float, bevel: float, grain: str) -> None:
    mesh = board((0.0, -y, 1.0), (x, 0.0, 1.0 + z), bevel, grain)
    solid = _solid(mesh)
    assert len(mesh.triangles) == 44
    assert solid.is_watertight
    np.testing.assert_allclose(solid.bounds, [[0.0, -y, 1.0], [x, 0.0, 1.0 + z]], atol=1e-9)
    assert 0.5 * x * y * z < solid.volume < x * y * z


def test_the_grain_runs_along_u() -> None:
    mesh = board((0, 0, 0), (0.02, 0.5, 0.1))
    front = mesh.normals[:, 0] > 0.99
    assert np.ptp(mesh.uvs[front, 0]) == pytest.approx(0.5, abs=0.01)
    assert np.ptp(mesh.uvs[front, 1]) == pytest.approx(0.1, abs=0.01)


def test_a_ball_is_round() -> None:
    mesh = surface(ball((0.1, 0.2, 0.3), 0.1), (0, 0.1, 0.2), (0.2, 0.3, 0.4), 0.02)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices - [0.1, 0.2, 0.3], axis=1), 0.1, atol=2e-4)
    solid = _solid(mesh)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=0.03)


@pytest.mark.parametrize(
    ("field", "low", "high"),
    [
        (limb((0, 0, 0), (0.3, 0, 0.1), 0.06, 0.04), (-0.1, -0.1, -0.1), (0.4, 0.1, 0.2)),
        (smooth_union([ball((0, 0, 0), 0.1), ball((0.12, 0, 0), 0.08)], 0.05), (-0.2, -0.2, -0.2), (0.3, 0.2, 0.2)),
        (without(ball((0, 0, 0), 0.1), ball((0.1, 0, 0), 0.05), 0.01), (-0.2, -0.2, -0.2), (0.2, 0.2, 0.2)),
        (cut(ball((0, 0, 0), 0.1), lambda points: points[:, 2] - 0.03), (-0.2, -0.2, -0.2), (0.2, 0.2, 0.2)),
    ],
    ids=["limb", "union", "difference", "cut"],
)
def test_soft_bodies_are_closed_and_face_outwards(
    field: Field, low: tuple[float, float, float], high: tuple[float, float, float]
) -> None:
    solid = _solid(surface(field, low, high, 0.013))
    assert solid.is_watertight
    assert solid.volume > 0


def test_joined_bodies_are_larger_than_either() -> None:
    points = np.random.default_rng(0).uniform(-0.2, 0.2, (500, 3))
    first, second = ball((0, 0, 0), 0.1), ball((0.12, 0, 0), 0.08)
    both = smooth_union([first, second], 0.04)(points)
    assert np.all(both <= np.minimum(first(points), second(points)) + 1e-12)


def test_a_ball_of_fewer_triangles_is_closed_and_as_round() -> None:
    fine = surface(ball((0, 0, 0), 0.1), (-0.1, -0.1, -0.1), (0.1, 0.1, 0.1), 0.012)
    coarse = surface(ball((0, 0, 0), 0.1), (-0.1, -0.1, -0.1), (0.1, 0.1, 0.1), 0.012, most=300)
    assert len(coarse.triangles) <= 300 < len(fine.triangles) / 3
    assert _solid(coarse).is_watertight
    np.testing.assert_allclose(np.linalg.norm(coarse.vertices, axis=1), 0.1, atol=0.003)
