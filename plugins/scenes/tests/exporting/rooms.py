"""Small scenes to be exported, and how their boxes are compared."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot_scenes.ground_truth import object_boxes
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.understanding import understand
from benchbot_scenes.scene import SceneGeometry
from plugins.scenes.tests.importing import places

Boxes = dict[str, npt.NDArray[np.float64]]


def labelled(folder: Path) -> Path:
    """A furnished room with its classes in the file."""
    path = folder / "room.glb"
    path.write_bytes(to_glb(understand(places.write(folder / "flat.glb", places.flat()), Guesses()).geometry))
    return path


def boxes(geometry: SceneGeometry) -> Boxes:
    """The corners (2, 3) of every object's box, by name."""
    return {name: np.array(box) for name, box in object_boxes(geometry).items()}


def apart_m(one: Boxes, other: Boxes) -> float:
    """The farthest that a face of a box is from the same of the other; the names must be the same."""
    assert one.keys() == other.keys()
    return max(float(np.abs(box - other[name]).max()) for name, box in one.items())


def marked(geometry: SceneGeometry) -> set[tuple[object, ...]]:
    """Every triangle, to a hundredth of a millimetre, with the name and class of its object: what masks show."""
    found = {instance.index: instance for instance in geometry.instances}
    corners = np.round(geometry.vertices[geometry.triangles].astype(float), 5).reshape(-1, 9) + 0.0
    return {
        (*place, found[index].name, found[index].class_name)
        for place, index in zip(map(tuple, corners.tolist()), geometry.triangle_instance.tolist(), strict=True)
    }
