"""A building from above: which ground its rooms and walls take, and where its openings pass through the walls."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Point, Polygon

from benchbot.plugin import BenchbotError
from benchbot_scenes.layout import Building, Opening
from benchbot_scenes.mesh import polygons

Vector = npt.NDArray[np.float64]

_GRID_M = 1e-4
_TOLERANCE_M = 2e-3
_CORNER_M = 5e-3
_SHAFT_M2 = 2.0


@dataclass(frozen=True)
class Edge:
    """A straight side of a room or of the building, from `start` to `end` with the room, or the walls, on its left."""

    start: Vector
    end: Vector

    @property
    def length_m(self) -> float:
        """From start to end."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def along(self) -> Vector:
        """The unit vector from start to end."""
        return np.asarray((self.end - self.start) / self.length_m)

    @property
    def right(self) -> Vector:
        """The unit vector to the right: of a room's side, into the wall."""
        x, y = self.along
        return np.array([y, -x])

    def coordinates(self, point: Vector) -> tuple[float, float]:
        """The distance of a point along the edge, and its distance to the right of the edge."""
        offset = point - self.start
        return float(offset @ self.along), float(offset @ self.right)


@dataclass(frozen=True)
class Passage:
    """An opening where it passes through its wall.

    `middle` is the middle of its width on the near face of the wall, `along` and `through` unit vectors along the near
    room's side and through the wall away from that room; `depth_m` is the wall's thickness there. `near` and `far` are
    rooms by number; `far` is None outdoors.
    """

    opening: Opening
    middle: Vector
    along: Vector
    through: Vector
    depth_m: float
    near: int
    far: int | None

    def rectangle(self, more_width_m: float = 0.0, more_depth_m: float = 0.0) -> Polygon:
        """Its plan, wider on either side and deeper on either face by so much."""
        half = self.along * (self.opening.width_m / 2 + more_width_m)
        low, high = self.through * -more_depth_m, self.through * (self.depth_m + more_depth_m)
        corners = [-half + low, half + low, half + high, -half + high]
        return Polygon([tuple(self.middle + corner) for corner in corners])

    def on(self, edge: Edge) -> tuple[float, float] | None:
        """The stretch of an edge that it opens, or None."""
        for depth in (0.0, self.depth_m):
            middle, aside = edge.coordinates(self.middle + self.through * depth)
            half = self.opening.width_m / 2
            parallel = abs(float(edge.along @ self.through)) < 1e-6
            if parallel and abs(aside) < _TOLERANCE_M and -half < middle < edge.length_m + half:
                return middle - half, middle + half
        return None


@dataclass(frozen=True)
class FloorPlan:
    """`rooms` in the building's order, counter-clockwise; `walls` is the ground between and around them, `footprint`
    all of it. Rooms that touch are open to each other.
    """

    rooms: tuple[Polygon, ...]
    walls: shapely.Geometry
    footprint: shapely.Geometry
    passages: tuple[Passage, ...]


def floor_plan(building: Building) -> FloorPlan:
    """Lay out a building's walls; raises BenchbotError for rooms or openings that cannot be."""
    names = [room.name for room in building.rooms]
    _require_unique(names, "rooms")
    _require_unique([opening.name for opening in building.openings], "openings")
    rooms = tuple(_room(room.name, room.outline) for room in building.rooms)
    _require_apart(rooms, names)
    inside = shapely.union_all(rooms, grid_size=_GRID_M)
    footprint = shapely.union_all(
        [room.buffer(building.wall_m, join_style="mitre") for room in rooms], grid_size=_GRID_M
    )
    footprint = shapely.union_all([_without_shafts(part) for part in polygons(footprint)])
    walls = shapely.difference(footprint, inside, grid_size=_GRID_M)
    passages = tuple(_passage(opening, rooms, walls, building) for opening in building.openings)
    for index, passage in enumerate(passages):
        for other in passages[:index]:
            _require_separate(passage, other)
    return FloorPlan(rooms, walls, footprint, passages)


def edges(polygon: Polygon) -> list[Edge]:
    """The sides of a counter-clockwise polygon and of its holes."""
    rings = [np.asarray(ring.coords)[:, :2] for ring in (polygon.exterior, *polygon.interiors)]
    return [Edge(*pair) for ring in rings for pair in pairwise(ring)]


def walled(edge: Edge, walls: shapely.Geometry) -> list[tuple[float, float]]:
    """The stretches of a room's side that have wall behind them."""
    inset = edge.right * 1e-3
    behind = LineString([edge.start + inset, edge.end + inset]).intersection(walls)
    stretches = []
    for part in shapely.get_parts(behind):
        if isinstance(part, LineString) and part.length > 1e-6:
            low, high = sorted(edge.coordinates(np.array(point))[0] for point in (part.coords[0], part.coords[-1]))
            low = 0.0 if low < _CORNER_M else round(low, 4)
            stretches.append((low, edge.length_m if high > edge.length_m - _CORNER_M else round(high, 4)))
    return stretches


