"""Buildings from floor plans: floors, ceilings and walls that no light passes, and their trim."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon, box

from benchbot_scenes import finishes, mesh
from benchbot_scenes.floor_plan import Edge, FloorPlan, Passage, edges, walled
from benchbot_scenes.layout import Building, Room
from benchbot_scenes.mesh import FLOOR, Floats, Frame, Mesh

SLAB_M = 0.25
_SKIRTING_HIGH_M, _SKIRTING_DEEP_M = 0.08, 0.014
_CASING_WIDE_M, _CASING_DEEP_M, _CASING_OVERLAP_M = 0.062, 0.016, 0.006
_PORCH_M = 0.02
_SILL_M, _SILL_OUT_M = 0.022, 0.025
WINDOW_SETBACK_M = 0.11
"""Distance of the middle of a window's frame behind the outer face of a thick wall."""


@dataclass(frozen=True)
class Piece:
    """A part of the building that is one object of the scene: meshes, each with the name of its finish."""

    name: str
    parts: tuple[tuple[Mesh, str], ...]


def pieces(building: Building, plan: FloorPlan) -> Iterator[Piece]:
    """Everything of a building but what fills its openings."""
    for number, room in enumerate(building.rooms):
        polygon = plan.rooms[number]
        floor = _along_longer_side(mesh.face(polygon, FLOOR), polygon)
        yield Piece(f"floor {room.name}", ((floor, room.floor),))
        ceiling = mesh.face(polygon, FLOOR, building.height_m, is_back=True)
        yield Piece(f"ceiling {room.name}", ((ceiling, room.ceiling),))
        yield Piece(f"walls {room.name}", ((_walls(polygon, building.height_m, plan), room.walls),))
        if has_skirting(room):
            yield Piece(f"skirting {room.name}", ((_skirting(number, plan), finishes.TRIM),))
    for passage in plan.passages:
        yield Piece(f"reveal {passage.opening.name}", _reveal(building, passage))
        trim = _sill(passage) if passage.opening.kind == "window" else _casings(passage, plan, building.height_m)
        if len(trim.triangles):
            yield Piece(f"trim {passage.opening.name}", ((trim, finishes.TRIM),))
    yield Piece("facade", ((_facade(building.height_m, plan), finishes.FACADE),))


def has_skirting(room: Room) -> bool:
    """Tiled walls have none."""
    return not room.walls.startswith("wall_tiles")


def window_offset_m(depth_m: float, frame_m: float) -> float:
    """The distance of the middle of a window's frame behind the near face of its wall."""
    return depth_m - min(WINDOW_SETBACK_M, depth_m / 2) if depth_m > frame_m else depth_m / 2


def _upright(edge: Edge, height_m: float = 0.0) -> Frame:
    """The plane of a wall over a room's side, facing the room; u runs from the edge's end to its start, v is height."""
    return Frame((*edge.end, height_m), (*-edge.along, 0.0), (0.0, 0.0, 1.0))


def _walls(polygon: Polygon, height_m: float, plan: FloorPlan) -> Mesh:
    faces, start = [], 0.0
    for edge in edges(polygon):
        whole = shapely.union_all([box(low, 0.0, high, height_m) for low, high in walled(edge, plan.walls)])
        face = _open_face(edge, whole, plan)
        faces.append(face.with_uvs(face.uvs - [start, 0.0]))
        start += edge.length_m
    return mesh.merge(faces)


def _open_face(edge: Edge, whole: shapely.Geometry, plan: FloorPlan) -> Mesh:
    """A wall's face (along the edge × height) less its openings, facing the left of the edge."""
    holes = [(passage.opening, passage.on(edge)) for passage in plan.passages]
    cut = [box(reach[0], hole.bottom_m, reach[1], hole.top_m) for hole, reach in holes if reach is not None]
    face = shapely.difference(whole, shapely.union_all(cut), grid_size=1e-4)
    mirrored = shapely.transform(face, lambda points: np.array([edge.length_m, 0.0]) + points * [-1.0, 1.0])
    return mesh.face(mirrored, _upright(edge))


def _facade(height_m: float, plan: FloorPlan) -> Mesh:
    low, high = -SLAB_M, height_m + SLAB_M
    parts = [mesh.face(plan.footprint, FLOOR, high), mesh.face(plan.footprint, FLOOR, low, is_back=True)]
    for polygon in mesh.polygons(plan.footprint):
        for edge in edges(polygon):
            outward = Edge(edge.end, edge.start)
            parts.append(_open_face(outward, box(0.0, low, outward.length_m, high), plan))
    return mesh.merge([*parts, *map(_porch, filter(_has_porch, plan.passages))])


def _has_porch(passage: Passage) -> bool:
    """Closed doors to the outdoors do: a thin leaf alone would let daylight shine through its joints."""
    return passage.opening.kind == "door" and passage.far is None and passage.opening.open_deg == 0.0


def _porch(passage: Passage) -> Mesh:
    """The outer leaf of a double door, flush with the facade."""
    opening, half = passage.opening, passage.opening.width_m / 2
    face = passage.middle + passage.through * (passage.depth_m - _PORCH_M)
    # along × vertical is the way out.
    outward = Frame((*face, 0.0), (*passage.along, 0.0), (0.0, 0.0, 1.0))
    return mesh.block(outward, (-half, opening.bottom_m, 0.0), (half, opening.top_m, _PORCH_M))


