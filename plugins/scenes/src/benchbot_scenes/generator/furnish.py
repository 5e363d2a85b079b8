"""Ways to put furniture into a room: against a wall, in front of something, about a table, on top, up on a wall."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.generator.plot import (
    AXIS,
    GAP_M,
    LOW_M,
    WALL_GAP_M,
    WALLS,
    YAW_DEG,
    Box,
    Item,
    Plot,
    half_extent,
)
from benchbot_scenes.generator.supply import Supply
from benchbot_scenes.intersections import DEPTH_M, intersecting, triangles_of
from benchbot_scenes.layout import Placement

# How densely places along a wall are tried.
STEP_M = 0.10
SURFACE_TRIES = 24
# How far what hangs on a wall is from it, and from what hangs or stands beside it.
HUNG_GAP_M, HUNG_APART_M = 0.002, 0.12
# From the middle of one chair at a table to that of the next.
SEAT_PITCH_M = 0.62
# How far a chair is pulled out from where it would be tucked in, the least first.
PULLED_M = (0.0, 0.06, 0.12, 0.18, 0.24, 0.30)


@dataclass(frozen=True)
class Furnisher:
    """Puts models into one room; every method gives back what it placed, or None when there was no place for it."""

    plot: Plot
    supply: Supply

    def _item(
        self,
        model: AssetModel,
        x: float,
        y: float,
        z: float,
        yaw_deg: float,
        size_m: tuple[float, float, float] | None = None,
        carrier: str | None = None,
    ) -> Item:
        position = (round(x, 4), round(y, 4), round(z, 4))
        placement = Placement("", model.id, position, round(yaw_deg % 360.0, 1), size_m)
        return Item(placement, model, size_m or model.size_m, carrier)

    def _named(self, item: Item) -> Item:
        placement = Placement(**{**vars(item.placement), "id": self.supply.name(item.model)})
        return Item(placement, item.model, item.size_m, item.carrier)

    def against_wall(
        self,
        model: AssetModel | None,
        walls: Iterable[str] | None = None,
        front_m: float = 0.0,
        middle: bool = False,
        size_m: tuple[float, float, float] | None = None,
    ) -> Item | None:
        """With its back to a wall; `front_m` before it stays free, `middle` prefers the middle of walls to corners."""
        if model is None:
            return None
        size = size_m or model.size_m
        for wall, along_m in self._wall_places(size[1], walls, middle):
            item = self._at_wall(model, wall, along_m, size_m)
            front = self._front(item, front_m)
            if not self._clear_of_windows(wall, along_m, size) or not self.plot.fits(item):
                continue
            if front_m and not self._is_clear(front):
                continue
            if self.plot.leaves_ways(item):
                if front_m:
                    self.plot.kept.append(front)
                return self.plot.add(self._named(item))
        return None

    def _at_wall(
        self,
        model: AssetModel,
        wall: str,
        along_m: float,
        size_m: tuple[float, float, float] | None = None,
        z: float = 0.0,
        gap_m: float = WALL_GAP_M,
    ) -> Item:
        depth_m = (size_m or model.size_m)[0]
        x, y = self.plot.at_wall(wall, along_m, depth_m / 2 + gap_m)
        return self._item(model, x, y, z, YAW_DEG[wall], size_m)

    def at_wall_exactly(
        self,
        model: AssetModel,
        wall: str,
        along_m: float,
        bottom_m: float,
        gap_m: float = GAP_M,
        covers_window: bool = False,
    ) -> Item | None:
        """At one place of a wall, on the floor or hung at a height."""
        placed = self.all_at_wall(model, wall, [along_m], bottom_m, None, gap_m, covers_window)
        return placed[0] if placed else None

    def all_at_wall(
        self,
        model: AssetModel,
        wall: str,
        places_m: Sequence[float],
        bottom_m: float,
        size_m: tuple[float, float, float] | None = None,
        gap_m: float = GAP_M,
        covers_window: bool = False,
    ) -> list[Item]:
        """At each of some places of a wall, on the floor or hung at a height; nowhere unless everywhere."""
        size = size_m or model.size_m
        low, high = self.plot.along(wall)
        if min(places_m) - size[1] / 2 < low - 1e-6 or max(places_m) + size[1] / 2 > high + 1e-6:
            return []
        may_cover = covers_window or bottom_m > 0.0
        if not may_cover and not all(self._clear_of_windows(wall, along_m, size) for along_m in places_m):
            return []
        # What covers a window hangs before its sill.
        off_m = WALL_GAP_M if covers_window or bottom_m == 0.0 else HUNG_GAP_M
        items = [self._at_wall(model, wall, along_m, size_m, bottom_m, off_m) for along_m in places_m]
        if not all(self.plot.fits(item, gap_m) for item in items) or not self.plot.leaves_ways(*items):
            return []
        return [self.plot.add(self._named(item)) for item in items]

    def row_at_wall(self, model: AssetModel | None, count: int, gap_m: float, front_m: float) -> list[Item]:
        """So many side by side on the floor along a wall, so far apart; `front_m` before them stays free."""
        if model is None:
            return []
        pitch_m = model.size_m[1] + gap_m
        shifts_m = [(number - (count - 1) / 2) * pitch_m for number in range(count)]
        for wall, along_m in self._wall_places((count - 1) * pitch_m + model.size_m[1], None, True):
            places_m = [along_m + shift_m for shift_m in shifts_m]
            fronts = [self._front(self._at_wall(model, wall, place_m), front_m) for place_m in places_m]
            if not all(self._is_clear(front) for front in fronts):
                continue
            placed = self.all_at_wall(model, wall, places_m, 0.0)
            if placed:
                self.plot.kept.extend(fronts)
                return placed
        return []

    def _wall_places(self, width_m: float, walls: Iterable[str] | None, middle: bool) -> Iterator[tuple[str, float]]:
        """Places along walls: corners (or middles) first, otherwise in a random order."""
        names = list(walls) if walls is not None else [WALLS[i] for i in self.plot.rng.permutation(4)]
        for wall in names:
            low, high = self.plot.along(wall)
            low, high = low + width_m / 2 + WALL_GAP_M, high - width_m / 2 - WALL_GAP_M
            if high < low:
                continue
            count = int((high - low) / STEP_M) + 1
            places = low + np.arange(count) * (high - low) / max(1, count - 1) if count > 1 else np.array([low])
            centre = (low + high) / 2
            order = np.argsort(np.abs(places - centre) * (1 if middle else -1), kind="stable")
            if not middle and self.plot.rng.random() < 0.5:
                order = np.argsort(np.minimum(places - low, high - places) + (places > centre) * 0.01, kind="stable")
            for number in order:
                yield wall, float(places[number])

    def _clear_of_windows(self, wall: str, along_m: float, size: tuple[float, float, float]) -> bool:
        low, high = along_m - size[1] / 2, along_m + size[1] / 2
        windows = self.plot.openings_in(wall, self.plot.windows)
        return not any(
            low < end and start < high and size[2] > max(LOW_M, opening.bottom_m - 0.04)
            for start, end, opening in windows
        )

    def _front(self, item: Item, front_m: float) -> Box:
        half_x, half_y = item.size_m[0] / 2, item.size_m[1] / 2
        corners = [item.place(x, y) for x in (half_x, half_x + front_m) for y in (-half_y, half_y)]
        xs, ys = zip(*corners, strict=True)
        return Box((min(xs) + 0.01, min(ys) + 0.01), (max(xs) - 0.01, max(ys) - 0.01), 0.05)

    def _is_clear(self, box: Box) -> bool:
        inside = all(box.low[i] >= self.plot.space.low[i] and box.high[i] <= self.plot.space.high[i] for i in (0, 1))
        return inside and not any(box.overlaps(other) for other in self.plot.taken)

    def relative(
        self,
        model: AssetModel | None,
        to: Item,
        x: float,
        y: float,
        turn_deg: float = 0.0,
        size_m: tuple[float, float, float] | None = None,
        z: float = 0.0,
    ) -> Item | None:
        """At a point of another item's frame."""
        if model is None:
            return None
        item = self._item(model, *to.place(x, y), z, to.placement.yaw_deg + turn_deg, size_m)
        if not self.plot.fits(item) or not self.plot.leaves_ways(item):
            return None
        return self.plot.add(self._named(item))

    def drawn_up(self, model: AssetModel | None, to: Item, x: float, y: float, turn_deg: float) -> Item | None:
        """A chair at a point of its table's frame, under it as far as legs, arms and drawers let it be."""
        if model is None:
            return None
        table = triangles_of(to.placement, to.model)
        for pulled_m in PULLED_M:
            turn = math.radians(turn_deg)
            at = to.place(x - pulled_m * math.cos(turn), y - pulled_m * math.sin(turn))
            item = self._item(model, *at, 0.0, to.placement.yaw_deg + turn_deg)
            if not intersecting({"table": table, "chair": triangles_of(item.placement, model)}):
                break
        else:
            return None
        self.plot.taken.remove(to.box)
        is_free = self.plot.fits(item, -0.01)
        self.plot.taken.append(to.box)
        return self.plot.add(self._named(item)) if is_free and self.plot.leaves_ways(item) else None

    def standing(self, model: AssetModel | None, x: float, y: float, yaw_deg: float) -> Item | None:
        """On the floor at a point of the map frame."""
        if model is None:
            return None
        item = self._item(model, x, y, 0.0, yaw_deg)
        if not self.plot.fits(item) or not self.plot.leaves_ways(item):
            return None
        return self.plot.add(self._named(item))

    def rug(self, model: AssetModel | None, about: Item, x: float, turn_deg: float = 0.0) -> Item | None:
        """A rug under and about an item; furniture stands on it."""
        if model is None:
            return None
        px, py = about.place(x, 0.0)
        item = self._item(model, px, py, 0.0, about.placement.yaw_deg + turn_deg)
        box, low, high = item.box, self.plot.space.low, self.plot.space.high
        if any(box.low[i] < low[i] + 0.05 or box.high[i] > high[i] - 0.05 for i in (0, 1)):
            return None
        if any(other.model.kind == "rug" and other.box.overlaps(box) for other in self.plot.items):
            return None
        return self.plot.add(self._named(item), takes=False)

    def chairs_about(self, model: AssetModel | None, table: Item, count: int, tucked_m: float = 0.16) -> list[Item]:
        """Chairs on the long sides of a table, then at its ends, facing it."""
        if model is None:
            return []
        half_x, half_y = table.size_m[0] / 2, table.size_m[1] / 2
        along_x, along_y = (max(1, int(length / SEAT_PITCH_M)) for length in (table.size_m[0], table.size_m[1]))
        out = model.size_m[0] / 2 - tucked_m
        seats = [(half_x + out, (i + 0.5) / along_y * 2 * half_y - half_y, 180.0) for i in range(along_y)]
        seats += [(-half_x - out, y, 0.0) for _, y, _ in seats]
        ends = [((i + 0.5) / along_x * 2 * half_x - half_x, half_y + out, -90.0) for i in range(along_x)]
        ends += [(x, -half_y - out, 90.0) for x, _, _ in ends]
        ordered = [*seats, *ends] if half_y >= half_x else [*ends, *seats]
        placed: list[Item] = []
        for x, y, turn in ordered:
            if len(placed) == count:
                break
            jitter = float(self.plot.rng.uniform(-8, 8))
            chair = self.drawn_up(model, table, x, y, turn + jitter)
            if chair is not None:
                placed.append(chair)
        return placed

    def on_top(
        self,
        model: AssetModel | None,
        carrier: Item | None,
        at: tuple[float, float] | None = None,
        turn_deg: float | None = None,
        surface: int | None = None,
    ) -> Item | None:
        """On a surface of a carrier (the highest, or that number), at a point of its frame or anywhere free."""
        if model is None or carrier is None or not carrier.model.surfaces:
            return None
        surfaces = sorted(carrier.model.surfaces, key=lambda found: found.z_m)
        chosen = surfaces[-1 if surface is None else surface % len(surfaces)]
        scale = [carrier.size_m[i] / carrier.model.size_m[i] for i in range(3)]
        if model.size_m[2] > chosen.headroom_m * scale[2]:
            return None
        low = [chosen.low_m[i] * scale[i] for i in (0, 1)]
        high = [chosen.high_m[i] * scale[i] for i in (0, 1)]
        z = carrier.placement.position[2] + chosen.z_m * scale[2]
        rng = self.plot.rng
        for _ in range(1 if at is not None and turn_deg is not None else SURFACE_TRIES):
            turn = float(rng.uniform(-180, 180)) if turn_deg is None else turn_deg
            half_x, half_y = half_extent(model.size_m, turn)
            room = [(low[0] + half_x, high[0] - half_x), (low[1] + half_y, high[1] - half_y)]
            if any(end < start - 0.02 for start, end in room):
                continue
            x, y = at or (float(rng.uniform(min(a), max(a))) for a in room)
            item = self._item(
                model, *carrier.place(x, y), z, carrier.placement.yaw_deg + turn, carrier=carrier.placement.id
            )
            others = [
                other.box
                for other in self.plot.items
                if other.carrier == carrier.placement.id or (other.model.placement == "wall" and other != carrier)
            ]
            if not any(item.box.overlaps(other, 0.01) for other in others):
                return self.plot.add(self._named(item), takes=False)
        return None

    def on_wall(
        self,
        model: AssetModel | None,
        bottom_m: float,
        walls: Iterable[str] | None = None,
        above: Item | None = None,
        middle: bool = True,
    ) -> Item | None:
        """Hung on a wall, clear of openings and of what stands before it; above the middle of an item when given."""
        if model is None:
            return None
        if above is not None:
            places: Sequence[tuple[str, float]] = [self.behind(above)]
        else:
            places = list(self._wall_places(model.size_m[1], walls, middle))
        for wall, along_m in places:
            hung = self.hung(model, wall, along_m, bottom_m, above)
            if hung is not None:
                return hung
        return None

    def hung(
        self, model: AssetModel, wall: str, along_m: float, bottom_m: float, above: Item | None = None
    ) -> Item | None:
        """Hung at one place of a wall, if it is clear there of openings and of what stands before it."""
        size = model.size_m
        item = self._at_wall(model, wall, along_m, z=max(bottom_m, 0.01), gap_m=HUNG_GAP_M)
        low, high = along_m - size[1] / 2 - 0.06, along_m + size[1] / 2 + 0.06
        holes = self.plot.openings_in(wall, (*self.plot.windows, *self.plot.doors))
        if any(
            low < end and start < high and bottom_m < hole.top_m + 0.1 and bottom_m + size[2] > hole.bottom_m
            for start, end, hole in holes
        ):
            return None
        if any(item.box.overlaps(leaf) for leaf in self.plot.leaves()):
            return None
        if any(item.box.overlaps(other.box, HUNG_APART_M) for other in self.plot.items if other is not above):
            return None
        if low < self.plot.along(wall)[0] or high > self.plot.along(wall)[1]:
            return None
        if bottom_m < 1.1 and (not self.plot.fits(item) or not self.plot.leaves_ways(item)):
            return None
        # What a map names has floor before it, not a deep piece of furniture.
        if model.class_name is not None and not self.plot.leaves_ways(self._at_wall(model, wall, along_m)):
            return None
        return self.plot.add(self._named(item))

    def behind(self, item: Item) -> tuple[str, float]:
        """The wall that an item has its back to, and where along it."""
        wall = next(wall for wall in WALLS if abs(YAW_DEG[wall] - item.placement.yaw_deg % 360) < 45)
        return wall, item.placement.position[AXIS[wall]]

    def hung_at_ceiling(self, model: AssetModel | None, x: float, y: float) -> Item | None:
        """Under the ceiling."""
        if model is None:
            return None
        item = self._item(model, x, y, self.plot.height_m - model.size_m[2], 0.0)
        return self.plot.add(self._named(item), takes=False)

    def at(
        self,
        model: AssetModel,
        at: tuple[float, float],
        z: float,
        yaw_deg: float,
        carrier: Item | None = None,
        size_m: tuple[float, float, float] | None = None,
    ) -> Item:
        """An item exactly there, which is not yet in the room; it goes with its carrier."""
        return self._item(model, *at, z, yaw_deg, size_m, None if carrier is None else carrier.placement.id)

    def put(self, item: Item, *, takes: bool = True) -> Item:
        """Put an item into the room, under a new name."""
        return self.plot.add(self._named(item), takes=takes)

    def is_free(self, item: Item) -> bool:
        """Whether an item reaches into nothing in the room by more than a centimetre, as far as triangles say."""
        body, box = triangles_of(item.placement, item.model), item.box
        beside = [other for other in self.plot.items if box.overlaps(other.box, -DEPTH_M)]
        return not any(
            min(box.top_m, other.box.top_m) - max(box.bottom_m, other.box.bottom_m) > DEPTH_M
            and intersecting({"it": body, "other": triangles_of(other.placement, other.model)})
            for other in beside
        )
