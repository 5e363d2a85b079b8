"""The furniture of rooms by function: one programme each, the most important items first."""

from collections.abc import Callable, Iterable, Sequence

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.generator import clutter, fixtures, walls
from benchbot_scenes.generator.furnish import SEAT_PITCH_M, Furnisher
from benchbot_scenes.generator.offices import archive, lobby, meeting, office, open_office
from benchbot_scenes.generator.plot import AXIS, WALLS, Box, Item
from benchbot_scenes.generator.supply import Supply
from benchbot_scenes.layout import Point

SOFA_DISTANCE_M = (2.3, 3.6)
PICTURE_ABOVE_BED_M = 1.35
# The share of halls with a sideboard.
HALL_SIDEBOARDS = 0.6
# Higher mirrors hang above nothing.
MIRROR_M = 1.0


def living(room: Furnisher) -> None:
    """A couch that faces a tv over a coffee table; in a large room also a place to eat."""
    supply, rng = room.supply, room.plot.rng
    size_x, size_y = room.plot.size_m
    fixtures.curtains(room)
    couch = _sofa_corner(room)
    if couch is not None:
        lamp = supply.draw("floor lamp", placement="floor")
        side = 1 if rng.random() < 0.5 else -1
        if lamp is not None:
            off = side * (couch.size_m[1] / 2 + lamp.size_m[1] / 2 + 0.08)
            room.relative(lamp, couch, -0.1, off) or room.relative(lamp, couch, -0.1, -off)
        for y in (-0.5, 0.5):
            room.on_top(supply.draw("cushion"), couch, (-0.05, y), 0.0)
    if size_x * size_y > 24.0:
        _dining_place(room, int(rng.choice([4, 6])), away_from=couch)
    case = room.against_wall(supply.draw("bookcase"), front_m=0.3)
    if case is not None:
        clutter.shelves(room, case, int(rng.integers(5, 9)))
    chest = room.against_wall(supply.draw("sideboard", "chest of drawers"), front_m=0.3)
    if chest is not None:
        clutter.scatter(room, chest, ("table lamp", "vase", "clock", "book", "potted plant"), 0.5)
    armchair = room.against_wall(supply.draw("armchair"), front_m=0.5) if size_x * size_y > 20.0 else None
    side_table = _beside(room, supply.draw("side table"), [seat for seat in (armchair, couch) if seat is not None])
    clutter.scatter(room, side_table, ("table lamp", "book", "cup"), 0.6)
    fixtures.plants(room, 3)
    _finish(room, 5, with_shelves=True)


def _beside(room: Furnisher, model: AssetModel | None, seats: Sequence[Item]) -> Item | None:
    """A side table at the side of the first of some seats that has room there."""
    if model is None:
        return None
    for seat in seats:
        off = (seat.size_m[1] + model.size_m[1]) / 2 + 0.06
        placed = room.relative(model, seat, -0.1, off) or room.relative(model, seat, -0.1, -off)
        if placed is not None:
            return placed
    return None


def _sofa_corner(room: Furnisher) -> Item | None:
    supply, rng = room.supply, room.plot.rng
    board, couch = supply.draw("sideboard", "tv stand", "shelf"), supply.draw("couch", placement="floor")
    # A tv before a window can hardly be watched.
    drawn = [WALLS[i] for i in rng.permutation(4)]
    for wall in sorted(drawn, key=lambda wall: len(room.plot.openings_in(wall, room.plot.windows))):
        depth = room.plot.size_m[1 - AXIS[wall]]
        stand = room.against_wall(board, [wall], middle=True)
        if stand is None:
            continue
        clutter.tv(room, stand)
        if couch is None:
            return None
        furthest = depth - stand.size_m[0] / 2 - couch.size_m[0] / 2 - 0.14
        near, far = SOFA_DISTANCE_M
        ahead = furthest if furthest < far + 0.4 else float(rng.uniform(near + 0.4, far))
        placed = room.relative(couch, stand, ahead, 0.0, 180.0) if ahead > near - 0.4 else None
        if placed is None:
            return None
        table = supply.draw("coffee table")
        rug = supply.draw("rug", longest_m=2.6)
        front = placed.size_m[0] / 2 + 0.42
        centre = front + (table.size_m[0] / 2 if table else 0.3)
        laid = room.rug(rug, placed, centre)
        low_table = room.relative(table, placed, centre, 0.0)
        if low_table is not None:
            clutter.scatter(room, low_table, ("book", "cup", "bowl", "cell phone", "vase"), 0.55)
            clutter.scatter(room, low_table, ("apple", "banana", "orange"), 0.2)
        # Nothing else stands on the rug, or between those who sit and what they look at.
        boxes = [item.box for item in (stand, placed, laid) if item is not None]
        lows, highs = zip(*((box.low, box.high) for box in boxes), strict=True)
        room.plot.kept.append(Box(_corner(min, lows), _corner(max, highs)))
        return placed
    return None


