"""The fixtures of every room: lamps, radiators, curtains, pictures, plants."""

from benchbot_scenes.generator.furnish import Furnisher

CURTAIN_TOP_M = 2.42
# One ceiling lamp for so much of a room's length.
LAMP_EVERY_M = 4.2
PICTURE_BOTTOM_M, CLOCK_BOTTOM_M = 1.35, 1.65
# The share of plants that stand on stands, and of kitchens and offices with a clock on a wall.
ON_STANDS, WALL_CLOCKS = 0.25, 0.5


def lamps(room: Furnisher, kinds: tuple[str, ...] = ("pendant lamp", "ceiling lamp")) -> None:
    """Lamps under the ceiling, evenly along the longer side."""
    low, (size_x, size_y) = room.plot.space.low, room.plot.size_m
    columns, rows = max(1, round(size_x / LAMP_EVERY_M)), max(1, round(size_y / LAMP_EVERY_M))
    model = room.supply.draw(*kinds)
    for i in range(columns):
        for j in range(rows):
            room.hung_at_ceiling(model, low[0] + (i + 0.5) * size_x / columns, low[1] + (j + 0.5) * size_y / rows)


def radiators(room: Furnisher) -> None:
    """Under the first window of each wall that has one."""
    for wall in ("west", "south", "east", "north"):
        windows = room.plot.openings_in(wall, room.plot.windows)
        if not windows:
            continue
        low, high, window = windows[0]
        model = room.supply.usual("radiator")
        if model is None or window.bottom_m < model.size_m[2] + 0.14:
            continue
        item = room.at_wall_exactly(model, wall, (low + high) / 2, 0.12)
        if item is not None:
            return


def curtains(room: Furnisher) -> None:
    """One at each side of every window."""
    model = room.supply.draw("curtain")
    if model is None:
        return
    top = min(CURTAIN_TOP_M, room.plot.height_m - 0.08)
    for wall in ("west", "south", "east", "north"):
        for low, high, _ in room.plot.openings_in(wall, room.plot.windows):
            for along in (low - model.size_m[1] / 2 + 0.12, high + model.size_m[1] / 2 - 0.12):
                room.at_wall_exactly(model, wall, along, max(0.02, top - model.size_m[2]), covers_window=True)


def pictures(room: Furnisher, most: int) -> None:
    """Some, where walls are bare."""
    for _ in range(int(room.plot.rng.integers(1, most + 1))):
        model = room.supply.draw("picture")
        room.on_wall(model, PICTURE_BOTTOM_M + float(room.plot.rng.uniform(0.0, 0.1)))


def plants(room: Furnisher, most: int) -> None:
    """Potted plants in corners, some of them small ones on stands."""
    supply, rng = room.supply, room.plot.rng
    for _ in range(int(rng.integers(0, most + 1))):
        if rng.random() < ON_STANDS:
            stand = room.against_wall(supply.draw("plant stand"))
            room.on_top(supply.draw("potted plant", placement="surface"), stand, (0.0, 0.0))
        else:
            room.against_wall(supply.draw("potted plant", placement="floor"))


def wall_clock(room: Furnisher) -> None:
    """One on a wall, perhaps."""
    if room.plot.rng.random() < WALL_CLOCKS:
        room.on_wall(room.supply.draw("wall clock"), CLOCK_BOTTOM_M)
