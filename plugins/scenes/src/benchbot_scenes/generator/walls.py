"""What hangs on walls: cupboards above worktops, pictures and shelves where walls are bare."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.plot import AXIS, WALLS, Box, Item, Plot

# Cupboards hang side by side, about so wide each, and so far beside windows.
CUPBOARD_BOTTOM_M, CUPBOARD_M, BESIDE_WINDOW_M = 1.45, 0.75, 0.1
# Nothing between these heights: a wall is bare there.
BARE_LOW_M, BARE_HIGH_M = 1.15, 2.2
# A shorter stretch of bare wall stays as it is, a longer one is parted.
BARE_M, PART_M = 1.1, 3.2
# What is so near to a wall stands before it, and so far beside openings and furniture nothing hangs.
NEAR_M, BESIDE_M = 0.42, 0.18
# What is above this height hangs.
HUNG_M = 1.0
# The height of the middle of pictures, as museums hang them, and how far above furniture they end.
EYE_M, ABOVE_M = 1.55, 0.12
# The share of bare stretches that something hangs on, of these that a shelf hangs on where there are shelves, and
# of the rest that a row of pictures hangs on where it fits.
DRESSED, SHELVES, ROWS = 0.85, 0.25, 0.6
MOST_IN_ROW, ROW_GAP_M, END_M = 3, (0.12, 0.25), 0.25
SHELF_BOTTOM_M, HIGHEST_SHELF_M, ON_SHELF = 1.42, 1.6, 0.65
SHELF_THINGS = ("book row", "potted plant", "book", "vase", "clock", "bowl")


class Stretch(NamedTuple):
    """A part of a wall, from where to where along it."""

    wall: str
    low_m: float
    high_m: float

    @property
    def length_m(self) -> float:
        """How long it is."""
        return self.high_m - self.low_m


def dress(room: Furnisher, most: int, with_shelves: bool = False) -> None:
    """Hang pictures, and perhaps shelves, on so many of the bare stretches of a room's walls, the longest first."""
    rng = room.plot.rng
    parts = [part for stretch in bare_stretches(room.plot) for part in _parts(stretch)]
    for number, part in enumerate(sorted(parts, key=lambda part: -part.length_m)[:most]):
        if number and rng.random() >= DRESSED:
            continue
        if with_shelves and rng.random() < SHELVES:
            hang_shelf(room, room.supply.draw("shelf", longest_m=part.length_m - END_M), part)
        else:
            _hang_pictures(room, part)


def hang_shelf(room: Furnisher, model: AssetModel | None, part: Stretch) -> Item | None:
    """A shelf in the middle of a stretch, with a few things on it; None above what is too high."""
    if model is None:
        return None
    along_m, half_m = (part.low_m + part.high_m) / 2, model.size_m[1] / 2
    before_m = _top_before(room.plot, Stretch(part.wall, along_m - half_m, along_m + half_m))
    if before_m + ABOVE_M > HIGHEST_SHELF_M:
        return None
    shelf = room.hung(model, part.wall, along_m, max(SHELF_BOTTOM_M, before_m + ABOVE_M))
    for kind in SHELF_THINGS:
        if shelf is not None and room.plot.rng.random() < ON_SHELF:
            turn_deg = float(room.plot.rng.uniform(-6, 6))
            room.on_top(room.supply.draw(kind, longest_m=0.35, placement="surface"), shelf, turn_deg=turn_deg)
    return shelf


def bare_stretches(plot: Plot) -> Iterator[Stretch]:
    """The stretches of a room's walls between openings and what stands or hangs at the height of eyes."""
    zones = plot.at_doors()
    for wall in WALLS:
        axis = AXIS[wall]
        low, high = plot.along(wall)
        before = _strip(plot, wall, BARE_LOW_M, BARE_HIGH_M)
        taken = [(start, end) for start, end, _ in plot.openings_in(wall, (*plot.windows, *plot.doors))]
        # Door leaves stand open in their zones.
        boxes = [*zones, *(item.box for item in plot.items if item.carrier is None)]
        taken += [(box.low[axis], box.high[axis]) for box in boxes if box.overlaps(before)]
        at = low
        for start, end in [*sorted(taken), (high + BESIDE_M, high)]:
            if start - BESIDE_M - at >= BARE_M:
                yield Stretch(wall, at, start - BESIDE_M)
            at = max(at, end + BESIDE_M)


