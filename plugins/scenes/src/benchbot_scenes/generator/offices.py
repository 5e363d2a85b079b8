"""The furniture of rooms of offices, by function."""

from benchbot_scenes.generator import clutter, fixtures, walls
from benchbot_scenes.generator.furnish import SEAT_PITCH_M, Furnisher
from benchbot_scenes.generator.plot import Item

CEILING_LAMPS = ("ceiling lamp", "pendant lamp")
WHITEBOARD_BOTTOM_M = 0.95
# The share of meeting rooms whose whiteboard stands on wheels.
WHEELED_BOARDS = 0.35
# The share of desks at a wall with a shelf above, of offices with a chair for a visitor, and chairs of those who wait.
SHELVES_ABOVE_DESKS, VISITORS = 0.3, 0.5
WAITING, WAITING_GAP_M, WAITING_FRONT_M = 3, 0.1, 0.6


def office(room: Furnisher) -> None:
    """One or two workplaces that face a wall, cabinets, a whiteboard."""
    supply, rng = room.supply, room.plot.rng
    for _ in range(1 if room.plot.size_m[0] * room.plot.size_m[1] < 14 else 2):
        workplace(room)
    _cabinets(room, 2)
    _books(room, 2)
    _whiteboard(room)
    if rng.random() < VISITORS:
        room.against_wall(supply.draw("armchair", "chair"), front_m=0.4)
    fixtures.plants(room, 2)
    if rng.random() < 0.4:
        room.against_wall(supply.draw("coat rack", placement="floor"))
    _finish(room, 4)


def workplace(room: Furnisher) -> Item | None:
    """A desk against a wall, with what belongs on it and a chair."""
    model = room.supply.usual("desk", "table")
    desk = room.against_wall(model, middle=bool(room.plot.rng.random() < 0.5))
    if desk is not None:
        _equip(room, desk)
        if room.plot.rng.random() < SHELVES_ABOVE_DESKS:
            wall, along_m = room.behind(desk)
            walls.hang_shelf(room, room.supply.draw("shelf"), walls.Stretch(wall, along_m, along_m))
    return desk


def _equip(room: Furnisher, desk: Item) -> None:
    chair = room.supply.usual("office chair", "chair")
    if chair is not None:
        turn = 180.0 + float(room.plot.rng.uniform(-20, 20))
        room.drawn_up(chair, desk, desk.size_m[0] / 2 + chair.size_m[0] / 2 - 0.18, 0.0, turn)
    clutter.desk(room, desk, monitor=bool(room.plot.rng.random() < 0.7))


