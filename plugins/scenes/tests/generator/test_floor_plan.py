"""Plans of any size: rooms apart, doors in walls."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot_scenes import floor_plan as walls
from benchbot_scenes.generator.floor_plan import OUTER_WALL_M, floor_plan
from benchbot_scenes.generator.kinds import FUNCTIONS, KINDS, find_kind
from benchbot_scenes.layout import Building, Room

ANY_PLAN = given(st.sampled_from(sorted(KINDS)), st.integers(1, 12), st.integers(0, 10_000))


@settings(max_examples=40, deadline=None)
@ANY_PLAN
def test_a_plan_can_be_built_and_every_room_be_entered(kind: str, rooms: int, seed: int) -> None:
    plan = floor_plan(KINDS[kind], rooms, np.random.default_rng(seed))
    outlines = [(s.low, (s.high[0], s.low[1]), s.high, (s.low[0], s.high[1])) for s in plan.spaces]
    named = zip(plan.spaces, outlines, strict=True)
    building = Building(
        KINDS[kind].height_m,
        OUTER_WALL_M,
        tuple(Room(space.name, outline, "oak", "#ffffff", "#ffffff") for space, outline in named),
        plan.openings,
    )
    passages = walls.floor_plan(building).passages
    entered = {0}
    for _ in plan.spaces:
        for passage in passages:
            if passage.opening.kind != "window" and passage.far is not None and {passage.near, passage.far} & entered:
                entered |= {passage.near, passage.far}
    assert entered == set(range(len(plan.spaces)))
    assert all(passage.far is None for passage in passages if passage.opening.kind == "window")


@settings(max_examples=40, deadline=None)
@ANY_PLAN
def test_rooms_are_as_many_as_asked_for_and_the_hall_is_extra(kind: str, rooms: int, seed: int) -> None:
    plan = floor_plan(KINDS[kind], rooms, np.random.default_rng(seed))
    assert [space.function for space in plan.spaces if space.function != "hall"].count(KINDS[kind].hub) == 1
    assert len([space for space in plan.spaces if space.function != "hall"]) == rooms
    assert all(min(s.high[0] - s.low[0], s.high[1] - s.low[1]) >= 1.45 for s in plan.spaces)


@settings(max_examples=20, deadline=None)
@ANY_PLAN
def test_doors_open_into_the_room_that_they_belong_to(kind: str, rooms: int, seed: int) -> None:
    plan = floor_plan(KINDS[kind], rooms, np.random.default_rng(seed))
    spaces = {space.name: space for space in plan.spaces}
    for door in plan.openings:
        if door.open_deg:
            room = spaces[door.name.removesuffix(" door")]
            outside_m = max(max(room.low[i] - door.at[i], door.at[i] - room.high[i]) for i in (0, 1))
            assert outside_m == pytest.approx(0.02)


def test_all_functions_of_all_kinds_are_known() -> None:
    named = {name for kind in KINDS.values() for name in (kind.hub, *kind.others, *kind.more)}
    assert named <= set(FUNCTIONS)


def test_an_unknown_kind_is_refused_with_a_proposal() -> None:
    with pytest.raises(BenchbotError, match="no kind of place 'ofice'") as raised:
        find_kind("ofice")
    assert "office" in raised.value.why
