"""The geometry toolkit: closed, facing outwards, at real scale."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools.household import shapes
from tools.household.model import Material, Mesh, Part, affine, bounds, fit_to_box, merge, rotation
from tools.household.outlines import circle, rectangle, rounded_rectangle

SOLIDS: dict[str, tuple[Mesh, float]] = {
    "box": (shapes.bevelled_box((1.0, 2.0, 3.0), bevel=0.01), 6.0),
    "cylinder": (shapes.cylinder(1.0, 2.0, segments=96), 2 * np.pi),
    "ellipsoid": (shapes.ellipsoid((1.0, 2.0, 3.0), 96, 48), 8 * np.pi),
    "capsule": (shapes.capsule(0.5, 2.0, 64, 16), np.pi * 0.25 * (1 + 2 / 3)),
    "tube": (shapes.tube([(0, 0, 0), (0, 0, 1.0), (0, 0, 2.0)], 0.5, sides=96), np.pi * 0.5),
    "ring": (shapes.tube(np.pad(circle(2.0, 128), ((0, 0), (0, 1))), 0.5, 64, closed=True), np.pi**2),
    "plate": (shapes.extrude(rectangle(2.0, 1.0), 0.5), 1.0),
    "plate with a hole": (shapes.extrude(rectangle(2, 2), 1.0, holes=[rectangle(1, 1)]), 3.0),
    "rounded plate": (shapes.extrude(rounded_rectangle(2, 2, 0.5, 24), 1.0), 4 - 0.25 * (4 - np.pi)),
    "loft": (
        shapes.loft(np.stack([np.pad(rectangle(1, 1), ((0, 0), (0, 1)), constant_values=z) for z in (0, 2)])),
        2.0,
    ),
}


def _volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_enclose_their_volume(name: str) -> None:
    mesh, volume = SOLIDS[name]
    assert _volume(mesh) == pytest.approx(volume, rel=0.02)


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_are_unit_and_on_the_outer_side(name: str) -> None:
    mesh, _ = SOLIDS[name]
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    face = np.cross(b - a, c - a)
    assert np.all(np.einsum("ij,ikj->ik", face, mesh.normals[mesh.triangles]) > 0)


@pytest.mark.parametrize("name", ["box", "plate", "cylinder", "tube"])
def test_texture_coordinates_are_in_metres(name: str) -> None:
    """Along the edges of the triangles a texture is never stretched."""
    mesh, _ = SOLIDS[name]
    corners, uvs = mesh.vertices[mesh.triangles], mesh.uvs[mesh.triangles]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    covered = np.linalg.norm(uvs - np.roll(uvs, 1, axis=1), axis=2)
    large = lengths.min(axis=1) > 0.05
    if name == "cylinder":
        large &= np.abs(mesh.normals[mesh.triangles][:, :, 2]).max(axis=1) < 0.5
    np.testing.assert_allclose(covered[large], lengths[large], rtol=0.03)


def test_a_box_keeps_its_flat_faces_flat() -> None:
    mesh = shapes.extrude(rectangle(1, 1), 0.2, bevel=0.01)
    top = mesh.normals[mesh.vertices[:, 2] > 0.2 - 1e-9]
    assert top[:, 2].min() > 0.99


@given(
    extent=st.tuples(*[st.floats(0.01, 5.0)] * 3),
    centroid=st.tuples(*[st.floats(-10.0, 10.0)] * 3),
)
def test_fit_to_box_is_exact(extent: tuple[float, float, float], centroid: tuple[float, float, float]) -> None:
    model = (Part(shapes.bevelled_box((1.0, 2.0, 0.5)), Material("any")),)
    low, high = bounds(fit_to_box(model, extent, centroid))
    np.testing.assert_allclose(high - low, extent, atol=1e-9)
    np.testing.assert_allclose((low + high) / 2, centroid, atol=1e-9)


def test_fit_to_box_turns_rather_than_stretches() -> None:
    model = (Part(shapes.bevelled_box((1.0, 2.0, 0.5), bevel=0.001, grain="y"), Material("any")),)
    turned = fit_to_box(model, (2.0, 1.0, 0.5))[0].mesh
    assert _volume(turned) == pytest.approx(_volume(model[0].mesh))


@given(angle_deg=st.floats(-360, 360), axis=st.sampled_from("xyz"))
def test_rotation_is_orthogonal(angle_deg: float, axis: str) -> None:
    matrix = rotation(axis, angle_deg)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


def test_a_mirrored_mesh_still_faces_outwards() -> None:
    mesh = affine(SOLIDS["box"][0], np.diag([-1.0, 1.0, 1.0]))
    assert _volume(mesh) > 0


def test_merge_keeps_every_triangle() -> None:
    box, cylinder = SOLIDS["box"][0], SOLIDS["cylinder"][0]
    both = merge([box, cylinder])
    assert _volume(both) == pytest.approx(_volume(box) + _volume(cylinder))
