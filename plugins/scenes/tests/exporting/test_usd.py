"""Exported USD, opened by usd-core."""

from dataclasses import replace
from pathlib import Path

from pxr import Usd, UsdGeom, UsdLux, UsdPhysics, UsdSemantics

from benchbot_scenes.exporting import usd
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import Material
from plugins.scenes.tests.exporting import opened, rooms


def test_usd_shows_the_same_boxes_and_classes_and_collides_with_every_mesh(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    path = opened.written(usd.files(geometry, "room_1"), tmp_path) / "room_1.usdc"
    stage = Usd.Stage.Open(str(path))
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
    assert rooms.apart_m(rooms.boxes(geometry), opened.usd_boxes(path)) <= 0.001
    classes = {}
    for prim in stage.Traverse():
        if prim.HasAPI(UsdSemantics.LabelsAPI, "class"):
            (classes[prim.GetDisplayName()],) = UsdSemantics.LabelsAPI(prim, "class").GetLabelsAttr().Get()
    assert classes == {found.name: found.class_name for found in geometry.instances if found.class_name is not None}
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert meshes
    assert all(prim.HasAPI(UsdPhysics.CollisionAPI) for prim in meshes)


def test_lamps_do_not_widen_the_boxes_of_what_shines(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    shining = replace(geometry, materials=(Material("lamp", emission=(5.0, 5.0, 4.0)),) * len(geometry.materials))
    path = opened.written(usd.files(shining, "room_1"), tmp_path) / "room_1.usdc"
    stage = Usd.Stage.Open(str(path))
    lights = [prim for prim in stage.Traverse() if prim.IsA(UsdLux.SphereLight)]
    assert len(lights) == len(rooms.boxes(geometry))
    assert rooms.apart_m(rooms.boxes(geometry), opened.usd_boxes(path)) <= 0.001