def _corner(furthest: Callable[[Iterable[float]], float], points: Sequence[Point]) -> Point:
    """Return the furthest x and y of points."""
    return furthest(x for x, _ in points), furthest(y for _, y in points)


def _dining_place(room: Furnisher, seats: int, away_from: Item | None = None) -> Item | None:
    """A table with chairs where there is most room."""
    supply, rng = room.supply, room.plot.rng
    model = supply.draw("dining table", "table", placement="floor")
    if model is None:
        return None
    low, high = room.plot.space.low, room.plot.space.high
    places = [
        (low[0] + x * (high[0] - low[0]), low[1] + y * (high[1] - low[1]))
        for x in (0.25, 0.35, 0.5, 0.65, 0.75)
        for y in (0.15, 0.25, 0.35, 0.5, 0.65, 0.75, 0.85)
    ]
    if away_from is not None:
        sx, sy, _ = away_from.placement.position
        places.sort(key=lambda place: -((place[0] - sx) ** 2 + (place[1] - sy) ** 2))
    else:
        places = [places[i] for i in rng.permutation(len(places))]
    for x, y in places:
        table = room.standing(model, x, y, float(rng.choice([0.0, 90.0])))
        if table is not None:
            chairs = room.chairs_about(supply.draw("chair", longest_m=SEAT_PITCH_M), table, seats)
            clutter.dining(room, table, min(len(chairs), 4))
            return table
    return None


def kitchen(room: Furnisher) -> None:
    """Units along a wall, and a table."""
    supply, rng = room.supply, room.plot.rng
    units = _units(room)
    tops = [unit for unit in units if unit.model.kind == "kitchen counter"]
    clutter.worktop(room, tops)
    walls.cupboards(room, units)
    table = _dining_place(room, 2 if room.plot.size_m[0] * room.plot.size_m[1] < 11 else 4)
    if table is None:
        chest = room.against_wall(supply.draw("sideboard", "chest of drawers"), front_m=0.3)
        clutter.scatter(room, chest, ("potted plant", "bowl", "bottle", "clock"), 0.6)
    shelf = room.on_wall(supply.draw("shelf"), 1.45)
    if shelf is not None:
        clutter.scatter(room, shelf, ("cup", "bowl", "bottle", "book", "clock"), 0.6)
    if rng.random() < 0.5:
        fixtures.plants(room, 1)
    fixtures.wall_clock(room)
    _finish(room, 2)


def _units(room: Furnisher) -> list[Item]:
    """Refrigerator, counters, sink and oven side by side along the wall where most of them fit, in this order."""
    supply, rng = room.supply, room.plot.rng
    counter = supply.usual("kitchen counter")
    oven = supply.draw("stove", "oven", placement="floor")
    sink = supply.draw("kitchen sink") or next(
        (model for model in supply.models("sink") if model.placement == "floor" and model.size_m[1] >= 0.7), None
    )
    oven, sink = supply.matching(oven, counter), supply.matching(sink, counter)
    row = [supply.draw("refrigerator", placement="floor"), counter, sink, counter, oven, counter, counter]
    walls = sorted(WALLS, key=lambda wall: (len(room.plot.openings_in(wall, room.plot.doors)), -_length(room, wall)))
    for wall in walls[:3]:
        placed = _row(room, [model for model in row if model is not None], wall, bool(rng.random() < 0.5))
        if len(placed) >= 3:
            return placed
    return []


