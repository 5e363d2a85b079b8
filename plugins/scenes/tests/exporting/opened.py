"""Exported files as the programs that they are for open them."""

from pathlib import Path

import mujoco
import numpy as np

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


def written(files: dict[str, bytes], folder: Path) -> Path:
    """Write an export's files; returns the folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder
