"""Flat pieces and plates."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import MultiPolygon, Point, Polygon, box

from benchbot_scenes import mesh
from benchbot_scenes.mesh import FLOOR, Frame, Mesh

EAST_WALL = Frame((2.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
FRAMED = box(0, 0, 3, 2).difference(box(1, 0.5, 2, 1.5))
L_SHAPED = Polygon([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)])


def solid(shape: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(shape.vertices, shape.triangles, process=True, merge_norm=True, merge_tex=True)


def winding(shape: Mesh) -> np.ndarray:
    a, b, c = (shape.vertices[shape.triangles[:, corner]] for corner in range(3))
    cross = np.cross(b - a, c - a)
    return np.asarray(cross / np.linalg.norm(cross, axis=1, keepdims=True))


@pytest.mark.parametrize("is_back", [False, True])
def test_a_face_covers_its_polygon_and_looks_where_its_frame_does(is_back: bool) -> None:
    face = mesh.face(FRAMED, EAST_WALL, 0.25, is_back=is_back)
    assert solid(face).area == pytest.approx(FRAMED.area)
    assert np.allclose(winding(face), [-1 if is_back else 1, 0, 0])
    assert np.allclose(face.normals, [-1 if is_back else 1, 0, 0])
    assert np.allclose(face.vertices[:, 0], 2.25)


def test_texture_coordinates_are_metres_on_the_plane() -> None:
    face = mesh.face(box(0, 0, 3, 2), EAST_WALL)
    assert np.allclose(face.vertices[:, 1:], face.uvs + np.array([1.0, 0.0]))


@pytest.mark.parametrize("shape", [FRAMED, L_SHAPED, MultiPolygon([box(0, 0, 1, 1), box(2, 0, 3, 1)])])
def test_a_plate_is_closed(shape: Polygon) -> None:
    plate = mesh.extrusion(shape, EAST_WALL, -0.1, 0.3, has_back=True)
    closed = solid(plate)
    assert closed.is_watertight
    assert closed.volume == pytest.approx(0.4 * shape.area)
    assert np.allclose(winding(plate), plate.normals[plate.triangles[:, 0]])


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9), st.integers(1, 4)), max_size=5))
def test_any_holes_are_left_open(holes: list[tuple[int, int, int]]) -> None:
    cut = box(0, 0, 10, 10)
    for x, y, size in holes:
        cut = cut.difference(box(x, y, x + size / 2, y + size / 2))
    face = mesh.face(cut, FLOOR)
    assert solid(face).area == pytest.approx(cut.area) if cut.area else not len(face.triangles)
    assert (winding(face) @ [0, 0, 1] > 0.99).all()


def test_nothing_is_an_empty_mesh() -> None:
    for empty in (mesh.merge([]), mesh.face(Polygon(), FLOOR), mesh.face(Point(0, 0), FLOOR)):
        assert len(empty.vertices) == len(empty.triangles) == 0