def _row(room: Furnisher, models: Sequence[AssetModel], wall: str, backwards: bool) -> list[Item]:
    low, high = room.plot.along(wall)
    placed: list[Item] = []
    way = -1 if backwards else 1
    along = (high - 0.03) if backwards else (low + 0.03)
    for model in models:
        middle = along + way * model.size_m[1] / 2
        # A tap may stand before a window.
        covers = model.class_name == "sink"
        item = room.at_wall_exactly(model, wall, middle, 0.0, gap_m=-0.005, covers_window=covers)
        if item is None:
            if placed:
                break
            return []
        placed.append(item)
        along += way * (model.size_m[1] + 0.002)
    return placed


def _length(room: Furnisher, wall: str) -> float:
    low, high = room.plot.along(wall)
    return high - low


def bedroom(room: Furnisher) -> None:
    """A bed with its tables and lamps, a wardrobe, perhaps a desk."""
    supply, rng = room.supply, room.plot.rng
    area = room.plot.size_m[0] * room.plot.size_m[1]
    fixtures.curtains(room)
    wide = [model for model in supply.models("bed") if (model.size_m[1] > 1.3) == (area > 11)] or supply.models("bed")
    bed = room.against_wall(supply.one_of(wide), front_m=0.0, middle=True)
    if bed is not None:
        # A pair of tables with a pair of lamps.
        table, lamp = supply.draw("bedside table"), supply.draw("table lamp")
        if table is not None:
            off = bed.size_m[1] / 2 + table.size_m[1] / 2 + 0.04
            back = -(bed.size_m[0] - table.size_m[0]) / 2
            for side in (1, -1):
                stand = room.relative(table, bed, back, side * off)
                if stand is not None:
                    room.on_top(lamp, stand, (-0.03, -0.04 * side), 0.0)
                    clutter.scatter(room, stand, ("book", "cup", "clock", "cell phone"), 0.35)
        room.on_wall(supply.draw("picture"), PICTURE_ABOVE_BED_M, above=bed)
        rug = supply.draw("rug", longest_m=2.6)
        if rug is not None and rng.random() < 0.7:
            room.rug(rug, bed, 0.55)
    room.against_wall(supply.draw("wardrobe"), front_m=0.55)
    if area > 11 and rng.random() < 0.6:
        _workplace(room, supply.draw("desk", longest_m=1.4), monitor=False)
    chest = room.against_wall(supply.draw("chest of drawers"), front_m=0.45)
    clutter.scatter(room, chest, ("vase", "clock", "book", "potted plant", "bottle", "table lamp"), 0.4)
    room.against_wall(supply.draw("basket"))
    fixtures.plants(room, 1)
    _finish(room, 3, with_shelves=True)


def _workplace(room: Furnisher, model: AssetModel | None, monitor: bool) -> Item | None:
    if model is None:
        return None
    table = room.against_wall(model, front_m=0.0)
    if table is None:
        return None
    chair = room.supply.usual("office chair", "chair")
    if chair is not None:
        jitter = float(room.plot.rng.uniform(-15, 15))
        room.drawn_up(chair, table, table.size_m[0] / 2 + chair.size_m[0] / 2 - 0.18, 0.0, 180.0 + jitter)
    clutter.desk(room, table, monitor)
    return table


def bathroom(room: Furnisher) -> None:
    """Toilet, washbasin with mirror, bathtub or shower."""
    supply, rng = room.supply, room.plot.rng
    tub = supply.draw("bathtub", "shower") if rng.random() < 0.6 else supply.draw("shower", "bathtub")
    if tub is not None:
        short = _shortest_wall(room)
        room.against_wall(tub, short) or room.against_wall(tub)
    _toilet_and_basin(room)
    room.against_wall(supply.draw("basket"))
    shelf = room.on_wall(supply.draw("shelf", longest_m=1.0), 1.4)
    clutter.bathroom(room, shelf)
    fixtures.lamps(room, ("ceiling lamp", "pendant lamp"))
    fixtures.radiators(room)


