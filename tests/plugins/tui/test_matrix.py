"""The matrix of a batch: the place of each episode, and bars for its states."""

from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.tui.batch_facts import shares, style, tally
from benchbot.plugins.tui.matrix import Grid
from tests.plugins.tui.watched import batch_view


@given(st.lists(st.integers(0, 2000), max_size=8), st.integers(0, 120))
def test_the_parts_of_a_bar_fill_it_and_nothing_that_is_there_vanishes(numbers: list[int], width: int) -> None:
    parts = shares(numbers, width)
    present = [part for part, number in zip(parts, numbers, strict=True) if number]
    assert sum(parts) == (width if present else 0)
    assert all(part == 0 for part, number in zip(parts, numbers, strict=True) if not number)
    if len(present) <= width:
        assert all(part >= 1 for part in present)


def test_each_episode_has_its_place_in_the_matrix() -> None:
    cells = batch_view(3, 8).cells
    grid = Grid.of(cells)
    assert (grid.environments, len(grid.columns)) == (("room:1", "room:2", "room:3"), 8)
    assert grid.columns[4] == ("carter_lowres", 0, 0, 0)
    assert sorted(grid.position) == list(range(24))
    assert all(grid.index(*grid.position[index]) == index for index in range(24))
    states = [cell.state for cell in cells]
    assert sum(tally(states[index] for index in grid.places[0] if index is not None).values()) == 8
    assert next(iter(tally(states))) == "done"
    # Where they do not fit into a line, they stand on several.
    folded = grid.wrapped(5)
    assert folded.environments == ("room:1", "", "room:2", "", "room:3", "")
    assert sorted(folded.position) == list(range(24))
    assert folded.places[1] == (5, 6, 7, None, None)
    # Episodes that differ in nothing but a setting stand beside each other.
    twice = Grid.of([*cells[:2], *cells[:2]])
    assert [column[1:] for column in twice.columns] == [(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 1)]
    assert (style("done").letter, style("never heard of").letter) == ("✓", "F")
