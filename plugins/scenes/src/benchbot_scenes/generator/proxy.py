"""A layout as boxes: enough to plan a trajectory in, long before it is composed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.generator.floor_plan import INNER_WALL_M, Space
from benchbot_scenes.generator.plot import Item
from benchbot_scenes.layout import Opening
from benchbot_scenes.scene import Instance, Material, SceneGeometry

Floats = npt.NDArray[np.float64]
# Board thickness of what has shelves, and of a door's leaf.
BOARD_M, LEAF_M, FRAME_M = 0.03, 0.05, 0.05
# One looks over seats, before their backs.
SEATS, SEAT_SHARE, BACK_M = ("chair", "couch"), 0.55, 0.10
# How far from a leaf's free end its handle begins, and how far the leaf reaches with it.
HANDLE_M = (0.20, 0.14)
_HALVES = np.array([[0, 1, 2], [0, 2, 3]])


@dataclass(frozen=True)
class Shape:
    """Triangles (T, 3, 3) of one instance."""

    name: str
    class_name: str | None
    triangles: Floats


def proxy(
    spaces: Sequence[Space], openings: Sequence[Opening], items: Sequence[Item], height_m: float
) -> SceneGeometry:
    """Walls and floors of a plan, and a box (or boards) for each item."""
    structure = [*_floors(spaces, openings), *_walls(spaces, openings, height_m), *_leaves(spaces, openings)]
    shapes = [Shape("building", None, np.concatenate(structure))]
    shapes += [Shape(item.placement.id, item.model.class_name, _item(item)) for item in items]
    return geometry(shapes)


def geometry(shapes: Sequence[Shape]) -> SceneGeometry:
    """Shapes as one scene."""
    corners = np.concatenate([shape.triangles for shape in shapes])
    counts = [len(shape.triangles) for shape in shapes]
    vertices = corners.reshape(-1, 3).astype(np.float32)
    return SceneGeometry(
        vertices=vertices,
        triangles=np.arange(len(vertices), dtype=np.int32).reshape(-1, 3),
        triangle_instance=np.repeat(np.arange(1, len(shapes) + 1, dtype=np.int32), counts),
        triangle_material=np.zeros(len(corners), np.int32),
        normals=np.tile(np.array([0.0, 0.0, 1.0], np.float32), (len(vertices), 1)),
        uvs=np.zeros((len(vertices), 2), np.float32),
        materials=(Material(),),
        instances=tuple(Instance(number, shape.name, shape.class_name) for number, shape in enumerate(shapes, 1)),
    )


def _item(item: Item) -> Floats:
    size_x, size_y, size_z = item.size_m
    scale = [item.size_m[i] / item.model.size_m[i] for i in range(3)]
    boxes = [((-size_x / 2, -size_y / 2, 0.0), (size_x / 2, size_y / 2, size_z))]
    if item.model.class_name in SEATS:
        seat_m = SEAT_SHARE * size_z
        boxes = [((-size_x / 2, -size_y / 2, 0.0), (size_x / 2, size_y / 2, seat_m))]
        boxes.append(((-size_x / 2, -size_y / 2, seat_m), (-size_x / 2 + BACK_M, size_y / 2, size_z)))
    elif item.model.class_name == "table":
        boxes = [((-size_x / 2, -size_y / 2, size_z - BOARD_M), (size_x / 2, size_y / 2, size_z))]
    elif _is_open(item.model):
        # What stands on shelves is seen between the boards.
        levels = [0.0, *(surface.z_m * scale[2] - BOARD_M for surface in item.model.surfaces)]
        boxes = [((-size_x / 2, -size_y / 2, z), (size_x / 2, size_y / 2, z + BOARD_M)) for z in levels]
        boxes.append(((-size_x / 2, -size_y / 2, 0.0), (-size_x / 2 + 0.01, size_y / 2, size_z)))
    return np.concatenate([_box(item, low, high) for low, high in boxes])


def _is_open(model: AssetModel) -> bool:
    return any(surface.z_m < 0.9 * model.size_m[2] for surface in model.surfaces)


def _box(item: Item, low: tuple[float, float, float], high: tuple[float, float, float]) -> Floats:
    z = item.placement.position[2]
    ground = [item.place(x, y) for x, y in ((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1]))]
    return prism(ground, z + low[2], z + high[2])


def prism(ground: Sequence[tuple[float, float]], bottom_m: float, top_m: float) -> Floats:
    """The triangles of an upright prism over a quadrilateral."""
    lower, upper = ([(x, y, z) for x, y in ground] for z in (bottom_m, top_m))
    quads = [lower, upper]
    quads += [[lower[i], lower[(i + 1) % 4], upper[(i + 1) % 4], upper[i]] for i in range(4)]
    return np.array(quads)[:, _HALVES].reshape(-1, 3, 3)


def _floors(spaces: Sequence[Space], openings: Sequence[Opening]) -> Iterator[Floats]:
    for space in spaces:
        (x0, y0), (x1, y1) = space.low, space.high
        yield _flat(x0, y0, x1, y1)
    for opening in openings:
        if opening.bottom_m == 0.0:
            (x, y), half = opening.at, opening.width_m / 2
            thin = INNER_WALL_M / 2 + 0.03
            yield (
                _flat(x - half, y - thin, x + half, y + thin)
                if _runs_along_x(opening, spaces)
                else _flat(x - thin, y - half, x + thin, y + half)
            )


def _runs_along_x(opening: Opening, spaces: Sequence[Space]) -> bool:
    """Return whether the wall that an opening is in runs along x: a room ends just above or below it."""
    x, y = opening.at
    return any(
        space.low[0] < x < space.high[0] and min(abs(y - space.low[1]), abs(y - space.high[1])) < 0.2
        for space in spaces
    )


def _flat(x0: float, y0: float, x1: float, y1: float) -> Floats:
    return _quad([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])


def _walls(spaces: Sequence[Space], openings: Sequence[Opening], height_m: float) -> Iterator[Floats]:
    for space in spaces:
        (x0, y0), (x1, y1) = space.low, space.high
        for axis, level, low, high in ((0, y0, x0, x1), (0, y1, x0, x1), (1, x0, y0, y1), (1, x1, y0, y1)):
            holes = sorted(
                (opening.at[axis] - opening.width_m / 2, opening.at[axis] + opening.width_m / 2, opening)
                for opening in openings
                if low < opening.at[axis] < high and abs(opening.at[1 - axis] - level) < 0.2
            )
            along = low
            for start, end, opening in holes:
                yield _panel(axis, level, along, start, 0.0, height_m)
                yield _panel(axis, level, start, end, opening.top_m, height_m)
                if opening.bottom_m > 0 or _is_outer(opening, spaces):
                    yield _panel(axis, level, start, end, 0.0, opening.bottom_m or opening.top_m)
                along = end
            yield _panel(axis, level, along, high, 0.0, height_m)


def _is_outer(opening: Opening, spaces: Sequence[Space]) -> bool:
    """Return whether an opening leads out of doors: only one room is beside it."""
    x, y = opening.at
    beside = [
        space
        for space in spaces
        if space.low[0] - 0.2 < x < space.high[0] + 0.2 and space.low[1] - 0.2 < y < space.high[1] + 0.2
    ]
    return len(beside) < 2


def _leaves(spaces: Sequence[Space], openings: Sequence[Opening]) -> Iterator[Floats]:
    """Open doors, at right angles to their walls, in the room that is nearer."""
    for opening in openings:
        if opening.open_deg == 0.0:
            continue
        at = np.array(opening.at)
        middle, inward = min(
            (_nearest_face(space, opening.at) for space in spaces), key=lambda face: math.dist(face[0], at)
        )
        right = np.array([inward[1], -inward[0]]) * (1.0 if opening.open_deg > 0 else -1.0)
        hinge = np.array(middle) + right * (opening.width_m / 2 - FRAME_M)
        beyond = math.radians(abs(opening.open_deg) - 90.0)
        ahead = math.cos(beyond) * inward + math.sin(beyond) * right
        aside = math.sin(beyond) * inward - math.cos(beyond) * right
        length_m = opening.width_m - 2 * FRAME_M
        for start_m, thick_m in ((0.0, LEAF_M), (length_m - HANDLE_M[0], HANDLE_M[1])):
            corners = [
                hinge + along * ahead + off * aside
                for along, off in ((start_m, 0.0), (length_m, 0.0), (length_m, thick_m), (start_m, thick_m))
            ]
            yield prism([(float(x), float(y)) for x, y in corners], 0.0, opening.top_m)


def _nearest_face(space: Space, at: tuple[float, float]) -> tuple[tuple[float, float], Floats]:
    """The point of a room's walls nearest to a point, and the direction from there into the room."""
    (x0, y0), (x1, y1) = space.low, space.high
    x, y = min(max(at[0], x0), x1), min(max(at[1], y0), y1)
    faces = [
        ((x0, y), np.array([1.0, 0.0])),
        ((x1, y), np.array([-1.0, 0.0])),
        ((x, y0), np.array([0.0, 1.0])),
        ((x, y1), np.array([0.0, -1.0])),
    ]
    return min(faces, key=lambda face: math.dist(face[0], at))


def _panel(axis: int, level: float, start: float, end: float, bottom_m: float, top_m: float) -> Floats:
    if axis == 0:
        return _quad([(start, level, bottom_m), (end, level, bottom_m), (end, level, top_m), (start, level, top_m)])
    return _quad([(level, start, bottom_m), (level, end, bottom_m), (level, end, top_m), (level, start, top_m)])


def _quad(corners: Sequence[tuple[float, float, float]]) -> Floats:
    halves: Floats = np.array(corners)[_HALVES]
    return halves


def class_counts(items: Sequence[Item]) -> Mapping[str, int]:
    """The number of items of each class."""
    counts: dict[str, int] = {}
    for item in items:
        if item.model.class_name:
            counts[item.model.class_name] = counts.get(item.model.class_name, 0) + 1
    return dict(sorted(counts.items()))
