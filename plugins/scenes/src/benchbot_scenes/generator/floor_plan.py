"""Floor plans: a room that one enters, a hall that leads from it, rooms on both sides, doors and windows.

Every room is a rectangle on a 5 cm grid, and each has a door to the hall, or a wide passage to the room one enters.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchbot_scenes.generator.kinds import FUNCTIONS, Kind
from benchbot_scenes.layout import Opening, OpeningKind, Point

GRID_M = 0.05
INNER_WALL_M = 0.10
OUTER_WALL_M = 0.25
DOOR_WIDTH_M, DOOR_TOP_M = 1.00, 2.05
# Doors belong to the room that they open into: their middle lies this far behind its wall.
INTO_WALL_M = 0.02
OPEN_DEG = 100.0
FRONT_DOOR_M, FRONT_DOOR_TOP_M = 1.00, 2.10
WINDOW_TOP_M = 2.20
# What has no door but a wide passage, on the same side of the hall.
BESIDE_HUB = ("kitchen", "pantry")
# From a corner to the nearest edge of a hole in a wall.
CORNER_M = 0.30


@dataclass(frozen=True)
class Space:
    """A room of a plan: a rectangle between its inner wall faces."""

    name: str
    function: str
    low: Point
    high: Point


@dataclass(frozen=True)
class Plan:
    """Rooms, the one that is entered first, and the holes in their walls."""

    spaces: tuple[Space, ...]
    openings: tuple[Opening, ...]


def floor_plan(kind: Kind, room_count: int, rng: np.random.Generator) -> Plan:
    """Draw a plan of so many rooms (a hall is not counted), turned and mirrored; its first room is about (0, 0)."""
    functions = kind.rooms(room_count)
    spaces = _rooms(kind, functions, rng)
    openings = [*_doors(spaces, rng), *_windows(spaces)]
    return _turned(Plan(tuple(spaces), tuple(openings)), rng)


def snap(value: float) -> float:
    """The nearest multiple of the grid."""
    return round(round(value / GRID_M) * GRID_M, 4)


def _rooms(kind: Kind, functions: Sequence[str], rng: np.random.Generator) -> list[Space]:
    names = _names(functions)
    widths = [_draw(FUNCTIONS[function].width_m, rng) for function in functions]
    hub_width = widths[0]
    if len(functions) <= 3:
        return _few_rooms(kind, functions, names, widths, rng)
    beside = next((number for number, function in enumerate(functions) if function in BESIDE_HUB), None)
    north, south = _split([number for number in range(1, len(functions)) if number != beside], widths)
    depth_n, depth_s = _draw(kind.depth_m, rng), _draw(kind.depth_m, rng)
    length = max(_strip_length(strip, widths) for strip in (north, south))
    hall_low = (snap(hub_width + INNER_WALL_M), snap(depth_s + INNER_WALL_M))
    hall_high = (snap(hall_low[0] + length), snap(hall_low[1] + kind.corridor_m))
    top = snap(hall_high[1] + INNER_WALL_M + depth_n)
    hub_top = (
        top if beside is None else snap(max(hall_high[1] + 0.3, top - _draw(FUNCTIONS[functions[beside]].width_m, rng)))
    )
    spaces = [
        Space(names[0], functions[0], (0.0, 0.0), (hub_width, hub_top)),
        Space("hall", "hall", hall_low, hall_high),
    ]
    if beside is not None:
        low = (0.0, snap(hub_top + INNER_WALL_M))
        spaces.append(Space(names[beside], functions[beside], low, (hub_width, top)))
    for strip, y_low, y_high in ((south, 0.0, depth_s), (north, snap(hall_high[1] + INNER_WALL_M), top)):
        stretch = (length - (len(strip) - 1) * INNER_WALL_M) / math.fsum(widths[number] for number in strip)
        x = hall_low[0]
        for position, number in enumerate(strip):
            last = position == len(strip) - 1
            end = hall_high[0] if last else snap(x + stretch * widths[number])
            spaces.append(Space(names[number], functions[number], (x, y_low), (end, y_high)))
            x = snap(end + INNER_WALL_M)
    return spaces


def _few_rooms(
    kind: Kind, functions: Sequence[str], names: Sequence[str], widths: Sequence[float], rng: np.random.Generator
) -> list[Space]:
    """The room that is entered, and up to two others in a column beside it."""
    others = widths[1:]
    depth = snap(max(4.6, math.fsum(max(2.4, width) for width in others) + INNER_WALL_M * max(0, len(others) - 1)))
    spaces = [Space(names[0], functions[0], (0.0, 0.0), (widths[0], depth))]
    side = _draw(kind.depth_m, rng)
    low_x, y = snap(widths[0] + INNER_WALL_M), 0.0
    for number, width in enumerate(others, 1):
        share = max(2.4, width) / math.fsum(max(2.4, other) for other in others)
        end = depth if number == len(others) else snap(share * depth)
        spaces.append(Space(names[number], functions[number], (low_x, y), (snap(low_x + side), end)))
        y = snap(end + INNER_WALL_M)
    return spaces


def _split(numbers: list[int], widths: Sequence[float]) -> tuple[list[int], list[int]]:
    """Two strips about equally long."""
    strips: tuple[list[int], list[int]] = ([], [])
    lengths = [0.0, 0.0]
    for number in sorted(numbers, key=lambda number: -widths[number]):
        side = int(lengths[1] < lengths[0])
        strips[side].append(number)
        lengths[side] += widths[number]
    return sorted(strips[0]), sorted(strips[1])


def _strip_length(strip: Sequence[int], widths: Sequence[float]) -> float:
    return snap(math.fsum(widths[number] for number in strip) + INNER_WALL_M * (len(strip) - 1))


def _names(functions: Sequence[str]) -> list[str]:
    names = []
    for position, function in enumerate(functions):
        before = functions[:position].count(function)
        name = function if functions.count(function) == 1 else f"{function} {before + 1}"
        names.append(name)
    return names


def _doors(spaces: Sequence[Space], rng: np.random.Generator) -> list[Opening]:
    hub = spaces[0]
    hall = next((space for space in spaces if space.function == "hall"), None)
    wall_x = hub.high[0] + INNER_WALL_M / 2
    doors = [_front_door(hub)]
    if hall is not None:
        middle_y = (hall.low[1] + hall.high[1]) / 2
        doors.append(_opening("hall passage", "passage", (wall_x, middle_y), 1.2, 0.0, 2.2))
    for space in spaces[1:]:
        if space is hall:
            continue
        if space.low[0] == hub.low[0]:
            middle = (snap(hub.low[0] + 0.3 * (hub.high[0] - hub.low[0])), hub.high[1] + INNER_WALL_M / 2)
            doors.append(_opening(f"{space.name} passage", "passage", middle, 1.5, 0.0, 2.2))
        elif hall is None:
            y, is_high = _door_place(space.low[1], space.high[1], rng)
            # Seen into the room (+x), a hinge on the right is towards -y.
            doors.append(_door(space, (space.low[0] - INTO_WALL_M, y), hinge_right=not is_high))
        else:
            is_south = space.high[1] < hall.low[1]
            y = space.high[1] + INTO_WALL_M if is_south else space.low[1] - INTO_WALL_M
            x, is_high = _door_place(space.low[0], space.high[0], rng)
            doors.append(_door(space, (x, y), hinge_right=is_high != is_south))
    return doors


def _door(space: Space, at: Point, *, hinge_right: bool) -> Opening:
    """Open, its leaf at the side of the nearer corner."""
    open_deg = OPEN_DEG if hinge_right else -OPEN_DEG
    return Opening(f"{space.name} door", "door", at, DOOR_WIDTH_M, 0.0, DOOR_TOP_M, open_deg=open_deg)


def _front_door(hub: Space) -> Opening:
    near_hall = hub.high[0] - CORNER_M - FRONT_DOOR_M / 2 - 0.3
    at = (near_hall, hub.low[1] - OUTER_WALL_M / 2)
    return _opening("front door", "door", at, FRONT_DOOR_M, 0.0, FRONT_DOOR_TOP_M)


def _door_place(low: float, high: float, rng: np.random.Generator) -> tuple[float, bool]:
    """Near one of the corners, so that furniture has the rest of the wall; and whether that is the higher one."""
    inset = CORNER_M + DOOR_WIDTH_M / 2
    is_high = bool(rng.random() < 0.5)
    return snap(high - inset if is_high else low + inset), is_high


def _windows(spaces: Sequence[Space]) -> list[Opening]:
    hub = spaces[0]
    bottom, top = min(space.low[1] for space in spaces), max(space.high[1] for space in spaces)
    end = max(space.high[0] for space in spaces)
    windows: list[Opening] = []

    def add(space: Space, low: float, high: float, place: Callable[[float], Point]) -> None:
        for middle, width in _window_places(low, high, space.function):
            sill = FUNCTIONS[space.function].window_bottom_m
            name = f"{space.name} window {len(windows) + 1}"
            windows.append(_opening(name, "window", place(middle), width, sill, WINDOW_TOP_M))

    outside = OUTER_WALL_M / 2
    for space in spaces:
        if space.low[0] == hub.low[0] and space.function not in BESIDE_HUB:
            add(space, space.low[1], space.high[1], lambda y: (hub.low[0] - outside, y))
        if abs(space.low[1] - bottom) < 1e-6:
            # The front door is in the other half of its wall.
            last_x = space.high[0] - (1.8 if space is hub else 0.0)
            add(space, space.low[0], last_x, lambda x: (x, bottom - outside))
        if abs(space.high[1] - top) < 1e-6:
            add(space, space.low[0], space.high[0], lambda x: (x, top + outside))
        if space.function == "hall":
            add(space, space.low[1], space.high[1], lambda y: (end + outside, y))
    return windows


def _window_places(low: float, high: float, function: str) -> list[tuple[float, float]]:
    """Middles and widths of the windows in a wall."""
    length = high - low
    if function in ("bathroom", "washroom", "hall"):
        return [((low + high) / 2, 0.80)]
    if length < 2.0:
        return []
    if length < 4.4:
        width = 1.2 if length < 2.9 else 1.4 if length < 3.6 else 2.0
        return [(snap((low + high) / 2), width)]
    count = int(length // 2.6)
    return [(snap(low + (number + 0.5) * length / count), 1.4) for number in range(count)]


def _opening(name: str, kind: OpeningKind, at: Point, width: float, bottom: float, top: float) -> Opening:
    return Opening(name, kind, at, width, bottom, top)


def _draw(bounds: tuple[float, float], rng: np.random.Generator) -> float:
    return snap(float(rng.uniform(*bounds)))


def _turned(plan: Plan, rng: np.random.Generator) -> Plan:
    """Mirror and turn a plan as a whole, and move its first room's middle to the origin."""
    mirror_x, mirror_y, swap = (bool(rng.random() < 0.5) for _ in range(3))
    hub = plan.spaces[0]
    middle = (snap((hub.low[0] + hub.high[0]) / 2), snap((hub.low[1] + hub.high[1]) / 2))

    def move(point: Point) -> Point:
        x, y = point[0] - middle[0], point[1] - middle[1]
        x, y = (-x if mirror_x else x), (-y if mirror_y else y)
        x, y = (y, x) if swap else (x, y)
        return round(x, 4) + 0.0, round(y, 4) + 0.0

    spaces = []
    for space in plan.spaces:
        (x0, y0), (x1, y1) = move(space.low), move(space.high)
        low, high = (min(x0, x1), min(y0, y1)), (max(x0, x1), max(y0, y1))
        spaces.append(Space(space.name, space.function, low, high))
    handed = -1.0 if (mirror_x + mirror_y + swap) % 2 else 1.0
    openings = tuple(
        replace(opening, at=move(opening.at), open_deg=handed * opening.open_deg + 0.0) for opening in plan.openings
    )
    return Plan(tuple(spaces), openings)
