"""Rooms, walls, and openings in them, from above."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Point

from benchbot.core.errors import BenchbotError
from benchbot_scenes.floor_plan import edges, floor_plan, walled
from benchbot_scenes.layout import Building, Opening, Room
from plugins.scenes.tests.plans import DOOR, EAST, WEST, WHITE, WINDOW, opening, room, two_rooms


def test_walls_fill_what_is_between_and_around_rooms() -> None:
    plan = floor_plan(two_rooms())
    assert plan.footprint.bounds == pytest.approx((-0.3, -0.3, 7.3, 3.3))
    assert plan.walls.area == pytest.approx(7.6 * 3.6 - 4 * 3 - 2.9 * 3)


def test_a_door_connects_two_rooms_and_opens_to_the_nearer() -> None:
    for x, near, far in ((4.02, 0, 1), (4.08, 1, 0), (4.05, 0, 1)):
        (passage,) = floor_plan(two_rooms(replace(DOOR, at=(x, 1.0)))).passages
        assert (passage.near, passage.far) == (near, far)
        assert passage.depth_m == pytest.approx(0.1)


def test_a_window_leads_out() -> None:
    (passage,) = floor_plan(two_rooms(WINDOW)).passages
    assert (passage.near, passage.far) == (0, None)
    assert passage.depth_m == pytest.approx(0.3)
    assert passage.through == pytest.approx([0, -1])
    assert passage.middle == pytest.approx([2, 0])


@pytest.mark.parametrize("y", [0.0, -0.1, -0.3])
def test_an_opening_may_be_given_anywhere_in_its_wall(y: float) -> None:
    (passage,) = floor_plan(two_rooms(replace(WINDOW, at=(2.0, y)))).passages
    assert passage.middle == pytest.approx([2, 0])


@pytest.mark.parametrize(
    ("wrong", "title", "why"),
    [
        (replace(DOOR, at=(2.0, 1.5)), "is in no wall", "The nearest room is 'west', its side 1.50 m away"),
        (replace(DOOR, at=(4.05, 0.3)), "is in no wall", "0.9 m wide"),
        (replace(DOOR, at=(4.05, 3.1)), "is in no wall", "one room, or the outdoors"),
        (replace(WINDOW, at=(4.05, -0.1)), "is in no wall", "nearest room"),
        (replace(WINDOW, width_m=4.2), "is in no wall", "4.2 m wide"),
        (replace(WINDOW, top_m=2.6), "does not fit the height", "from 0 to 2.5 m"),
        (replace(WINDOW, bottom_m=2.2), "does not fit the height", "from 2.2 to 2.1 m"),
    ],
)
def test_an_opening_that_fits_nowhere_is_refused(wrong: Opening, title: str, why: str) -> None:
    with pytest.raises(BenchbotError, match=title) as caught:
        floor_plan(two_rooms(wrong))
    assert why in caught.value.why


def test_openings_may_lie_above_but_not_in_each_other() -> None:
    above = replace(WINDOW, name="above", bottom_m=2.2, top_m=2.4)
    assert len(floor_plan(two_rooms(WINDOW, above)).passages) == 2
    with pytest.raises(BenchbotError, match="overlap"):
        floor_plan(two_rooms(WINDOW, replace(above, bottom_m=2.0)))


def test_a_door_must_not_lead_into_two_rooms_at_once() -> None:
    rooms = (room("hall", (0, 0), (6, 2)), room("a", (0, 2.1), (2.9, 5)), room("b", (3.0, 2.1), (6, 5)))
    building = Building(2.5, 0.1, rooms, (opening("passage", (3.0, 2.05)),))
    with pytest.raises(BenchbotError, match="is in no wall"):
        floor_plan(building)


def test_rooms_that_touch_are_open_to_each_other() -> None:
    rooms = (WEST, room("alcove", (4, 1), (5, 2)))
    plan = floor_plan(Building(2.5, 0.3, rooms, ()))
    east_side = next(edge for edge in edges(plan.rooms[0]) if edge.start[0] == edge.end[0] == 4)
    assert walled(east_side, plan.walls) == [(0.0, 1.0), (2.0, 3.0)]


def test_overlapping_rooms_are_refused() -> None:
    with pytest.raises(BenchbotError, match="'west' and 'east' overlap") as caught:
        floor_plan(Building(2.5, 0.3, (WEST, room("east", (3.5, 1), (6, 3))), ()))
    assert "1.00 m²" in caught.value.why
    assert "x 3.5 to 4, y 1 to 3" in caught.value.why


@pytest.mark.parametrize(
    ("outline", "why"),
    [
        (((0, 0), (2, 2), (2, 0), (0, 2)), "Self-intersection"),
        (((0, 0), (0.1, 0), (0.1, 0.05), (0, 0.05)), "0.005 m²"),
    ],
)
def test_an_outline_without_a_floor_is_refused(outline: tuple[tuple[float, float], ...], why: str) -> None:
    with pytest.raises(BenchbotError, match="is not a floor") as caught:
        floor_plan(Building(2.5, 0.3, (Room("knot", outline, WHITE, WHITE, WHITE),), ()))
    assert why in caught.value.why


@pytest.mark.parametrize(("rooms", "openings"), [((WEST, replace(EAST, name="west")), ()), ((WEST,), (WINDOW, WINDOW))])
def test_names_are_unique(rooms: tuple[Room, ...], openings: tuple[Opening, ...]) -> None:
    with pytest.raises(BenchbotError, match="named"):
        floor_plan(Building(2.5, 0.3, rooms, openings))


@pytest.mark.parametrize(("width", "is_open"), [(0.9, False), (5.0, True)])
def test_narrow_shafts_become_wall_and_courtyards_stay_open(width: float, is_open: bool) -> None:
    north, east = 2.1 + width, 2.0 + width
    rooms = (
        room("south", (0, 0), (east + 2, 2)),
        room("west", (0, 2.1), (2, north)),
        room("east", (east, 2.1), (east + 2, north)),
        room("north", (0, north + 0.1), (east + 2, north + 2)),
    )
    middle = Point(2 + width / 2, 2.1 + width / 2)
    assert floor_plan(Building(2.5, 0.2, rooms, ())).walls.contains(middle) is not is_open


@given(st.integers(0, 3), st.floats(0.6, 2.4), st.booleans())
def test_an_outline_may_start_anywhere_and_run_either_way(start: int, along: float, clockwise: bool) -> None:
    corners = [WEST.outline[(start + i) % 4] for i in range(4)]
    turned = replace(WEST, outline=tuple(corners[::-1] if clockwise else corners))
    building = Building(2.5, 0.3, (turned, EAST), (opening("door", (4.05, round(along, 3)), 0.9),))
    (passage,) = floor_plan(building).passages
    assert passage.middle == pytest.approx([4, round(along, 3)])
    assert np.allclose(passage.through, [1, 0])
