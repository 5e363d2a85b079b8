"""Cells of surfaces, and what is told apart in them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from benchbot_sim_taichi import surface_cells
from benchbot_sim_taichi.surface_cells import SAMPLE_STRIDE, SurfaceCells

KINDS = 3


def cells_of(sizes: list[int]) -> SurfaceCells:
    """Cells with so many samples each, which are numbered by their triangles."""
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int32)
    samples = np.zeros((first[-1], SAMPLE_STRIDE), np.float32)
    samples[:, 0] = np.arange(first[-1])
    grid = np.full(2 * len(sizes), -1, np.int32)
    keys = np.arange(1, 2 * len(sizes), 2, dtype=np.int32)
    grid[keys] = np.arange(len(sizes))
    return SurfaceCells(grid, keys, samples.ravel(), first, np.zeros(8, np.float32))


@given(st.lists(st.lists(st.integers(0, KINDS - 1), min_size=1, max_size=16), min_size=1, max_size=20))
def test_samples_of_each_kind_get_a_cell_that_is_found_from_their_place(kinds: list[list[int]]) -> None:
    cells = cells_of([len(of_place) for of_place in kinds])

    split, kind, following = surface_cells.split(cells, np.concatenate(kinds).astype(np.int32))

    number = split.samples.reshape(-1, SAMPLE_STRIDE)[:, 0].astype(int)
    assert sorted(number) == list(range(cells.first[-1]))
    visited = 0
    for place, of_place in enumerate(kinds):
        cell, lowest = place, -1
        while cell >= 0:
            inside = number[split.first[cell] : split.first[cell + 1]] - cells.first[place]
            assert kind[cell] > lowest
            assert inside.tolist() == np.flatnonzero(np.array(of_place) == kind[cell]).tolist()
            assert split.keys[cell] == cells.keys[place]
            visited, lowest, cell = visited + len(inside), kind[cell], following[cell]
    assert visited == cells.first[-1]


def test_cells_of_one_kind_stay_as_they_are() -> None:
    cells = cells_of([3, 1, 16])

    split, kind, following = surface_cells.split(cells, np.repeat([0, 2, 1], [3, 1, 16]).astype(np.int32))

    assert np.array_equal(split.samples, cells.samples)
    assert np.array_equal(split.first, cells.first)
    assert kind.tolist() == [0, 2, 1]
    assert following.tolist() == [-1, -1, -1]


@given(st.lists(st.lists(st.booleans(), min_size=1, max_size=16), min_size=1, max_size=20))
def test_samples_that_are_left_out_leave_the_others_where_they_were(dropped: list[list[bool]]) -> None:
    cells = cells_of([len(of_place) for of_place in dropped])

    kept = surface_cells.without(cells, np.concatenate(dropped).astype(bool))

    number = kept.samples.reshape(-1, SAMPLE_STRIDE)[:, 0].astype(int)
    for place, of_place in enumerate(dropped):
        cell = kept.grid[cells.keys[place]]
        left = cells.first[place] + np.flatnonzero(~np.array(of_place))
        assert (cell >= 0) == (len(left) > 0)
        if cell >= 0:
            assert kept.keys[cell] == cells.keys[place]
            assert number[kept.first[cell] : kept.first[cell + 1]].tolist() == left.tolist()
    assert kept.first[-1] == len(number)