def open_office(room: Furnisher) -> None:
    """Islands of desks, two by two face to face; cabinets and plants along the walls."""
    supply, rng = room.supply, room.plot.rng
    model = supply.usual("desk", "table")
    low, high = room.plot.space.low, room.plot.space.high
    if model is not None:
        pitch = (2 * model.size_m[0] + 2 * 0.75 + 1.2, model.size_m[1] + 0.02)
        along_x = high[0] - low[0] >= high[1] - low[1]
        length, width = (high[0] - low[0], high[1] - low[1]) if along_x else (high[1] - low[1], high[0] - low[0])
        islands = max(1, int((length - 0.6) // pitch[0]))
        pairs = max(1, min(3, int((width - 2.2) // pitch[1])))
        for island in range(islands):
            ahead = (island + 0.5) / islands * length
            for pair in range(pairs):
                across = width / 2 + (pair - (pairs - 1) / 2) * pitch[1]
                for side in (1, -1):
                    at = ahead + side * (model.size_m[0] / 2 + 0.012)
                    x, y = (low[0] + at, low[1] + across) if along_x else (low[0] + across, low[1] + at)
                    yaw = (0.0 if side > 0 else 180.0) if along_x else (90.0 if side > 0 else 270.0)
                    desk = room.standing(model, x, y, yaw)
                    if desk is not None:
                        _equip(room, desk)
    for _ in range(int(rng.integers(2, 4))):
        workplace(room)
    _cabinets(room, 3)
    _books(room, 1)
    _whiteboard(room)
    fixtures.wall_clock(room)
    fixtures.plants(room, 3)
    if rng.random() < 0.5:
        room.against_wall(supply.draw("coat rack", placement="floor"))
    _finish(room, 6)


def meeting(room: Furnisher) -> None:
    """A long table with chairs, a screen and a whiteboard."""
    supply, rng = room.supply, room.plot.rng
    low, high = room.plot.space.low, room.plot.space.high
    tables = sorted(supply.models("meeting table", "dining table", "table"), key=lambda model: -model.size_m[1])
    size_x, size_y = room.plot.size_m
    yaw = 90.0 if size_x > size_y else 0.0
    for model in [model for model in tables if model.kind != "desk" and model.size_m[2] > 0.6]:
        table = room.standing(supply.varied(model), (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, yaw)
        if table is None:
            continue
        chairs = room.chairs_about(supply.draw("chair", longest_m=SEAT_PITCH_M), table, 8)
        for kind in ("laptop", "laptop", "cup", "cup", "bottle", "book", "cell phone"):
            if chairs and rng.random() < 0.65:
                room.on_top(supply.draw(kind, placement="surface"), table)
        break
    board = room.against_wall(supply.draw("sideboard", "office cabinet", longest_m=2.0), middle=True)
    if board is not None:
        clutter.tv(room, board)
    on_wheels = supply.draw("whiteboard", placement="floor") if rng.random() < WHEELED_BOARDS else None
    if room.against_wall(on_wheels, front_m=0.3, middle=True) is None:
        _whiteboard(room)
    fixtures.plants(room, 2)
    _finish(room, 4)


def lobby(room: Furnisher) -> None:
    """A reception desk, a place to wait, plants."""
    supply, rng = room.supply, room.plot.rng
    workplace(room)
    for _ in range(2):
        couch = room.against_wall(supply.draw("couch", placement="floor"), front_m=1.1, middle=True)
        if couch is None:
            continue
        table = supply.draw("coffee table")
        if table is not None:
            room.plot.kept.pop()
            placed = room.relative(table, couch, couch.size_m[0] / 2 + 0.42 + table.size_m[0] / 2, 0.0)
            if placed is not None:
                clutter.scatter(room, placed, ("book", "book", "cup", "bottle", "vase", "potted plant"), 0.5)
        rug = supply.draw("rug", longest_m=2.6)
        if rug is not None and rng.random() < 0.6:
            room.rug(rug, couch, couch.size_m[0] / 2 + 0.7)
    room.row_at_wall(supply.draw("chair"), WAITING, WAITING_GAP_M, WAITING_FRONT_M)
    _books(room, 1)
    board = room.against_wall(supply.draw("sideboard"), front_m=0.3)
    clutter.scatter(room, board, ("potted plant", "clock", "vase", "book"), 0.6)
    fixtures.plants(room, 4)
    _finish(room, 6)


def archive(room: Furnisher) -> None:
    """Cabinets and shelves along the walls, a table in between."""
    supply = room.supply
    _cabinets(room, 4)
    _books(room, 2)
    workplace(room)
    room.against_wall(supply.draw("basket"))
    _finish(room, 2)


def _whiteboard(room: Furnisher) -> None:
    room.on_wall(room.supply.draw("whiteboard", placement="wall"), WHITEBOARD_BOTTOM_M)


def _cabinets(room: Furnisher, most: int) -> None:
    for _ in range(most):
        cabinet = room.against_wall(room.supply.usual("office cabinet", "chest of drawers"), front_m=0.5)
        if cabinet is not None and cabinet.size_m[2] < 1.35:
            clutter.scatter(room, cabinet, ("potted plant", "book", "clock", "cup"), 0.3)


def _books(room: Furnisher, most: int) -> None:
    for _ in range(most):
        case = room.against_wall(room.supply.draw("bookcase"), front_m=0.4)
        if case is not None:
            clutter.shelves(room, case, int(room.plot.rng.integers(4, 8)))


def _finish(room: Furnisher, most_dressed: int) -> None:
    fixtures.lamps(room, CEILING_LAMPS)
    fixtures.radiators(room)
    walls.dress(room, most_dressed, with_shelves=True)
