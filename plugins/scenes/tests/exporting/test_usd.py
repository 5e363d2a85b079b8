"""Exported USD, opened by usd-core."""

from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdPhysics, UsdSemantics

from benchbot_scenes.exporting import usd
from benchbot_scenes.gltf import load_scene
from plugins.scenes.tests.exporting import opened, rooms


def test_usd_shows_the_same_boxes_and_classes_and_collides_with_every_mesh(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    stage = Usd.Stage.Open(str(opened.written(usd.files(geometry, "room_1"), tmp_path) / "room_1.usdc"))
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"])
    found: rooms.Boxes = {}
    classes = {}
    for prim in stage.GetPrimAtPath("/World").GetChildren():
        if prim.GetName() == "materials":
            continue
        box = cache.ComputeWorldBound(prim).ComputeAlignedRange()
        found[prim.GetDisplayName()] = np.array([box.GetMin(), box.GetMax()])
        if prim.HasAPI(UsdSemantics.LabelsAPI, "class"):
            (classes[prim.GetDisplayName()],) = UsdSemantics.LabelsAPI(prim, "class").GetLabelsAttr().Get()
    assert rooms.apart_m(rooms.boxes(geometry), found) <= 0.001
    assert classes == {found.name: found.class_name for found in geometry.instances if found.class_name is not None}
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert meshes
    assert all(prim.HasAPI(UsdPhysics.CollisionAPI) for prim in meshes)
