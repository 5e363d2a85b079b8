"""Shortest ways, where geometry knows them: around a post, through a door, along straight lines."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from benchbot_task_navigation.floor_plan import Point
from benchbot_task_navigation.ways import Ways, length_m
from plugins.task_navigation.tests.floors import floor

POST = Ways(floor(4.0, posts=[(0.0, 0.0, 0.4)]), 0.3)
DOOR = Ways(floor(4.0, walls=[(0.0, -2.0, 0.0, 0.5), (0.0, 1.5, 0.0, 2.0)]), 0.2)
WIDE_AT_DOOR = Ways(DOOR.plan, 0.35)
SOME = settings(max_examples=40)

inside = st.tuples(st.floats(-1.6, 1.6), st.floats(-1.6, 1.6))


def around_m(start: Point, goal: Point, radius_m: float, *, behind: bool = False) -> float:
    """Return the length of the shortest way around a disc at the origin: two tangents and the arc between.

    `behind` takes the longer side.
    """
    away, towards = math.hypot(*start), math.hypot(*goal)
    between_rad = abs(math.remainder(math.atan2(start[1], start[0]) - math.atan2(goal[1], goal[0]), 2 * math.pi))
    between_rad = 2 * math.pi - between_rad if behind else between_rad
    arc_rad = between_rad - math.acos(radius_m / away) - math.acos(radius_m / towards)
    if arc_rad <= 0:
        return math.dist(start, goal)
    return math.sqrt(away**2 - radius_m**2) + math.sqrt(towards**2 - radius_m**2) + radius_m * arc_rad


@SOME
@given(inside, inside)
def test_around_a_post_it_is_less_than_one_per_cent_too_long(start: Point, goal: Point) -> None:
    assume(math.hypot(*start) > 0.72 and math.hypot(*goal) > 0.72)
    assume(math.dist(start, goal) > 1.0)
    way = POST.between(start, goal)

    assert way is not None
    np.testing.assert_array_equal(way[[0, -1]], [start, goal])
    # Too short by what bilinear interpolation cuts from the post, at most.
    assert 0.997 <= length_m(way) / around_m(start, goal, 0.7) <= 1.01


@SOME
@given(inside, inside)
def test_it_is_as_long_there_as_back_and_never_shorter_than_the_straight_line(start: Point, goal: Point) -> None:
    assume(min(DOOR.plan.clearance_at(np.array([start, goal]))) > 0.21)
    there, back = DOOR.between(start, goal), DOOR.between(goal, start)

    assert there is not None
    assert back is not None
    assert length_m(there) == pytest.approx(length_m(back), rel=0.01)
    assert length_m(there) >= math.dist(start, goal) - 1e-9


@SOME
@given(inside, inside)
def test_a_wider_robot_never_has_a_shorter_way(start: Point, goal: Point) -> None:
    assume(min(DOOR.plan.clearance_at(np.array([start, goal]))) > 0.36)
    narrow, wide = DOOR.between(start, goal), WIDE_AT_DOOR.between(start, goal)

    assert narrow is not None
    assert wide is not None
    assert length_m(wide) >= 0.99 * length_m(narrow)


def test_a_straight_line_is_exact() -> None:
    way = POST.between((-1.5, 1.0), (1.5, 1.1))

    assert way is not None
    assert way.tolist() == [[-1.5, 1.0], [1.5, 1.1]]


def test_through_a_door_it_bends_around_the_end_of_the_wall() -> None:
    way = DOOR.between((-1.0, -1.0), (1.0, -1.0))

    assert way is not None
    # The end of the wall is at (0, 0.5).
    assert length_m(way) == pytest.approx(around_m((-1.0, -1.5), (1.0, -1.5), 0.2, behind=True), rel=0.01)


def test_who_does_not_fit_through_the_door_has_no_way() -> None:
    wide = Ways(DOOR.plan, 0.55)

    assert wide.between((-1.0, 0.0), (1.0, 0.0)) is None
    assert not (wide.reachable((-1.0, 0.0)) & wide.reachable((1.0, 0.0))).any()


def test_where_nothing_is_free_there_is_no_way() -> None:
    wide = Ways(DOOR.plan, 1.5)

    assert wide.between((-1.0, 0.0), (-1.0, 1.0)) is None
    assert wide.towards(np.ones_like(wide.free))((-1.0, 0.0)) is None
    assert not wide.reachable((0.0, 0.0)).any()


def test_from_where_the_robot_does_not_fit_it_goes_by_the_nearest_free_place() -> None:
    way = POST.between((-1.9, 0.0), (-1.0, 0.0))

    assert way is not None
    assert length_m(way) == pytest.approx(0.9, rel=0.01)


def test_of_several_goals_the_nearest_by_the_way_counts() -> None:
    goals = DOOR.plan.within((1.0, -1.0), (0.0, 0.0), 0.01) | DOOR.plan.within((-1.0, 1.5), (0.0, 0.0), 0.01)
    way = DOOR.towards(goals)((-1.0, -1.0))

    assert way is not None
    np.testing.assert_allclose(way, [(-1.0, -1.0), (-1.0, 1.5)], atol=1e-9)
    assert DOOR.towards(np.zeros_like(goals))((-1.0, -1.0)) is None


def test_distances_from_everywhere_are_those_around_the_post_and_of_the_nearest_free_place_in_it() -> None:
    goal = (1.5, 0.2)
    distances_m = POST.distances_m(goal)

    for start in [(-1.5, 0.3), (-0.9, -1.2), (1.2, 1.0)]:
        i, j = np.rint((np.array(start) - POST.plan.origin_xy) / POST.plan.resolution_m).astype(int)
        here = tuple(POST.plan.points(np.array([[i, j]]))[0].tolist())
        wanted_m = around_m(here, goal, 0.7)
        assert wanted_m - 1e-6 <= distances_m[i, j] <= 1.02 * wanted_m + POST.plan.resolution_m
    assert np.isfinite(distances_m).all()
