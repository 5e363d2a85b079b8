"""Convex pieces of surfaces."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from benchbot_scenes.exporting.collision import CELL_M, pieces
from benchbot_scenes.scene import Instance, Material, SceneGeometry


def _soup(corners: np.ndarray) -> SceneGeometry:
    count = len(corners)
    return SceneGeometry(
        vertices=corners.reshape(-1, 3).astype(np.float32),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        triangle_instance=np.ones(count, np.int32),
        triangle_material=np.zeros(count, np.int32),
        normals=np.zeros((3 * count, 3), np.float32),
        uvs=np.zeros((3 * count, 2), np.float32),
        materials=(Material(),),
        instances=(Instance(1, "thing", None),),
    )


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 0.2, 2.0]))
def test_every_surface_is_in_a_piece_and_none_is_far_from_a_surface(seed: int, size_m: float) -> None:
    drawn = np.random.default_rng(seed)
    corners = drawn.uniform(-1, 1, (12, 1, 3)) + drawn.uniform(-size_m, size_m, (12, 3, 3))
    found = [piece.corners for piece in pieces(_soup(corners))]
    middles = corners.mean(axis=1).astype(np.float32)
    within = np.any(
        [Delaunay(piece, qhull_options="QJ").find_simplex(middles, tol=1e-3) >= 0 for piece in found], axis=0
    )
    assert within.all()
    for piece in found:
        nearest = np.linalg.norm(piece[:, None] - corners.reshape(-1, 3), axis=2).min(axis=1)
        assert nearest.max() < 0.006
        assert np.ptp(piece, axis=0).max() < 2 * CELL_M + 0.02 or len(piece) == 6


def test_triangles_without_area_are_in_no_piece() -> None:
    assert list(pieces(_soup(np.zeros((2, 3, 3))))) == []
