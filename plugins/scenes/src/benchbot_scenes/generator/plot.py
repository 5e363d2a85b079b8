"""A room being furnished: what stands where, and what must stay free."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchbot_scenes.catalogue import AssetModel
from benchbot_scenes.generator.floor_plan import INNER_WALL_M, Space
from benchbot_scenes.layout import Opening, Placement, Point

CELL_M = 0.05
# Half the width of the ways that stay free: a robot of 0.3 m radius, and room to steer.
WAY_M = 0.38
# How near to each piece of furniture a robot's centre comes.
REACH_M = 0.75
# Before a door, as deep as its leaf is wide.
DOOR_ZONE_M = 0.95
# How far an open leaf reaches beside its opening, with its handle.
LEAF_M = 0.2
# Furniture stands this far from the wall: a skirting board is in between.
WALL_GAP_M = 0.025
GAP_M = 0.02
# What is lower can stand under a window; what is thinner can be walked and driven over.
LOW_M, FLAT_M = 0.72, 0.03
WALLS = ("west", "south", "east", "north")
YAW_DEG = {"west": 0.0, "south": 90.0, "east": 180.0, "north": 270.0}
AXIS = {"west": 1, "south": 0, "east": 1, "north": 0}
"""Of x and y, the one that a wall runs along."""


@dataclass(frozen=True)
class Box:
    """A rectangle of floor, and from where to where something takes the height above it."""

    low: Point
    high: Point
    bottom_m: float = 0.0
    top_m: float = 9.0

    def overlaps(self, other: "Box", gap_m: float = 0.0) -> bool:
        """Return whether two boxes overlap, or are nearer to each other than `gap_m`."""
        return (
            all(self.low[i] < other.high[i] + gap_m and other.low[i] < self.high[i] + gap_m for i in (0, 1))
            and self.bottom_m < other.top_m
            and other.bottom_m < self.top_m
        )


@dataclass(frozen=True)
class Item:
    """A placed model, and how it stands; `carrier` is the id of what it stands on."""

    placement: Placement
    model: AssetModel
    size_m: tuple[float, float, float]
    carrier: str | None = None

    def place(self, x: float, y: float) -> Point:
        """A point of the model's frame in the map frame."""
        turn = math.radians(self.placement.yaw_deg)
        cos, sin = math.cos(turn), math.sin(turn)
        px, py, _ = self.placement.position
        return px + cos * x - sin * y, py + sin * x + cos * y

    def own(self, points: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Points (N, 3) of the map frame in the model's frame."""
        turn = np.radians(self.placement.yaw_deg)
        x, y, z = (points - np.array(self.placement.position)).T
        return np.column_stack([np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x, z])

    @property
    def box(self) -> Box:
        """The upright box around it in the map frame."""
        half_x, half_y = half_extent(self.size_m, self.placement.yaw_deg)
        x, y, z = self.placement.position
        return Box((x - half_x, y - half_y), (x + half_x, y + half_y), z, z + self.size_m[2])


@dataclass
class Plot:
    """A room with its items; `taken` is what furniture must not overlap, `kept` what must stay walkable."""

    space: Space
    height_m: float
    doors: tuple[Opening, ...]
    windows: tuple[Opening, ...]
    rng: np.random.Generator
    items: list[Item] = field(default_factory=list)
    taken: list[Box] = field(default_factory=list)
    kept: list[Box] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.kept.extend(self.at_doors())

    @property
    def size_m(self) -> Point:
        """The room's width along x and y."""
        return self.space.high[0] - self.space.low[0], self.space.high[1] - self.space.low[1]

    def wall_of(self, opening: Opening) -> str:
        """The wall that an opening is in."""
        x, y = opening.at
        low, high = self.space.low, self.space.high
        off_m = {"west": abs(x - low[0]), "east": abs(x - high[0]), "south": abs(y - low[1]), "north": abs(y - high[1])}
        inside = {
            "west": low[1] < y < high[1],
            "east": low[1] < y < high[1],
            "south": low[0] < x < high[0],
            "north": low[0] < x < high[0],
        }
        return min((wall for wall in WALLS if inside[wall]), key=lambda wall: off_m[wall])

    def along(self, wall: str) -> tuple[float, float]:
        """From where to where a wall runs."""
        return self.space.low[AXIS[wall]], self.space.high[AXIS[wall]]

    def at_wall(self, wall: str, along_m: float, off_m: float) -> Point:
        """The point `off_m` into the room from a wall, at `along_m` along it."""
        low, high = self.space.low, self.space.high
        return {
            "west": (low[0] + off_m, along_m),
            "east": (high[0] - off_m, along_m),
            "south": (along_m, low[1] + off_m),
            "north": (along_m, high[1] - off_m),
        }[wall]

    def openings_in(self, wall: str, openings: tuple[Opening, ...]) -> list[tuple[float, float, Opening]]:
        """The openings in a wall, from where to where."""
        axis = AXIS[wall]
        return [
            (opening.at[axis] - opening.width_m / 2, opening.at[axis] + opening.width_m / 2, opening)
            for opening in openings
            if self.wall_of(opening) == wall
        ]

    def fits(self, item: Item, gap_m: float = GAP_M) -> bool:
        """Return whether an item stands in the room, clear of others, of doors, and of lamps if it is tall."""
        box = item.box
        inside = all(
            box.low[i] >= self.space.low[i] - 1e-6 and box.high[i] <= self.space.high[i] + 1e-6 for i in (0, 1)
        )
        if not inside or any(box.overlaps(other, gap_m) for other in self.taken):
            return False
        if any(box.overlaps(other.box) for other in self.items if other.model.placement == "ceiling"):
            return False
        return not any(box.overlaps(zone) for zone in self.kept) or item.size_m[2] <= FLAT_M

    def leaves_ways(self, *items: Item) -> bool:
        """Return whether all doors are still connected by free floor, and a robot can drive up to each item."""
        low = self.space.low
        shape = tuple(max(1, round(length / CELL_M)) for length in self.size_m)
        blocked = np.zeros((shape[0] + 2, shape[1] + 2), bool)
        blocked[[0, -1]], blocked[:, [0, -1]] = True, True
        for box in [*self.taken, *(item.box for item in items)]:
            if box.bottom_m < 1.1 and box.top_m > FLAT_M:
                blocked[_cells(box, low, blocked.shape)] = True
        for door in self.doors:
            for cell in self._threshold(door, blocked.shape):
                blocked[cell] = False
        clearance = ndimage.distance_transform_edt(~blocked) * CELL_M
        labels, _ = ndimage.label(clearance >= WAY_M)
        first = self._labels_before(labels, self.doors[0]) if self.doors else set(np.unique(labels)) - {0}
        if not first or any(not (first & self._labels_before(labels, door)) for door in self.doors[1:]):
            return False
        reached = np.isin(labels, list(first))
        if reached.sum() < 0.18 * reached.size:
            return False
        far = ndimage.distance_transform_edt(~reached) * CELL_M
        # Who sits is reached as the seat is, and cables are below what they belong to.
        on_floor = [item for item in [*self.items, *items] if item.carrier is None]
        standing = [item.box for item in on_floor if item.placement.position[2] == 0.0]
        return all(bool((far[_cells(box, low, far.shape)] < REACH_M).any()) for box in standing)

    def _labels_before(self, labels: npt.NDArray[np.int32], door: Opening) -> set[int]:
        zone = self.zone(door)
        return set(np.unique(labels[_cells(zone, self.space.low, labels.shape)]).tolist()) - {0}

    def _threshold(self, door: Opening, shape: tuple[int, ...]) -> Iterator[tuple[slice, slice]]:
        """The cells of the wall that a door opens."""
        wall = self.wall_of(door)
        box = self.zone(door)
        columns, rows = _cells(box, self.space.low, shape)
        yield {
            "west": (slice(0, 1), rows),
            "east": (slice(shape[0] - 1, shape[0]), rows),
            "south": (columns, slice(0, 1)),
            "north": (columns, slice(shape[1] - 1, shape[1])),
        }[wall]

    def zone(self, door: Opening) -> Box:
        """The floor before a door that stays free, as wide as its opening."""
        wall = self.wall_of(door)
        axis = AXIS[wall]
        return self._along_wall(wall, door.at[axis] - door.width_m / 2, door.at[axis] + door.width_m / 2)

    def leaves(self) -> Iterator[Box]:
        """The floor that the leaves of open doors take beside their openings, in the room that they open into."""
        for door in self.doors:
            wall = self.wall_of(door)
            axis = AXIS[wall]
            middle, inward = self.at_wall(wall, door.at[axis], 0.0), self.at_wall(wall, door.at[axis], 1.0)
            if door.open_deg == 0.0 or math.dist(middle, door.at) > INNER_WALL_M / 2:
                continue
            ahead = (inward[0] - middle[0], inward[1] - middle[1])
            side = (ahead[1], -ahead[0])[axis] * math.copysign(1.0, door.open_deg)
            edge = door.at[axis] + side * door.width_m / 2
            yield replace(self._along_wall(wall, edge, edge + side * LEAF_M), top_m=door.top_m)

    def at_doors(self) -> list[Box]:
        """The floor before all doors, then that beside those that stand open."""
        return [*map(self.zone, self.doors), *self.leaves()]

    def _along_wall(self, wall: str, start_m: float, end_m: float) -> Box:
        """The floor along a part of a wall, as deep as before a door."""
        corners = [self.at_wall(wall, along, off) for along in (start_m, end_m) for off in (0.0, DOOR_ZONE_M)]
        xs, ys = zip(*corners, strict=True)
        return Box((min(xs), min(ys)), (max(xs), max(ys)))

    def add(self, item: Item, *, takes: bool = True) -> Item:
        """Put an item into the room for good."""
        self.items.append(item)
        if takes:
            self.taken.append(item.box)
        return item


def half_extent(size_m: tuple[float, float, float], yaw_deg: float) -> Point:
    """Half the width along x and y of the upright box around a turned rectangle."""
    turn = math.radians(yaw_deg)
    cos, sin = abs(math.cos(turn)), abs(math.sin(turn))
    return (cos * size_m[0] + sin * size_m[1]) / 2, (sin * size_m[0] + cos * size_m[1]) / 2


def _cells(box: Box, low: Point, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """The cells of a raster with a border of one cell that a box touches."""
    slices = []
    for i in (0, 1):
        first = math.floor((box.low[i] - low[i]) / CELL_M + 1e-6) + 1
        last = math.ceil((box.high[i] - low[i]) / CELL_M - 1e-6) + 1
        slices.append(slice(min(max(first, 0), shape[i] - 1), min(max(last, first + 1, 1), shape[i])))
    return slices[0], slices[1]
