import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from benchbot.plugins.mapping.occupancy import Cell, Mask
from benchbot.plugins.mapping.paths import (
    NEIGHBOURS,
    first_corner,
    shortest_path,
    straight_line_is_free,
    way_lengths,
)

SIZE = 8
Grids = arrays.arrays(bool, (SIZE, SIZE), elements=st.booleans())


def grid(drawing: str) -> Mask:
    return np.array([[character != "#" for character in row] for row in drawing.split()])


def length(path: list[Cell]) -> float:
    return sum(math.dist(one, other) for one, other in itertools.pairwise(path))


def true_length(drivable: Mask) -> float:
    """Return the length of the shortest way from corner to corner, by somebody else's algorithm."""

    def free(i: int, j: int) -> bool:
        return 0 <= i < SIZE and 0 <= j < SIZE and bool(drivable[i, j])

    edges = [
        (i * SIZE + j, (i + di) * SIZE + j + dj, step)
        for i in range(SIZE)
        for j in range(SIZE)
        for di, dj, step in NEIGHBOURS
        if free(i, j) and free(i + di, j + dj) and (di == 0 or dj == 0 or (free(i + di, j) and free(i, j + dj)))
    ]
    if not edges:
        return math.inf
    start, end, steps = zip(*edges, strict=True)
    graph = coo_array((steps, (start, end)), shape=(SIZE**2, SIZE**2)).tocsr()
    return float(dijkstra(graph, indices=0)[-1])


@given(Grids)
@settings(max_examples=60)
def test_a_path_is_free_connected_and_shortest(drivable: Mask) -> None:
    drivable[0, 0] = drivable[-1, -1] = True
    path = shortest_path(drivable, (0, 0), (SIZE - 1, SIZE - 1))

    assert all(drivable[cell] for cell in path)
    assert all(math.dist(one, other) < 1.5 for one, other in itertools.pairwise(path))
    assert math.isclose(length(path) if path else math.inf, true_length(drivable))


@given(Grids)
@settings(max_examples=20)
def test_ways_are_as_long_as_shortest_paths(drivable: Mask) -> None:
    drivable[0, 0] = True
    lengths = way_lengths(drivable, (0, 0))

    for goal in np.ndindex(drivable.shape):
        path = shortest_path(drivable, (0, 0), (goal[0], goal[1]))
        assert math.isclose(lengths[goal], length(path) if path else math.inf)


def test_there_is_no_way_into_a_closed_room() -> None:
    assert shortest_path(grid("..#. ..#. ####  ....".replace("  ", " ")), (0, 0), (3, 3)) == []


def test_no_corner_is_cut() -> None:
    assert len(shortest_path(grid(".# .."), (0, 0), (1, 1))) == 3


def test_the_way_to_here_is_here() -> None:
    assert shortest_path(grid("."), (0, 0), (0, 0)) == [(0, 0)]
    assert first_corner(grid("."), [(0, 0)]) == (0, 0)


def test_the_first_corner_is_as_far_as_one_can_go_straight() -> None:
    room = grid("..... .###. .###. .....")
    path = shortest_path(room, (0, 0), (3, 4))

    corner = first_corner(room, path)
    assert corner in {(0, 4), (3, 0)}
    assert straight_line_is_free(room, (0, 0), corner)
    assert not straight_line_is_free(room, (0, 0), (3, 4))
