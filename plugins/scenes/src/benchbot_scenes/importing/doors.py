"""Closed doors of a scene, which are left out so that a robot can pass."""

from collections.abc import Sequence

import numpy as np
import shapely

from benchbot_scenes.free_space import FreeSpace
from benchbot_scenes.importing.names import words
from benchbot_scenes.importing.objects import Found
from benchbot_scenes.scene import SceneGeometry

DOORS = frozenset(
    ("door", "doors", "doorleaf", "tür", "türen", "tuer", "tueren", "porte", "portes", "puerta", "puertas", "porta",
     "deur", "dörr", "dør")
)  # fmt: skip
"""Doors in English, German, French, Spanish, Italian and Portuguese, Dutch, Swedish, Danish and Norwegian."""
ENDINGS = ("tür", "tuer", "deur", "dörr", "dør")
"""Languages that write compounds as one word: Innentür, Haustuer, voordeur."""
PARTS = frozenset(
    ("frame", "jamb", "handle", "knob", "lock", "hinge", "bell", "mat", "stop", "stopper", "sill", "lintel", "rahmen",
     "zarge", "griff", "klinke", "schwelle", "way")
)  # fmt: skip
OTHERS = frozenset(
    ("cabinet", "cupboard", "wardrobe", "closet", "fridge", "refrigerator", "freezer", "oven", "microwave", "shower",
     "car", "garage", "dishwasher", "schranktür", "schranktuer", "duschtür", "kühlschranktür")
)  # fmt: skip
HEIGHT_M, WIDTH_M = (1.7, 2.8), (0.5, 3.0)
STANDS_M = 0.3
BESIDE_M = 0.6


def is_door(path: Sequence[str]) -> bool:
    """Return whether names that lead to a mesh are those of a door, as "IfcDoor" or "Innentür-3" are.

    Doors of furniture are none, and neither are frames and handles.
    """
    said = [words(step) for step in path]
    spoken = {word for step in said for word in step}
    if not said or not spoken.isdisjoint(OTHERS) or (said[-1] and said[-1][-1] in PARTS):
        return False
    return any(word in DOORS or word.endswith(ENDINGS) for word in spoken)


def closed(geometry: SceneGeometry, objects: Sequence[Found], space: FreeSpace) -> list[int]:
    """The numbers (from 1) of the objects that are doors between two places with a floor."""
    found = []
    for number, candidate in enumerate(objects, start=1):
        if candidate.class_name is not None or not is_door(candidate.path):
            continue
        points = geometry.vertices[geometry.triangles[geometry.triangle_instance == number]].reshape(-1, 3)
        if len(points) and _is_passage(points.astype(np.float64), space):
            found.append(number)
    return found


def _is_passage(points: np.ndarray[tuple[int, ...], np.dtype[np.float64]], space: FreeSpace) -> bool:
    """Return whether a body has the size of a door, stands, and has floor on both of its broad sides."""
    low, high = points.min(0), points.max(0)
    if not HEIGHT_M[0] <= high[2] - low[2] <= HEIGHT_M[1] or abs(low[2]) > STANDS_M:
        return False
    box = shapely.MultiPoint(points[:, :2]).minimum_rotated_rectangle
    if isinstance(box, shapely.Polygon):
        corners = np.asarray(box.exterior.coords)[:4]
    elif isinstance(box, shapely.LineString):  # a leaf without thickness
        corners = np.asarray(box.coords)[[0, -1, -1, 0]]
    else:
        return False
    sides = corners[1:3] - corners[:2]
    lengths = np.linalg.norm(sides, axis=1)
    along = sides[int(lengths.argmax())]
    if not WIDTH_M[0] <= lengths.max() <= WIDTH_M[1]:
        return False
    across = np.array([-along[1], along[0]]) / lengths.max() * (BESIDE_M + lengths.min() / 2)
    middle = corners.mean(0)
    return all(_has_floor(space, *(middle + sign * across)) for sign in (-1.0, 1.0))


def _has_floor(space: FreeSpace, x: float, y: float) -> bool:
    column, row = space.cell(x, y)
    return 0 <= column < space.shape[0] and 0 <= row < space.shape[1] and bool(space.has_floor[column, row])
