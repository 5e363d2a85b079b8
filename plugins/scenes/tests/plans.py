"""Buildings that the tests look at."""

from benchbot_scenes.layout import Building, Opening, OpeningKind, Point, Room

WHITE = "#ffffff"


def room(name: str, low: Point, high: Point, *, walls: str = WHITE, floor: str = WHITE) -> Room:
    (x0, y0), (x1, y1) = low, high
    return Room(name, ((x0, y0), (x1, y0), (x1, y1), (x0, y1)), floor, walls, WHITE)


def opening(
    kind: OpeningKind,
    at: Point,
    width: float = 0.9,
    bottom: float = 0.0,
    top: float = 2.0,
    model: str | None = None,
    open_deg: float = 0.0,
) -> Opening:
    return Opening(f"{kind} at {at}", kind, at, width, bottom, top, model, open_deg)


WEST, EAST = room("west", (0, 0), (4, 3)), room("east", (4.1, 0), (7, 3))
DOOR, WINDOW = opening("door", (4.05, 1.0)), opening("window", (2.0, -0.1), 1.2, 0.8, 2.1)


def two_rooms(*openings: Opening) -> Building:
    """Two rooms with a wall of 0.1 m between them, 2.5 m high, 0.3 m walls around."""
    return Building(2.5, 0.3, (WEST, EAST), openings)
