"""Which bodies are closed."""

from dataclasses import replace

import numpy as np
import pytest

from benchbot_scenes.importing.model import Part, assemble
from benchbot_scenes.importing.understanding import is_closed, with_sides
from benchbot_scenes.scene import Material, SceneGeometry
from plugins.scenes.tests.importing.places import trimesh


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
