"""Exported MJCF, opened by MuJoCo."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from benchbot_scenes.exporting import mjcf
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import Instance, Material
from plugins.scenes.tests.exporting import opened, rooms


def _model(files: dict[str, bytes], folder: Path) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(opened.written(files, folder) / "room_1.xml"))


def test_mujoco_sees_the_same_boxes_and_classes(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    model = _model(mjcf.files(geometry, "room_1"), tmp_path)
    assert rooms.apart_m(rooms.boxes(geometry), opened.mujoco_boxes(model, opened.VISUAL)) <= 0.001
    # What is collided with is five millimetres thick at most, where the surface is thinner.
    assert rooms.apart_m(rooms.boxes(geometry), opened.mujoco_boxes(model, opened.COLLISION)) <= 0.0051
    classes = {found.name: found.class_name for found in geometry.instances if found.class_name is not None}
    assert opened.mujoco_classes(tmp_path / "room_1.xml") == classes


@pytest.mark.parametrize(
    ("at", "falls_to_m"),
    [((4.2, 3.0), 0.84), ((1.0, 3.0), 0.6), ((2.7, 1.2), 0.1)],
    ids=["on the table", "on the bed", "on the floor"],
)
def test_a_ball_comes_to_rest_on_what_is_below_it(tmp_path: Path, at: tuple[float, float], falls_to_m: float) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    opened.written(mjcf.files(geometry, "room_1"), tmp_path)
    spec = mujoco.MjSpec.from_file(str(tmp_path / "room_1.xml"))
    ball = spec.worldbody.add_body(name="ball", pos=[*at, falls_to_m + 0.2])
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0], friction=[1, 0.1, 0.1], condim=6)
    model = spec.compile()
    data = mujoco.MjData(model)
    while data.time < 2.0:
        mujoco.mj_step(model, data)
    assert data.body("ball").xpos[2] == pytest.approx(falls_to_m, abs=0.01)


def test_names_that_are_the_same_or_no_xml_and_glass_textures_and_lamps_are_taken(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    materials = (
        Material("<cloth>", base_color_image=0),
        Material("pane", transmission=1.0),
        Material("lamp", emission=(5.0, 5.0, 4.0)),
    )
    instances = tuple(Instance(found.index, 'a\x00 <b>&"/', None) for found in geometry.instances)
    odd = replace(
        geometry,
        materials=materials,
        triangle_material=(geometry.triangle_instance % 3).astype(np.int32),
        instances=instances,
        images=(np.full((4, 4, 4), 200, np.uint8),),
    )
    model = _model(mjcf.files(odd, "room_1"), tmp_path)
    assert model.nbody == len(instances) + 1
    assert (model.ntex, model.ntext) == (1, 0)
    assert model.nlight == len({index for index in geometry.triangle_instance.tolist() if index % 3 == 2})
    assert model.mat_rgba[model.mat("1").id, 3] < 1