def washroom(room: Furnisher) -> None:
    """Toilet and washbasin."""
    _toilet_and_basin(room)
    shelf = room.on_wall(room.supply.draw("shelf", longest_m=1.0), 1.4)
    clutter.bathroom(room, shelf)
    fixtures.lamps(room, ("ceiling lamp", "pendant lamp"))
    fixtures.radiators(room)


def _toilet_and_basin(room: Furnisher) -> None:
    supply = room.supply
    room.against_wall(supply.draw("toilet", placement="floor"), front_m=0.45)
    basins = [model for model in supply.models("bathroom sink", "sink") if model.placement in ("floor", "wall")]
    basins = [model for model in basins if model.size_m[1] < 0.75] or basins
    basin = supply.one_of(basins)
    if basin is None:
        return
    placed = (
        room.against_wall(basin, front_m=0.4, middle=True)
        if basin.placement == "floor"
        else room.on_wall(basin, max(0.3, 0.86 - basin.size_m[2]))
    )
    if placed is not None:
        room.on_wall(_low_mirror(supply), 1.15 if placed.box.top_m < 1.1 else 1.4, above=placed)


def _low_mirror(supply: Supply) -> AssetModel | None:
    """A mirror that ends below the ceiling when it hangs above furniture."""
    return supply.one_of([model for model in supply.models("mirror") if model.size_m[2] < MIRROR_M])


def _shortest_wall(room: Furnisher) -> list[str]:
    """The two short walls, those without doors first."""
    size_x, size_y = room.plot.size_m
    walls = ["south", "north"] if size_x < size_y else ["west", "east"]
    return sorted(walls, key=lambda wall: len(room.plot.openings_in(wall, room.plot.doors)))


def study(room: Furnisher) -> None:
    """A workplace at home, and books."""
    supply, rng = room.supply, room.plot.rng
    fixtures.curtains(room)
    _workplace(room, supply.draw("desk"), monitor=bool(rng.random() < 0.6))
    for _ in range(2):
        case = room.against_wall(supply.draw("bookcase"), front_m=0.4)
        if case is not None:
            clutter.shelves(room, case, int(rng.integers(4, 8)))
    if rng.random() < 0.5:
        room.against_wall(supply.draw("couch", longest_m=1.8, placement="floor"), front_m=0.4)
    lamp = room.against_wall(supply.draw("floor lamp", placement="floor"))
    if lamp is None:
        fixtures.plants(room, 2)
    _finish(room, 3, with_shelves=True)


def hall(room: Furnisher) -> None:
    """Pictures, a place for coats, perhaps a sideboard with a mirror."""
    supply = room.supply
    room.on_wall(supply.draw("coat rack", placement="wall"), 1.5)
    if room.plot.rng.random() < HALL_SIDEBOARDS:
        board = room.against_wall(supply.draw("sideboard", "chest of drawers"), middle=True)
        if board is not None:
            room.on_wall(_low_mirror(supply), 1.1, above=board)
            clutter.scatter(room, board, ("table lamp", "vase", "bowl", "potted plant", "book"), 0.4)
    fixtures.plants(room, 1)
    fixtures.lamps(room, ("ceiling lamp", "pendant lamp"))
    walls.dress(room, 6)


def _finish(room: Furnisher, most_dressed: int, with_shelves: bool = False) -> None:
    fixtures.lamps(room)
    fixtures.radiators(room)
    walls.dress(room, most_dressed, with_shelves)


PROGRAMMES: dict[str, Callable[[Furnisher], None]] = {
    "living": living,
    "kitchen": kitchen,
    "bedroom": bedroom,
    "bathroom": bathroom,
    "washroom": washroom,
    "study": study,
    "hall": hall,
    "office": office,
    "open_office": open_office,
    "meeting": meeting,
    "lobby": lobby,
    "archive": archive,
}
