"""Closed pieces point outward."""

import numpy as np

from plugins.assets_household.bake.outward import outward
from plugins.assets_household.bake.parts import Part, Surface

_TETRAHEDRON = np.array(
    [
        [[0, 0, 0], [0, 1, 0], [1, 0, 0]],
        [[0, 0, 0], [1, 0, 0], [0, 0, 1]],
        [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ],
    np.float64,
)


def _part(triangles: np.ndarray) -> Part:
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Part(triangles.reshape(-1, 3), np.repeat(normals, 3, axis=0), triangles.reshape(-1, 3)[:, :2], Surface("s"))


def test_piece_that_is_inside_out_turns_and_its_neighbour_stays() -> None:
    inside_out, sound = _TETRAHEDRON[:, ::-1], _TETRAHEDRON + np.array([5.0, 0.0, 0.0])
    found = outward(_part(np.concatenate([inside_out, sound])))
    wanted = _part(np.concatenate([_TETRAHEDRON, sound]))
    np.testing.assert_allclose(found.positions, wanted.positions)
    np.testing.assert_allclose(found.normals, wanted.normals)
    np.testing.assert_allclose(found.uvs, wanted.uvs)


def test_loose_lid_of_a_box_turns() -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]], np.float64)

    def sheet(z: float) -> np.ndarray:
        return np.column_stack([square, np.full(6, z)]).reshape(-1, 3, 3)

    top, bottom = sheet(0.1), sheet(0.0)[:, ::-1]
    found = outward(_part(np.concatenate([top[:, ::-1], bottom])))
    np.testing.assert_allclose(found.normals[:6], np.tile([0.0, 0.0, 1.0], (6, 1)), atol=1e-12)
    np.testing.assert_allclose(found.normals[6:], np.tile([0.0, 0.0, -1.0], (6, 1)), atol=1e-12)
