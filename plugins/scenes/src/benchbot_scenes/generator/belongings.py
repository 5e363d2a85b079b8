"""What people leave about, room by room: shoes by the door, magnets on the refrigerator, cables, bins, paper."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import numpy.typing as npt

from benchbot_scenes.generator import cables
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.plot import AXIS, WALLS, Item
from benchbot_scenes.intersections import triangles_of
from benchbot_scenes.visibility import surface_points

Floats = npt.NDArray[np.float64]

# Pairs of shoes in a home, the least and the most, and how far apart they are put down.
PAIRS, PAIR_PITCH_M, PAIRS_TRIED = (1, 3), 0.27, 9
# The shares of desks, tables, beds and rooms that have something.
BINS_AT_DESKS, BINS_IN_ROOMS, PAPERS, CHARGERS, LETTERS = 0.6, 0.7, 0.45, 0.35, 0.5
WITH_PAPER, WITH_CHARGER, WITH_BIN = (
    ("desk", "table"),
    ("desk", "bedside table", "coffee table"),
    ("kitchen", "bathroom"),
)
# Where on a refrigerator magnets are put: their heights above the floor and their ways off the middle.
MAGNET_HEIGHTS_M, MAGNETS_ASIDE_M = (1.30, 1.15, 1.05), (-0.06, 0.05, -0.14, 0.14, 0.0, -0.20, 0.20)
# How far from the edges of a front they stay.
EDGE_M = 0.03
# How densely a front is looked at, and how flat it is where magnets hold.
FRONT_STEP_M, FLAT_FRONT_M = 0.03, 0.006
# How far from a desk another one's bin is.
BINS_APART_M = 0.8


def put_about(rooms: Sequence[Furnisher]) -> None:
    """Everything of this module, in the furnished rooms of a place, the one that is entered first."""
    is_home = rooms[0].plot.space.function == "living room"
    if is_home:
        _shoes([room for room in rooms if room.plot.space.function == "hall"] or rooms[:1])
    for room in rooms:
        for item in list(room.plot.items):
            if item.model.class_name == "refrigerator":
                _magnets(room, item)
            elif item.model.kind in WITH_PAPER and room.plot.rng.random() < PAPERS:
                room.on_top(room.supply.draw("paper"), item)
        for item in list(room.plot.items):
            if item.model.kind in WITH_CHARGER and room.plot.rng.random() < CHARGERS:
                room.on_top(room.supply.draw("charger"), item)
        _bins(room)
        cables.lead(room)


def _shoes(rooms: Sequence[Furnisher]) -> None:
    """Pairs at a wall, below the coats if there are any, else as near to the door as they can be."""
    room = rooms[0]
    count = int(room.plot.rng.integers(PAIRS[0], PAIRS[1] + 1))
    for _ in range(count):
        model = room.supply.draw("shoes")
        if model is None:
            return
        coats = [item for item in room.plot.items if item.model.kind == "coat rack"]
        near = coats[0].placement.position[:2] if coats else room.plot.doors[0].at
        walls = sorted(WALLS, key=lambda wall: _off(room, wall, near))
        places = [(wall, near[AXIS[wall]] + step * PAIR_PITCH_M) for wall in walls[:2] for step in _outwards()]
        for wall, along_m in places:
            if room.at_wall_exactly(model, wall, along_m, 0.0) is not None:
                break


def _outwards() -> list[int]:
    """Steps from a place: none, one to either side, two, …"""
    return sorted(range(-PAIRS_TRIED // 2, PAIRS_TRIED // 2 + 1), key=abs)


def _off(room: Furnisher, wall: str, at: tuple[float, float]) -> float:
    x, y = room.plot.at_wall(wall, at[AXIS[wall]], 0.0)
    return float(np.hypot(x - at[0], y - at[1]))


def _magnets(room: Furnisher, refrigerator: Item) -> None:
    """Sheets or letters or both, where the front is flat and without a handle."""
    rng, front = room.plot.rng, _front(refrigerator)
    models = sorted(room.supply.models("magnets"), key=lambda model: -model.size_m[2])
    for number, drawn in enumerate(models):
        if number and rng.random() >= LETTERS:
            continue
        model = room.supply.varied(drawn)
        depth, width, height = model.size_m
        own = [item.box for item in room.plot.items if item.carrier == refrigerator.placement.id]
        heights_m = (z for z in MAGNET_HEIGHTS_M if z + height + EDGE_M < refrigerator.size_m[2])
        for bottom_m, aside in product(heights_m, MAGNETS_ASIDE_M):
            y, z = front[:, 1] - aside, front[:, 2] - bottom_m
            held = front[(np.abs(y) < width / 2 + FRONT_STEP_M) & (z > -FRONT_STEP_M) & (z < height + FRONT_STEP_M)]
            if not len(held) or np.ptp(held[:, 0]) > FLAT_FRONT_M:
                continue
            at = refrigerator.place(float(held[:, 0].max()) + depth / 2, aside)
            item = room.at(model, at, bottom_m, refrigerator.placement.yaw_deg, refrigerator)
            if abs(aside) + width / 2 + EDGE_M < refrigerator.size_m[1] / 2 and not any(
                item.box.overlaps(box) for box in own
            ):
                room.put(item, takes=False)
                break


def _front(item: Item) -> Floats:
    """The foremost point (x, y, z; the item's frame) of each cell of the front of an item on the floor."""
    own = item.own(surface_points(triangles_of(item.placement, item.model), FRONT_STEP_M * 0.7)[0])
    cells = np.floor(own[:, 1:] / FRONT_STEP_M).astype(np.int64)
    order = np.lexsort((-own[:, 0], cells[:, 1], cells[:, 0]))
    is_first = np.ones(len(order), bool)
    is_first[1:] = (np.diff(cells[order], axis=0) != 0).any(axis=1)
    found: Floats = own[order][is_first]
    return found


def _bins(room: Furnisher) -> None:
    """A paper bin beside some desks, a pedal bin in kitchens and bathrooms."""
    models = sorted(room.supply.models("bin"), key=lambda model: model.size_m[2])
    if not models:
        return
    for desk in [item for item in room.plot.items if item.model.kind == "desk"]:
        bins = [item for item in room.plot.items if item.model.kind == "bin"]
        if room.plot.rng.random() < BINS_AT_DESKS and not any(desk.box.overlaps(it.box, BINS_APART_M) for it in bins):
            model = room.supply.varied(models[0])
            aside, back = (desk.size_m[1] + model.size_m[1]) / 2 + 0.06, (model.size_m[0] - desk.size_m[0]) / 2 + 0.03
            side = 1 if room.plot.rng.random() < 0.5 else -1
            room.relative(model, desk, back, side * aside) or room.relative(model, desk, back, -side * aside)
    if room.plot.space.function in WITH_BIN and room.plot.rng.random() < BINS_IN_ROOMS:
        room.against_wall(room.supply.varied(models[-1]))
