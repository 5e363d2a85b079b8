"""Exported files as the programs that they are for open them."""

from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import trimesh
from pxr import Usd, UsdGeom

from benchbot_scenes.exporting.sdf import CLASS
from plugins.scenes.tests.exporting.rooms import Boxes

VISUAL, COLLISION = 2, 3


def mujoco_boxes(model: mujoco.MjModel, group: int) -> Boxes:
    """The box of each body's geoms of a group, by the body's name."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found: Boxes = {}
    for geom in np.flatnonzero(model.geom_group == group):
        mesh = model.geom_dataid[geom]
        start = model.mesh_vertadr[mesh]
        points = model.mesh_vert[start : start + model.mesh_vertnum[mesh]]
        placed = points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        box = np.array([placed.min(axis=0), placed.max(axis=0)])
        name = model.body(model.geom_bodyid[geom]).name
        before = found.get(name, box)
        found[name] = np.array([np.minimum(before[0], box[0]), np.maximum(before[1], box[1])])
    return found


def mujoco_classes(path: Path) -> dict[str, str]:
    """The classes of bodies, from a model's custom texts."""
    spec = mujoco.MjSpec.from_file(str(path))
    return {text.name.removeprefix("class/"): text.data for text in spec.texts}


def usd_boxes(path: Path) -> Boxes:
    """The box of each object of a USD stage, by its display name."""
    stage = Usd.Stage.Open(str(path))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"])
    found: Boxes = {}
    for prim in stage.GetPrimAtPath("/World").GetChildren():
        if prim.GetName() not in ("materials", "lamps"):
            box = cache.ComputeWorldBound(prim).ComputeAlignedRange()
            found[prim.GetDisplayName()] = np.array([box.GetMin(), box.GetMax()])
    return found


def drake_boxes(path: Path) -> Boxes:
    """The box of what is seen of each model of an SDFormat world, by the model's name."""
    from pydrake import all as drake

    plant, graph = drake.AddMultibodyPlantSceneGraph(drake.DiagramBuilder(), 0.0)
    models = drake.Parser(plant).AddModels(str(path))
    inspector = graph.model_inspector()
    found: Boxes = {}
    for model in models:
        (body,) = plant.GetBodyIndices(model)
        frame = plant.GetBodyFrameIdOrThrow(body)
        shapes = [inspector.GetShape(one) for one in inspector.GetGeometries(frame, drake.Role.kIllustration)]
        meshes = [trimesh.load_mesh(shape.source().path()).bounds for shape in shapes]
        found[plant.GetModelInstanceName(model)] = np.array(
            [np.min([low for low, _ in meshes], axis=0), np.max([high for _, high in meshes], axis=0)]
        )
    return found


def sdf_classes(path: Path) -> dict[str, str]:
    """The classes of models, from what Gazebo's label plug-in is told; numbers and classes belong to each other."""
    names: dict[str, str] = {}
    numbers: dict[str, str] = {}
    for model in ET.parse(path).getroot().iter("model"):
        for plugin in model.iter("plugin"):
            names[model.attrib["name"]] = plugin.findtext(CLASS, "")
            number = plugin.findtext("label", "")
            assert numbers.setdefault(number, names[model.attrib["name"]]) == names[model.attrib["name"]]
    assert len(set(numbers.values())) == len(numbers)
    assert all(0 < int(number) < 256 for number in numbers)
    return names


def written(files: dict[str, bytes], folder: Path) -> Path:
    """Write an export's files; returns the folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder
