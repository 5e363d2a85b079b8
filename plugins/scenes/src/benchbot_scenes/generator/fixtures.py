"""The fixtures of every room: lamps, radiators, curtains, clocks, plants."""

from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.plot import WALLS

CURTAIN_TOP_M = 2.42
# Short curtains end so far below the sill; each of a pair covers so much of the window.
BELOW_SILL_M, OVER_WINDOW_M = 0.05, 0.05
NARROWEST_CURTAIN_M, WIDEST_CURTAIN_M = 0.28, 0.6
# The share of rooms whose curtains reach the floor.
LONG_CURTAINS = 0.5
# One ceiling lamp for so much of a room's length.
LAMP_EVERY_M = 4.2
CLOCK_BOTTOM_M = 1.65
# The share of plants of which one stands on a stand, and of kitchens and offices with a clock on a wall.
ON_STANDS, WALL_CLOCKS = 0.25, 0.5
# As wide is a plant on a stand at most.
ON_STAND_M = 0.2


def lamps(room: Furnisher, kinds: tuple[str, ...] = ("pendant lamp", "ceiling lamp")) -> None:
    """Lamps under the ceiling, evenly along the longer side."""
    low, (size_x, size_y) = room.plot.space.low, room.plot.size_m
    columns, rows = max(1, round(size_x / LAMP_EVERY_M)), max(1, round(size_y / LAMP_EVERY_M))
    model = room.supply.draw(*kinds)
    for i in range(columns):
        for j in range(rows):
            room.hung_at_ceiling(model, low[0] + (i + 0.5) * size_x / columns, low[1] + (j + 0.5) * size_y / rows)


def radiators(room: Furnisher) -> None:
    """Under the first window of each wall that has room for one."""
    for wall in WALLS:
        for low, high, window in room.plot.openings_in(wall, room.plot.windows):
            model = room.supply.usual("radiator")
            if model is None or window.bottom_m < model.size_m[2] + 0.14:
                continue
            if room.at_wall_exactly(model, wall, (low + high) / 2, 0.12) is not None:
                break


def curtains(room: Furnisher) -> None:
    """A pair at every window, before there is furniture: down to the floor or, in some rooms, to the sill."""
    supply, rng = room.supply, room.plot.rng
    model = supply.draw("curtain")
    if model is None:
        return
    is_long = rng.random() < LONG_CURTAINS
    top = min(CURTAIN_TOP_M, room.plot.height_m - 0.08)
    for wall in WALLS:
        start, end = room.plot.along(wall)
        for low, high, window in room.plot.openings_in(wall, room.plot.windows):
            # In corners there is less room.
            width_m = min(model.size_m[1], WIDEST_CURTAIN_M, min(low - start, end - high) + OVER_WINDOW_M - 0.02)
            length_m = min(model.size_m[2], top - 0.02) if is_long else top - window.bottom_m + BELOW_SILL_M
            places_m = low - width_m / 2 + OVER_WINDOW_M, high + width_m / 2 - OVER_WINDOW_M
            if width_m >= NARROWEST_CURTAIN_M:
                size_m = (model.size_m[0], width_m, length_m)
                room.all_at_wall(model, wall, places_m, top - length_m, size_m, covers_window=True)


def plants(room: Furnisher, most: int) -> None:
    """Potted plants in corners, each of a model of its own, and perhaps a small one on a stand."""
    supply, rng = room.supply, room.plot.rng
    on_floor = [model for model in supply.models("potted plant") if model.placement == "floor"]
    count = int(rng.integers(0, most + 1))
    if rng.random() < ON_STANDS * count:
        stand = room.against_wall(supply.draw("plant stand"))
        room.on_top(supply.draw("potted plant", longest_m=ON_STAND_M, placement="surface"), stand, (0.0, 0.0))
        count -= 1
    for number in rng.permutation(len(on_floor))[:count]:
        room.against_wall(supply.varied(on_floor[number]))


def wall_clock(room: Furnisher) -> None:
    """One on a wall, perhaps."""
    if room.plot.rng.random() < WALL_CLOCKS:
        room.on_wall(room.supply.draw("wall clock"), CLOCK_BOTTOM_M)