def _reveal(building: Building, passage: Passage) -> tuple[tuple[Mesh, str], ...]:
    """The sides of an opening through its wall: painted like the trim around a door, like the wall around others."""
    opening, depth = passage.opening, passage.depth_m
    half = opening.width_m / 2
    near = building.rooms[passage.near]
    sides = finishes.TRIM if opening.kind == "door" else near.walls
    # (-along) × through is the vertical, through × vertical is -along.
    level = Frame((*passage.middle, 0.0), (*-passage.along, 0.0), (*passage.through, 0.0))
    strip = box(-half, 0.0, half, depth)
    bottom = mesh.face(strip, level, opening.bottom_m)
    top = mesh.face(strip, level, opening.top_m, is_back=True)
    upright = box(0.0, opening.bottom_m, depth, opening.top_m)
    jambs = []
    for side in (-half, half):
        frame = Frame((*(passage.middle + passage.along * side), 0.0), (*passage.through, 0.0), (0.0, 0.0, 1.0))
        jambs.append(mesh.face(upright, frame, is_back=side < 0))
    ground = near.floor if opening.bottom_m == 0.0 else sides
    return (bottom, ground), (mesh.merge([top, *jambs]), sides)


def _skirting(number: int, plan: FloorPlan) -> Mesh:
    room = plan.rooms[number]
    gaps = [_skirting_gap(passage) for passage in plan.passages if number in (passage.near, passage.far)]
    others = [
        other.buffer(0.03, join_style="mitre") for other in plan.rooms if other is not room and other.touches(room)
    ]
    ring = room.difference(room.buffer(-_SKIRTING_DEEP_M, join_style="mitre"))
    run = shapely.difference(ring, shapely.union_all([*gaps, *others]), grid_size=1e-5)
    return mesh.extrusion(run, FLOOR, 0.0, _SKIRTING_HIGH_M)


def _skirting_gap(passage: Passage) -> Polygon:
    if passage.opening.bottom_m >= _SKIRTING_HIGH_M:
        return Polygon()
    casing = _CASING_WIDE_M if passage.opening.kind == "door" else 0.0
    return passage.rectangle(casing, 0.05)


def _casings(passage: Passage, plan: FloorPlan, height_m: float) -> Mesh:
    """The boards around a door on both faces of its wall; a passage has none."""
    if passage.opening.kind != "door":
        return mesh.merge([])
    boards = []
    half, bottom, top = passage.opening.width_m / 2, passage.opening.bottom_m, passage.opening.top_m
    outer = box(-half - _CASING_WIDE_M, bottom, half + _CASING_WIDE_M, top + _CASING_WIDE_M)
    inner = box(-half + _CASING_OVERLAP_M, bottom - 1.0, half - _CASING_OVERLAP_M, top - _CASING_OVERLAP_M)
    for number, depth in ((passage.near, 0.0), (passage.far, passage.depth_m)):
        away = -passage.through if depth == 0.0 else passage.through
        right = np.array([-away[1], away[0]])
        middle = passage.middle + passage.through * depth
        low, high = _clear_wall(middle, right, away, plan, number)
        board = outer.difference(inner).intersection(box(low, 0.0, high, height_m))
        frame = Frame((*middle, 0.0), (*right, 0.0), (0.0, 0.0, 1.0))
        boards.append(mesh.extrusion(board, frame, 0.0, _CASING_DEEP_M, has_back=True))
    return mesh.merge(boards)


def _clear_wall(
    middle: Floats, right: Floats, away: Floats, plan: FloorPlan, number: int | None
) -> tuple[float, float]:
    """The length of a wall's face on either side of a door, up to the room's next corner."""
    if number is None:
        return -10.0, 10.0
    inside = plan.rooms[number]
    start = middle + away * 0.02
    line = shapely.LineString([start - right * 10.0, start + right * 10.0]).intersection(inside)
    run = min(shapely.get_parts(line), key=lambda part: part.distance(shapely.Point(start)))
    reach = sorted(float((np.array(point) - start) @ right) for point in run.coords)
    return reach[0], reach[-1]


def _sill(passage: Passage) -> Mesh:
    """The board under a window, from its frame to a little before the near face."""
    opening = passage.opening
    half, depth = opening.width_m / 2, window_offset_m(passage.depth_m, 0.08)
    # along × (-through) is the vertical.
    frame = Frame((*passage.middle, opening.bottom_m), (*passage.along, 0.0), (*-passage.through, 0.0))
    low, high = -_SILL_M / 2, _SILL_M / 2
    return mesh.block(frame, (-half, -depth, low), (half, _SILL_OUT_M, high))


def _along_longer_side(floor: Mesh, polygon: Polygon) -> Mesh:
    """Texture coordinates with u along the room's longer side, so that boards run along it."""
    low_x, low_y, high_x, high_y = polygon.bounds
    return floor if high_x - low_x >= high_y - low_y else floor.with_uvs(floor.uvs[:, ::-1] * [1.0, -1.0])
