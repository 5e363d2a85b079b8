"""Furniture as people have it: shelves that are used, chairs for tables, plants that differ, tvs that suit."""

from collections import Counter
from functools import cache

import numpy as np
import pytest

from benchbot_scenes.catalogue import pack
from benchbot_scenes.generator import clutter, fixtures
from benchbot_scenes.generator.floor_plan import Space
from benchbot_scenes.generator.furnish import SEAT_PITCH_M, Furnisher
from benchbot_scenes.generator.generate import FEWEST_ON, Generated, generate
from benchbot_scenes.generator.plot import Plot
from benchbot_scenes.generator.supply import Supply

PLACES = [("office", 6, 9201), ("company", 7, 9202), ("house", 3, 9203), ("apartment", 1, 9204)]


@cache
def place(kind: str, rooms: int, seed: int) -> Generated:
    return generate(seed, kind, rooms, pack("household"))


@pytest.fixture(params=PLACES, ids=lambda chosen: f"{chosen[0]}-{chosen[1]}")
def made(request: pytest.FixtureRequest) -> Generated:
    return place(*request.param)


def room(seed: int) -> Furnisher:
    rng = np.random.default_rng(seed)
    plot = Plot(Space("room", "living", (0.0, 0.0), (5.0, 6.0)), 2.6, (), (), rng)
    return Furnisher(plot, Supply(pack("household"), rng))


def test_bookcases_shelves_and_stands_carry_something(made: Generated) -> None:
    on = Counter(item.carrier for item in made.items)
    carriers = [item for item in made.items if item.model.kind in FEWEST_ON]
    assert carriers
    assert all(on[item.placement.id] >= FEWEST_ON[item.model.kind] for item in carriers)


@pytest.mark.parametrize("chosen", PLACES[:2], ids=lambda chosen: chosen[0])
def test_bookcases_of_many_rooms_are_filled(chosen: tuple[str, int, int]) -> None:
    items = place(*chosen).items
    on = Counter(item.carrier for item in items)
    assert np.mean([on[item.placement.id] for item in items if item.model.kind == "bookcase"]) >= 5


def test_chairs_about_tables_leave_each_other_room(made: Generated) -> None:
    tables = [item for item in made.items if item.model.kind == "table"]
    for chair in made.items:
        if chair.model.class_name == "chair" and any(chair.box.overlaps(table.box) for table in tables):
            assert chair.model.kind == "chair"
            assert pack("household").model(chair.model.base_id).size_m[1] <= SEAT_PITCH_M


@pytest.mark.parametrize("seed", range(12))
def test_plants_of_a_room_are_not_alike(seed: int) -> None:
    planted = room(seed)
    fixtures.plants(planted, 4)
    models = [item.model.base_id for item in planted.plot.items if item.model.class_name == "potted plant"]
    assert len(set(models)) == len(models)


def test_a_room_has_plants_or_none_or_one_on_a_stand() -> None:
    rooms = [room(seed) for seed in range(40)]
    for planted in rooms:
        fixtures.plants(planted, 3)
    counts = {len([item for item in found.plot.items if item.carrier is None]) for found in rooms}
    assert counts == {0, 1, 2, 3}
    assert any(item.model.kind == "plant stand" for found in rooms for item in found.plot.items)


@pytest.mark.parametrize("board", ["sideboard_oak", "sideboard_walnut"])
@pytest.mark.parametrize("seed", range(6))
def test_a_tv_suits_the_width_of_its_board(board: str, seed: int) -> None:
    furnished = room(seed)
    stand = furnished.against_wall(pack("household").model(board))
    assert stand is not None
    clutter.tv(furnished, stand)
    (tv,) = (item for item in furnished.plot.items if item.carrier == stand.placement.id)
    assert 0.45 * stand.size_m[1] <= tv.size_m[1] <= stand.size_m[1]
