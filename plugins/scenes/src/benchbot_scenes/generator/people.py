"""People in rooms: seated where an armchair or couch offers it, else standing where there is room."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.plot import Item
from benchbot_scenes.intersections import triangles_of
from benchbot_scenes.visibility import surface_points

Floats = npt.NDArray[np.float64]

# The share of rooms that somebody is in, by their function.
CHANCES = {
    "living room": 0.5,
    "kitchen": 0.25,
    "bedroom": 0.08,
    "study": 0.25,
    "hall": 0.06,
    "open office": 0.7,
    "office": 0.35,
    "meeting room": 0.4,
    "pantry": 0.3,
    "lobby": 0.6,
    "archive": 0.15,
}
MOST_PEOPLE = 4
# The share of those who sit, where they find a seat.
SEATED = 0.85
SEATS, STANDING = ("armchair", "couch"), ("person", "walking person")
# How many points of a room are tried for somebody who stands.
TRIES = 12
# Between a counter's front and the middle of who stands before it.
BEFORE_COUNTER_M = 0.30
# Heights of seats; what is higher is an arm or a back. Who sits is made smaller or taller by this much at most.
SEAT_M, FITTING = (0.34, 0.60), (0.90, 1.10)
# The part of a seat that is sat on: so far to both sides, and how far who sits sinks into it.
HALF_SEAT_M, SINKS_M = 0.16, 0.006
# Feet and shanks are below this share of the height of somebody who sits.
THIGHS_SHARE = 0.26
# How far in front of the upper part of a back somebody is tried.
FORWARD_M = (0.0, 0.03, 0.06, 0.09, 0.12)
# How densely seats are looked at.
CELL_M = 0.03
# Of how many cells of a seat somebody covers at least.
FEWEST_CELLS = 70


def put_in(rooms: Sequence[Furnisher]) -> None:
    """Somebody in some of the furnished rooms of a place; not more than `MOST_PEOPLE` in all."""
    present = 0
    for room in rooms:
        rng = room.plot.rng
        if present == MOST_PEOPLE or rng.random() >= CHANCES.get(room.plot.space.function, 0.0):
            continue
        placed = _seated(room) if rng.random() < SEATED else None
        present += (placed or _standing(room)) is not None


def _standing(room: Furnisher) -> Item | None:
    """Before a kitchen counter, or anywhere that leaves the ways of a robot."""
    rng = room.plot.rng
    models = [model for kind in STANDING for model in room.supply.catalogue.of_kind(kind)]
    model = room.supply.one_of([model for model in models if model.class_name == "person"])
    if model is None:
        return None
    for counter in room.plot.items:
        if counter.model.kind == "kitchen counter" and model.kind == "person":
            placed = room.relative(model, counter, counter.size_m[0] / 2 + BEFORE_COUNTER_M, 0.0, 180.0)
            if placed is not None:
                return placed
    low, high = room.plot.space.low, room.plot.space.high
    for _ in range(TRIES):
        x, y = (float(rng.uniform(low[i] + 0.4, high[i] - 0.4)) for i in (0, 1))
        placed = room.standing(model, x, y, float(rng.uniform(0.0, 360.0)))
        if placed is not None:
            return placed
    return None


def _seated(room: Furnisher) -> Item | None:
    """On an armchair or a couch of the room."""
    models = room.supply.catalogue.of_kind("sitting person")
    seats = [item for item in room.plot.items if item.model.kind in SEATS]
    for number in room.plot.rng.permutation(len(models)):
        model = room.supply.varied(models[number])
        placed = (_sit_down(room, model, seat) for seat in seats)
        if (found := next((item for item in placed if item is not None), None)) is not None:
            return found
    return None


def _sit_down(room: Furnisher, model: AssetModel, seat: Item) -> Item | None:
    """Against the back of a seat, at the size at which soles and thighs both rest, if nothing meets anything then."""
    below, person = _own_points(seat), _own_points(room.at(model, (0.0, 0.0), 0.0, 0.0))
    below, person = (points[np.abs(points[:, 1]) < HALF_SEAT_M] for points in (below, person))
    backs, behind = (
        _levels(points[points[:, 2] > SEAT_M[1]][:, [1, 2, 0]], sign) for points, sign in ((below, 1.0), (person, -1.0))
    )
    touching_m = max((x - behind[cell] for cell, x in backs.items() if cell in behind), default=0.0)
    below = below[below[:, 2] < SEAT_M[1]]
    thighs = person[(person[:, 2] > THIGHS_SHARE * model.size_m[2]) & (person[:, 2] < SEAT_M[1])]
    unders = _levels(thighs, -1.0)
    # The lower part of a back bulges.
    for ahead_m in (touching_m + forward_m for forward_m in FORWARD_M):
        tops = _levels(below - [ahead_m, 0.0, 0.0], 1.0)
        factors = [(tops[cell] - SINKS_M) / z for cell, z in unders.items() if tops.get(cell, 0.0) > SEAT_M[0]]
        factor = max(factors) if len(factors) >= FEWEST_CELLS else 0.0
        if not FITTING[0] <= factor <= FITTING[1]:
            continue
        size_m = (model.size_m[0] * factor, model.size_m[1] * factor, model.size_m[2] * factor)
        item = room.at(model, seat.place(ahead_m, 0.0), 0.0, seat.placement.yaw_deg, seat, size_m)
        if _has_room(room, item) and room.is_free(item):
            return room.put(item)
    return None


def _has_room(room: Furnisher, item: Item) -> bool:
    """Whether somebody who sits is in the room, clear of doors, and leaves the ways of a robot."""
    box, low, high = item.box, room.plot.space.low, room.plot.space.high
    at_doors = room.plot.kept[: len(room.plot.doors)]
    is_inside = all(box.low[i] >= low[i] and box.high[i] <= high[i] for i in (0, 1))
    return is_inside and not any(box.overlaps(zone) for zone in at_doors) and room.plot.leaves_ways(item)


def _levels(points: Floats, sign: float) -> dict[tuple[int, int], float]:
    """The greatest (sign 1) or least (-1) third coordinate of points over each cell of the first two."""
    cells = np.floor(points[:, :2] / CELL_M).astype(np.int64)
    order = np.argsort(sign * points[:, 2], kind="stable")
    return dict(zip(map(tuple, cells[order].tolist()), points[order, 2].tolist(), strict=True))


def _own_points(item: Item) -> Floats:
    """Points (N, 3) all over an item, in its own frame."""
    return item.own(surface_points(triangles_of(item.placement, item.model), CELL_M / 2)[0])
