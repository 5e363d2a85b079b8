"""Paths over the floor: short, with clearance, as straight legs; and the order in which stops are visited."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from benchbot_scenes.free_space import FreeSpace

Point = tuple[float, float]
# With less room than this a way is taken for longer than it is, up to so many times.
COMFORT_M = 0.60
DETOUR = 2.5
CHECK_STEP_M = 0.02
SHORTCUT_SLACK_M = 0.12


@dataclass(frozen=True)
class Roads:
    """The cells of a free space that a robot's centre may be in, as a graph of eight neighbours each."""

    space: FreeSpace
    is_open: npt.NDArray[np.bool_]
    least_m: float

    @cached_property
    def cells(self) -> npt.NDArray[np.int64]:
        """The open cells (N, 2) in a fixed order."""
        return np.argwhere(self.is_open)

    @cached_property
    def _numbers(self) -> npt.NDArray[np.int64]:
        numbers = np.full(self.is_open.shape, -1, np.int64)
        numbers[self.is_open] = np.arange(int(self.is_open.sum()))
        return numbers

    @cached_property
    def _graph(self) -> sparse.csr_matrix:
        shape, numbers = self.is_open.shape, self._numbers
        clearance = self.space.clearance_m.astype(np.float64)
        tight = np.clip((COMFORT_M - clearance) / max(COMFORT_M - self.least_m, 1e-3), 0.0, 1.0)
        cost = 1.0 + (DETOUR - 1.0) * tight
        froms, tos, weights = [], [], []
        for i, j in ((1, 0), (0, 1), (1, 1), (1, -1)):
            a = (slice(0, shape[0] - i), slice(max(0, -j), shape[1] - max(0, j)))
            b = (slice(i, shape[0]), slice(max(0, j), shape[1] - max(0, -j)))
            both = self.is_open[a] & self.is_open[b]
            froms.append(numbers[a][both])
            tos.append(numbers[b][both])
            weights.append(math.hypot(i, j) * self.space.cell_m * (cost[a][both] + cost[b][both]) / 2)
        size = len(self.cells)
        return sparse.csr_matrix((np.concatenate(weights), (np.concatenate(froms), np.concatenate(tos))), (size, size))

    def nearest(self, point: Point) -> int:
        """The number of the open cell nearest to a point."""
        offsets = self.cells - np.array(self.space.cell(*point))
        return int(np.argmin((offsets**2).sum(1)))

    def place(self, number: int) -> Point:
        """The middle of an open cell."""
        column, row = self.cells[number]
        return self.space.centre(int(column), int(row))

    def tour(self, start: int, stops: Sequence[int]) -> list[list[Point]]:
        """Visit all `stops` from `start` in a short order: the way to each, as corners of straight legs."""
        places = [start, *stops]
        lengths, previous = dijkstra(self._graph, directed=False, indices=places, return_predecessors=True)
        order = short_order(lengths[:, places])
        ways = []
        for here, there in pairwise(order):
            cells = [places[there]]
            while cells[-1] != places[here]:
                cells.append(int(previous[here, cells[-1]]))
            ways.append(self.straighten([self.place(number) for number in reversed(cells)]))
        return ways

    def straighten(self, points: Sequence[Point]) -> list[Point]:
        """Leave out points of a way where straight on has hardly less room and is free."""
        kept = [points[0]]
        here = 0
        while here < len(points) - 1:
            there = here + 1
            room = math.inf
            for candidate in range(here + 1, len(points)):
                room = min(room, COMFORT_M, self.space.clearance_at(*points[candidate]))
                needed = max(self.least_m - 0.005, room - SHORTCUT_SLACK_M)
                if least_clearance(self.space, points[here], points[candidate]) >= needed:
                    there = candidate
            kept.append(points[there])
            here = there
        return kept


def short_order(lengths: npt.NDArray[np.float64]) -> list[int]:
    """An open tour from place 0 through all others: nearest neighbour, then 2-opt (Croes, 1958)."""
    left, order = set(range(1, len(lengths))), [0]
    while left:
        here = order[-1]
        following = min(left, key=lambda place: (lengths[here, place], place))
        order.append(following)
        left.remove(following)
    improved = True
    while improved:
        improved = False
        for i in range(1, len(order) - 1):
            for j in range(i + 1, len(order)):
                before = lengths[order[i - 1], order[i]]
                after = lengths[order[i - 1], order[j]]
                if j + 1 < len(order):
                    before += lengths[order[j], order[j + 1]]
                    after += lengths[order[i], order[j + 1]]
                if after < before - 1e-9:
                    order[i : j + 1] = reversed(order[i : j + 1])
                    improved = True
    return order


def least_clearance(space: FreeSpace, start: Point, end: Point) -> float:
    """The least clearance on a straight leg, no more than it is."""
    count = max(1, math.ceil(math.dist(start, end) / CHECK_STEP_M))
    fractions = np.arange(count + 1) / count
    xs = start[0] + fractions * (end[0] - start[0])
    ys = start[1] + fractions * (end[1] - start[1])
    columns = np.floor((xs - space.low_m[0]) / space.cell_m).astype(int)
    rows = np.floor((ys - space.low_m[1]) / space.cell_m).astype(int)
    if columns.min() < 0 or rows.min() < 0 or columns.max() >= space.shape[0] or rows.max() >= space.shape[1]:
        return 0.0
    centre_x = space.low_m[0] + (columns + 0.5) * space.cell_m
    centre_y = space.low_m[1] + (rows + 0.5) * space.cell_m
    room = space.clearance_m[columns, rows] - np.hypot(xs - centre_x, ys - centre_y)
    return max(0.0, float(room.min()))
