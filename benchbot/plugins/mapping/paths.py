"""Shortest ways through a grid: A* (Hart, Nilsson, Raphael, 1968), and the straight pieces of what it finds."""

import heapq
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchbot.plugins.mapping.occupancy import Cell, Mask

NEIGHBOURS = tuple((i, j, math.hypot(i, j)) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j)


def shortest_path(drivable: Mask, start: Cell, goal: Cell) -> list[Cell]:
    """Return the cells of a shortest way from start to goal, both included; an empty list when there is none.

    Steps go to the eight neighbours, never diagonally past a corner.
    """
    best = {start: 0.0}
    came_from: dict[Cell, Cell] = {}
    waiting = [(_at_least(start, goal), start)]
    done: set[Cell] = set()
    while waiting:
        _, cell = heapq.heappop(waiting)
        if cell == goal:
            return _trace(came_from, goal)
        if cell in done:
            continue
        done.add(cell)
        for i, j, step in NEIGHBOURS:
            neighbour = cell[0] + i, cell[1] + j
            if not _free(drivable, neighbour):
                continue
            if i and j and not (_free(drivable, (cell[0] + i, cell[1])) and _free(drivable, (cell[0], cell[1] + j))):
                continue
            length = best[cell] + step
            if length < best.get(neighbour, math.inf):
                best[neighbour] = length
                came_from[neighbour] = cell
                heapq.heappush(waiting, (length + _at_least(neighbour, goal), neighbour))
    return []


def way_lengths(drivable: Mask, start: Cell) -> NDArray[np.float64]:
    """Return the length in cells of the `shortest_path` from start to each cell; infinite where there is none."""
    # Most solutions that import this module drive nowhere, and scipy takes as long to import as all else.
    from scipy import sparse
    from scipy.sparse import csgraph

    free = np.pad(drivable, 1)
    numbers = np.arange(free.size).reshape(free.shape)
    here = numbers[1:-1, 1:-1]
    edges: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]] = []
    for i, j, step in NEIGHBOURS:
        passable = free & np.roll(free, (-i, -j), (0, 1)) & np.roll(free, -i, 0) & np.roll(free, -j, 1)
        from_cells = here[passable[1:-1, 1:-1]]
        edges.append((from_cells, from_cells + i * free.shape[1] + j, np.full(len(from_cells), step)))
    starts, ends, steps = (np.concatenate(column) for column in zip(*edges, strict=True))
    graph = sparse.csr_array((steps, (starts, ends)), shape=(free.size, free.size))
    lengths: NDArray[np.float64] = csgraph.dijkstra(graph, indices=numbers[start[0] + 1, start[1] + 1])
    return lengths.reshape(free.shape)[1:-1, 1:-1]


def first_corner(drivable: Mask, path: Sequence[Cell]) -> Cell:
    """Return the farthest cell of a path that a straight line from its start reaches."""
    reached = path[0]
    for cell in path[1:]:
        if not straight_line_is_free(drivable, path[0], cell):
            break
        reached = cell
    return reached if reached != path[0] or len(path) == 1 else path[1]


def straight_line_is_free(drivable: Mask, start: Cell, end: Cell) -> bool:
    """Return whether all cells on the straight line between two cells are drivable."""
    count = 2 * max(abs(end[0] - start[0]), abs(end[1] - start[1])) + 1
    i = np.rint(np.linspace(start[0], end[0], count)).astype(int)
    j = np.rint(np.linspace(start[1], end[1], count)).astype(int)
    return bool(drivable[i, j].all())


def _free(drivable: Mask, cell: Cell) -> bool:
    i, j = cell
    return 0 <= i < drivable.shape[0] and 0 <= j < drivable.shape[1] and bool(drivable[i, j])


def _at_least(cell: Cell, goal: Cell) -> float:
    i, j = abs(cell[0] - goal[0]), abs(cell[1] - goal[1])
    return max(i, j) + (math.sqrt(2) - 1) * min(i, j)


def _trace(came_from: dict[Cell, Cell], goal: Cell) -> list[Cell]:
    path = [goal]
    while path[-1] in came_from:
        path.append(came_from[path[-1]])
    return path[::-1]
