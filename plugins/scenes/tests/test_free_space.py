"""Where a disc fits."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.free_space import FreeSpace, free_space
from plugins.scenes.tests.boxes import box, room, scene

EMPTY = free_space(scene(*room()), 0.03, 1.1)


@settings(max_examples=100, deadline=None)
@given(x=st.floats(0.05, 3.95), y=st.floats(0.05, 2.95))
def test_clearance_is_the_distance_to_the_walls_and_never_more(x: float, y: float) -> None:
    column, row = EMPTY.cell(x, y)
    centre_x, centre_y = EMPTY.centre(column, row)
    true_m = max(0.0, min(centre_x, 4.0 - centre_x, centre_y, 3.0 - centre_y))
    assert true_m - 0.02 <= EMPTY.clearance_m[column, row] <= true_m + 1e-6
    assert EMPTY.clearance_at(x, y) <= min(x, 4.0 - x, y, 3.0 - y) + 1e-6


def test_off_the_grid_there_is_no_room() -> None:
    assert EMPTY.clearance_at(99.0, 0.0) == 0.0


@pytest.mark.parametrize(("low_z", "high_z", "blocks"), [(0.0, 0.02, False), (0.5, 0.8, True), (1.2, 2.0, False)])
def test_what_the_robot_passes_over_or_under_is_no_obstacle(low_z: float, high_z: float, blocks: bool) -> None:
    space = free_space(scene(*room(), box("thing", (1.5, 1.0, low_z), (2.5, 2.0, high_z))), 0.03, 1.1)
    assert (space.clearance_at(2.0, 1.5) == 0.0) is blocks


def partitioned(gap_m: float) -> FreeSpace:
    """Two halves with a gap in the wall between them, at the middle of y."""
    low, high = 1.5 - gap_m / 2, 1.5 + gap_m / 2
    walls = [box("a", (1.9, 0.0, 0.0), (2.1, low, 2.5)), box("b", (1.9, high, 0.0), (2.1, 3.0, 2.5))]
    return free_space(scene(*room(), *walls), 0.03, 1.1)


@pytest.mark.parametrize(("gap_m", "passes"), [(0.5, False), (0.6, False), (0.75, True), (1.0, True)])
def test_a_region_reaches_through_gaps_that_are_wide_enough(gap_m: float, passes: bool) -> None:
    space = partitioned(gap_m)
    region = space.region((1.0, 1.5), 0.3)
    assert region[space.cell(1.0, 1.5)]
    assert bool(region[space.cell(3.0, 1.5)]) is passes


def test_nobody_starts_inside_furniture() -> None:
    space = free_space(scene(*room(), box("bed", (1.0, 0.5, 0.0), (3.0, 2.5, 0.5))), 0.03, 1.1)
    assert not space.region((2.0, 1.5), 0.3).any()


def test_the_largest_region_is_the_larger_half() -> None:
    wall = box("wall", (1.0, 0.0, 0.0), (1.2, 3.0, 2.5))
    space = free_space(scene(*room(), wall), 0.03, 1.1)
    region = space.largest_region(0.3)
    assert region[space.cell(3.0, 1.5)]
    assert not region[space.cell(0.5, 1.5)]


@pytest.mark.parametrize(("gap_m", "carries"), [(0.1, True), (0.2, True), (0.8, False)])
def test_a_crack_in_the_floor_carries_and_a_pit_does_not(gap_m: float, carries: bool) -> None:
    walls = room()[1:]
    floor = [box("a", (0, 0, -0.1), (2.0 - gap_m / 2, 3.0, 0.0)), box("b", (2.0 + gap_m / 2, 0, -0.1), (4.0, 3.0, 0.0))]
    space = free_space(scene(*walls, *floor), 0.03, 1.1)
    assert bool(space.region((1.0, 1.5), 0.3)[space.cell(3.0, 1.5)]) is carries


def test_without_a_floor_there_is_nowhere_to_stand() -> None:
    assert not free_space(scene(*room()[1:]), 0.03, 1.1).largest_region(0.1).any()


def test_a_floor_at_another_height_is_found_there() -> None:
    upstairs = scene(box("floor", (0.0, 0.0, 0.9), (4.0, 3.0, 1.0)))
    assert free_space(upstairs, 0.03, 1.1, floor_z_m=1.0).clearance_at(2.0, 1.5) > 1.4
    assert free_space(upstairs, 0.03, 1.1).clearance_at(2.0, 1.5) == 0.0