def _room(name: str, outline: tuple[tuple[float, float], ...]) -> Polygon:
    polygon = Polygon(outline)
    if not polygon.is_valid or polygon.area < 1e-2:
        why = shapely.is_valid_reason(polygon) if not polygon.is_valid else f"Its floor has {polygon.area:g} m²."
        raise BenchbotError(
            f"The outline of the room '{name}' is not a floor.",
            why,
            "Give the corners in order around the room, without crossing yourself.",
        )
    snapped = polygons(shapely.set_precision(polygon, _GRID_M))
    return polygons(snapped[0].simplify(_GRID_M / 10))[0]


def _require_unique(names: list[str], what: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BenchbotError(
            f"Two {what} of a building are named '{twice[0]}'.",
            "Names tell them apart.",
            "Give each a name of its own.",
        )


def _require_apart(rooms: tuple[Polygon, ...], names: list[str]) -> None:
    for index, room in enumerate(rooms):
        for other in range(index):
            overlap = room.intersection(rooms[other])
            if overlap.area > 1e-6:
                low_x, low_y, high_x, high_y = overlap.bounds
                raise BenchbotError(
                    f"The rooms '{names[other]}' and '{names[index]}' overlap.",
                    f"They share {overlap.area:.2f} m² of floor: x {low_x:g} to {high_x:g}, y {low_y:g} to {high_y:g}.",
                    "Move the outlines apart: by a wall's thickness, or until they touch where no wall is to be.",
                )


def _without_shafts(part: Polygon) -> Polygon:
    """Small spaces that walls close off on all sides become wall; larger ones stay, as courtyards."""
    return Polygon(part.exterior, [hole for hole in part.interiors if Polygon(hole).area > _SHAFT_M2])


def _passage(opening: Opening, rooms: tuple[Polygon, ...], walls: shapely.Geometry, building: Building) -> Passage:
    if not 0.0 <= opening.bottom_m < opening.top_m <= building.height_m:
        raise BenchbotError(
            f"The opening '{opening.name}' does not fit the height of its wall.",
            f"It reaches from {opening.bottom_m:g} to {opening.top_m:g} m; the wall from 0 to {building.height_m:g} m.",
            "Correct its bottom_m and top_m.",
        )
    at, reach = np.array(opening.at), 2.0 * building.wall_m
    found: list[tuple[float, int, Edge, float]] = []
    for number, room in enumerate(rooms):
        for edge in edges(room):
            along, aside = edge.coordinates(at)
            half = opening.width_m / 2 - _TOLERANCE_M
            if -_TOLERANCE_M <= aside <= reach + _TOLERANCE_M and half <= along <= edge.length_m - half:
                found.append((round(max(aside, 0.0), 4), number, edge, along))
    for _, number, edge, along in sorted(found, key=lambda entry: entry[:2]):
        passage = _through(opening, number, edge, along, rooms, walls, reach)
        if passage is not None:
            return passage
    nearest = min(range(len(rooms)), key=lambda number: rooms[number].exterior.distance(Point(at)))
    gap = rooms[nearest].exterior.distance(Point(at))
    raise BenchbotError(
        f"The opening '{opening.name}' is in no wall.",
        f"No straight piece of wall around ({at[0]:g}, {at[1]:g}) is {opening.width_m:g} m wide with one room, or the "
        f"outdoors, on either side. The nearest room is '{building.rooms[nearest].name}', its side {gap:.2f} m away.",
        "Put 'at' into the wall, further from its corners, or make the opening narrower. "
        "Rooms that touch have no wall between them.",
    )


def _through(
    opening: Opening,
    near: int,
    edge: Edge,
    along: float,
    rooms: tuple[Polygon, ...],
    walls: shapely.Geometry,
    reach: float,
) -> Passage | None:
    """The opening through the wall behind a room's side, or None when there is no such wall."""
    middle, through = edge.start + edge.along * along, edge.right
    ray = LineString([middle + through * 1e-3, middle + through * (2 * reach)]).intersection(walls)
    pieces = [part for part in shapely.get_parts(ray) if isinstance(part, LineString) and part.length > 0]
    first = min(pieces, key=lambda part: part.distance(Point(middle)), default=None)
    if first is None or first.distance(Point(middle)) > _TOLERANCE_M:
        return None
    depth = round(max(float((np.array(point) - middle) @ through) for point in first.coords), 4)
    at_depth = float((np.array(opening.at) - middle) @ through)
    if depth > reach + _TOLERANCE_M or at_depth > depth + _TOLERANCE_M:
        return None
    beyond = Point(middle + through * (depth + _TOLERANCE_M))
    far = next((number for number, room in enumerate(rooms) if room.contains(beyond)), None)
    passage = Passage(opening, middle, edge.along, through, depth, near, far)
    hole = passage.rectangle(-_GRID_M, -_GRID_M)
    behind = passage.rectangle(-_GRID_M, _TOLERANCE_M)
    if not walls.buffer(_GRID_M).covers(hole) or walls.buffer(-_GRID_M).intersects(
        behind.difference(passage.rectangle(1, 0))
    ):
        return None
    return passage


def _require_separate(passage: Passage, other: Passage) -> None:
    first, second = passage.opening, other.opening
    if passage.rectangle().intersection(other.rectangle()).area > 1e-6 and min(first.top_m, second.top_m) > max(
        first.bottom_m, second.bottom_m
    ):
        raise BenchbotError(
            f"The openings '{second.name}' and '{first.name}' overlap.",
            "They take the same piece of wall.",
            "Move one along the wall, or make it narrower.",
        )