def _strip(plot: Plot, wall: str, bottom_m: float, top_m: float) -> Box:
    corners = [plot.at_wall(wall, along, off) for along in plot.along(wall) for off in (0.0, NEAR_M)]
    xs, ys = zip(*corners, strict=True)
    return Box((min(xs), min(ys)), (max(xs), max(ys)), bottom_m, top_m)


def _parts(stretch: Stretch) -> Iterator[Stretch]:
    count = max(1, round(stretch.length_m / PART_M))
    length_m = stretch.length_m / count
    for number in range(count):
        low_m = stretch.low_m + number * length_m
        yield Stretch(stretch.wall, low_m, low_m + length_m)


def _hang_pictures(room: Furnisher, part: Stretch) -> None:
    """One picture or a row of them, their middles at one height, in the middle of a stretch."""
    rng = room.plot.rng
    count = int(rng.integers(2, MOST_IN_ROW + 1)) if rng.random() < ROWS else 1
    models = [model for _ in range(count) if (model := room.supply.draw("picture")) is not None]
    gap_m = float(rng.uniform(*ROW_GAP_M))
    while models and _row_m(models, gap_m) > part.length_m - END_M:
        models.pop()
    if not models:
        return
    least_m = _top_before(room.plot, part) + ABOVE_M
    middle_m = max(EYE_M, *(least_m + model.size_m[2] / 2 for model in models))
    at = (part.low_m + part.high_m - _row_m(models, gap_m)) / 2
    for model in models:
        width_m, height_m = model.size_m[1:]
        room.hung(model, part.wall, at + width_m / 2, middle_m - height_m / 2)
        at += width_m + gap_m


def _row_m(models: Sequence[AssetModel], gap_m: float) -> float:
    return math.fsum(model.size_m[1] for model in models) + gap_m * (len(models) - 1)


def _top_before(plot: Plot, part: Stretch) -> float:
    """How high what stands before a stretch reaches, with what stands on it; 0 m where nothing does."""
    axis = AXIS[part.wall]
    before = _strip(plot, part.wall, 0.0, BARE_HIGH_M)
    low, high = list(before.low), list(before.high)
    low[axis], high[axis] = part.low_m, part.high_m
    place = Box((low[0], low[1]), (high[0], high[1]), 0.0, BARE_HIGH_M)
    standing = [item.box for item in plot.items if item.box.bottom_m < HUNG_M]
    return max((box.top_m for box in standing if box.overlaps(place)), default=0.0)


def cupboards(room: Furnisher, units: Sequence[Item]) -> None:
    """Wall cupboards side by side above counters and sinks, but neither before a window nor above an oven."""
    model = room.supply.draw("wall cupboard")
    counters = [unit for unit in units if unit.model.kind == "kitchen counter"]
    if model is None or not counters:
        return
    model = room.supply.matching(model, counters[0].model) or model
    wall, _ = room.behind(counters[0])
    axis = AXIS[wall]
    stretches = [
        (unit.box.low[axis], unit.box.high[axis])
        for unit in units
        if unit in counters or (unit.model.class_name == "sink" and unit.box.top_m < CUPBOARD_BOTTOM_M)
    ]
    windows = [
        (low - BESIDE_WINDOW_M, high + BESIDE_WINDOW_M)
        for low, high, _ in room.plot.openings_in(wall, room.plot.windows)
    ]
    for low, high in _less(_joined(stretches), windows):
        count = round((high - low) / CUPBOARD_M)
        if count:
            width_m = (high - low) / count
            places_m = [low + (i + 0.5) * width_m for i in range(count)]
            size_m = (model.size_m[0], width_m - 0.002, model.size_m[2])
            room.all_at_wall(model, wall, places_m, CUPBOARD_BOTTOM_M, size_m, gap_m=-0.005)


def _joined(stretches: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Stretches that touch each other as one."""
    joined: list[tuple[float, float]] = []
    for low, high in sorted(stretches):
        if joined and low - joined[-1][1] < 0.05:
            joined[-1] = joined[-1][0], high
        else:
            joined.append((low, high))
    return joined


def _less(stretches: Sequence[tuple[float, float]], holes: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """What is left of stretches without holes."""
    left = list(stretches)
    for start, end in holes:
        left = [
            part for low, high in left for part in ((low, min(high, start)), (max(low, end), high)) if part[0] < part[1]
        ]
    return left
