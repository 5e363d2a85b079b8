"""Which bodies are closed, which objects are twins, and which vertices are astray."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.model import Part, assemble
from benchbot_scenes.importing.understanding import is_closed, understand, with_sides
from benchbot_scenes.scene import Material, SceneGeometry
from plugins.scenes.tests.importing import places, scanned
from plugins.scenes.tests.importing.places import Box, trimesh


def _scene(*meshes: object) -> SceneGeometry:
    parts = [
        Part((f"mesh {number}",), mesh.vertices, mesh.faces, number)  # type: ignore[attr-defined]
        for number, mesh in enumerate(meshes)
    ]
    return assemble(parts, [Material(str(number)) for number in range(len(meshes))], []).geometry


@pytest.mark.parametrize("subdivisions", [0, 2])
def test_a_ball_is_closed_wherever_it_is(subdivisions: int) -> None:
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    far = ball.copy().apply_translation([20.0, -30.0, 5.0])
    assert is_closed(_scene(ball, far)).all()


def test_a_body_with_a_hole_a_sheet_and_one_inside_out_are_open() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    holed, inverted = ball.copy(), ball.copy()
    holed.update_faces(np.arange(len(holed.faces)) != 7)
    inverted.invert()
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    scene = _scene(ball, holed, inverted, sheet)
    closed = is_closed(scene)
    assert set(scene.triangle_instance[closed]) == {1}
    assert closed[scene.triangle_instance == 1].all()


def test_one_face_the_wrong_way_round_makes_a_body_open() -> None:
    box = trimesh.creation.box()
    box.faces[3] = box.faces[3][::-1]
    assert not is_closed(_scene(box)).any()


def test_materials_are_one_sided_on_closed_bodies_only() -> None:
    ball = trimesh.creation.icosphere(subdivisions=1)
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    scene = _scene(ball, sheet)
    assert [material.double_sided for material in with_sides(scene).materials] == [False, True]
    shared = replace(scene, triangle_material=np.zeros_like(scene.triangle_material))
    assert with_sides(shared).materials[0].double_sided


def test_an_object_that_is_there_twice_is_one(tmp_path: Path) -> None:
    twin = Box("Dining_Table", (3.6, 2.6, 0.0), (4.8, 3.4, 0.745))
    beside = Box("Chair_2", (3.9, 1.5, 0.0), (4.35, 1.95, 0.9))
    understood = understand(places.write(tmp_path / "flat.glb", [*places.flat(), twin, beside]), Guesses())
    assert [found.name for found in understood.geometry.instances if found.class_name == "table"] == ["Table"]
    assert len([found for found in understood.geometry.instances if found.class_name == "chair"]) == 2
    assert "Twins are left out: Dining_Table is where Table is." in understood.notes
    assert "Dining_Table" not in {found.name for found in understood.recognised.objects}


@pytest.mark.parametrize("axis", [0, 2])
def test_a_vertex_astray_is_left_out_and_named(tmp_path: Path, axis: int) -> None:
    mesh = scanned.room()
    mesh.vertices[700, axis] = 18.9
    understood = understand(scanned.write_ply(tmp_path / "kitchen.ply", mesh), Guesses(units="m"))
    assert understood.size_m == pytest.approx((5.2, 4.2, 2.6), abs=1e-3)
    (note,) = [note for note in understood.notes if "Stray" in note]
    assert "18.9" in note
    assert "kitchen" in note


def test_a_spire_and_a_ground_plane_are_not_astray(tmp_path: Path) -> None:
    spire = trimesh.creation.cone(radius=2.0, height=12.0)
    spire.apply_translation([2.5, 2.0, 2.5])
    ground = trimesh.creation.box(extents=(40.0, 40.0, 0.01))
    path = tmp_path / "church.glb"
    made = places.scene(places.flat())
    for name, mesh in (("spire", spire), ("ground", ground)):
        mesh.vertices = places.moved(mesh.vertices, 1.0, "y")
        made.add_geometry(mesh, node_name=name, geom_name=name)
    made.export(path)
    understood = understand(path, Guesses())
    assert understood.size_m == pytest.approx((40.0, 40.0, 14.605), abs=0.1)
