"""What hangs on walls: clear of openings and furniture, in rows, and in pairs at windows."""

from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchbot_scenes.catalogue import pack
from benchbot_scenes.generator.fixtures import curtains
from benchbot_scenes.generator.floor_plan import Space
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.generate import Generated, generate, touches
from benchbot_scenes.generator.plot import DOOR_ZONE_M, Item, Plot
from benchbot_scenes.generator.supply import Supply
from benchbot_scenes.generator.walls import ABOVE_M, BARE_M, CUPBOARD_BOTTOM_M, EYE_M, bare_stretches, dress
from benchbot_scenes.layout import Opening, Placement

DOOR = Opening("door", "door", (-0.05, 1.0), 1.0, 0.0, 2.05)
WINDOW = Opening("window", "window", (2.0, 5.1), 1.4, 0.9, 2.2)


def room(seed: int, doors: tuple[Opening, ...] = (), windows: tuple[Opening, ...] = ()) -> Furnisher:
    rng = np.random.default_rng(seed)
    plot = Plot(Space("room", "office", (0.0, 0.0), (4.0, 5.0)), 2.6, doors, windows, rng)
    return Furnisher(plot, Supply(pack("household"), rng))


def middle_m(item: Item) -> float:
    return (item.box.bottom_m + item.box.top_m) / 2


@pytest.mark.parametrize("seed", range(4))
def test_pictures_hang_at_the_height_of_eyes(seed: int) -> None:
    empty = room(seed)
    dress(empty, 8)
    assert {item.model.kind for item in empty.plot.items} == {"picture"}
    assert all(middle_m(item) == pytest.approx(EYE_M, abs=1e-3) for item in empty.plot.items)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_hangs_at_openings_or_behind_open_doors(seed: int) -> None:
    pierced = room(seed, (DOOR,), (WINDOW,))
    dress(pierced, 8)
    assert pierced.plot.items
    for item in pierced.plot.items:
        assert not item.box.overlaps(pierced.plot.zone(DOOR))
        assert not (item.box.high[1] > 4.9 and item.box.low[0] < 2.7 and item.box.high[0] > 1.3)


@pytest.mark.parametrize(("open_deg", "side"), [(100.0, -1), (-100.0, 1)])
def test_nothing_stands_in_the_leaf_of_an_open_door(open_deg: float, side: int) -> None:
    plot = room(0, (replace(DOOR, at=(-0.05, 2.5), open_deg=open_deg),)).plot
    (leaf,) = plot.leaves()
    edge = 2.5 + side * DOOR.width_m / 2
    assert sorted((leaf.low[1], leaf.high[1])) == pytest.approx(sorted((edge, edge + side * 0.2)))
    assert (leaf.low[0], leaf.high[0]) == (0.0, DOOR_ZONE_M)
    case = pack("household").model("bookcase_oak")
    assert not plot.fits(Item(Placement("case", case.id, (0.2, edge + side * 0.3, 0.0)), case, case.size_m))


@pytest.mark.parametrize(("open_deg", "hangs"), [(100.0, False), (-100.0, True)])
def test_nothing_hangs_in_the_leaf_of_an_open_door(open_deg: float, hangs: bool) -> None:
    pierced = room(0, (replace(DOOR, at=(-0.05, 2.5), open_deg=open_deg),))
    shelf = pack("household").model("shelf_wall_oak")
    along_m = 2.5 - DOOR.width_m / 2 - 0.07 - shelf.size_m[1] / 2
    assert (pierced.hung(shelf, "west", along_m, 1.4) is not None) == hangs


def test_nothing_is_put_into_a_curtain() -> None:
    sunny = room(0, (), (WINDOW,))
    curtains(sunny)
    model = pack("household").model("sideboard_oak")
    board = Item(Placement("board", model.id, (1.1, 4.7, 0.0), 270.0), model, model.size_m)
    vase = pack("household").model("vase_matt")
    at_back, in_front = (-0.13, 0.0), (0.1, 0.0)
    assert sunny.on_top(vase, board, at_back, 0.0) is None
    assert sunny.on_top(vase, board, in_front, 0.0) is not None


def test_what_is_tall_does_not_stand_in_a_lamp() -> None:
    lit = room(0)
    lamp = lit.hung_at_ceiling(pack("household").model("pendant_lamp_dome"), 2.0, 2.5)
    assert lamp is not None
    person, table = (pack("household").model(name) for name in ("person_man_standing", "table_dining_oak"))
    assert lit.standing(person, 2.0, 2.6, 0.0) is None
    assert lit.standing(table, 2.0, 2.6, 0.0) is not None


def test_pictures_hang_above_what_stands_before_them() -> None:
    furnished = room(0)
    chest = furnished.at_wall_exactly(pack("household").model("chest_of_drawers_walnut"), "west", 2.5, 0.0)
    assert chest is not None
    dress(furnished, 8)
    over = [item for item in furnished.plot.items if item.box.overlaps(replace(chest.box, top_m=2.6)) and item != chest]
    assert over
    assert all(item.box.bottom_m >= chest.box.top_m + ABOVE_M - 1e-3 for item in over)


@pytest.mark.parametrize("seed", range(4))
def test_a_dressed_room_has_no_long_bare_walls(seed: int) -> None:
    """Something hangs in the longest parts of all walls but for those that chance leaves out."""
    dressed = room(seed)
    before = [stretch.length_m for stretch in bare_stretches(dressed.plot)]
    dress(dressed, 8)
    after = [stretch.length_m for stretch in bare_stretches(dressed.plot)]
    assert max(after, default=0.0) <= max(before)
    assert sum(after) < 0.75 * sum(before)
    assert min(after, default=BARE_M) >= BARE_M


@cache
def place(kind: str, rooms: int, seed: int) -> Generated:
    return generate(seed, kind, rooms, pack("household"))


HOMES = [("apartment", 3, 9101), ("house", 4, 9102)]


@pytest.mark.parametrize("chosen", HOMES, ids=lambda chosen: chosen[0])
def test_curtains_hang_in_pairs(chosen: tuple[str, int, int]) -> None:
    made = place(*chosen)
    curtains = [item for item in made.items if item.model.kind == "curtain"]
    assert curtains
    pairs = 0
    for opening in made.plan.openings:
        if opening.kind != "window":
            continue
        x, y = opening.at
        at = [
            item
            for item in curtains
            if max(abs(item.placement.position[0] - x), abs(item.placement.position[1] - y)) < opening.width_m / 2 + 0.4
        ]
        assert len(at) in (0, 2)
        pairs += len(at) == 2
    assert 2 * pairs == len(curtains)


@pytest.mark.parametrize("chosen", HOMES, ids=lambda chosen: chosen[0])
def test_cupboards_hang_above_worktops_and_before_no_window(chosen: tuple[str, int, int]) -> None:
    made = place(*chosen)
    cupboards = [item for item in made.items if item.model.kind == "wall cupboard"]
    below = [item for item in made.items if item.model.kind == "kitchen counter" or item.model.class_name == "sink"]
    for cupboard in cupboards:
        x, y, _ = cupboard.placement.position
        assert cupboard.box.bottom_m == pytest.approx(CUPBOARD_BOTTOM_M)
        assert any(unit.box.low[0] < x < unit.box.high[0] and unit.box.low[1] < y < unit.box.high[1] for unit in below)
    assert len({cupboard.size_m for cupboard in cupboards}) <= 2


def test_a_place_at_a_table_is_laid_with_all_or_nothing() -> None:
    made = place(*HOMES[0])
    tables = {item.placement.id for item in made.items if item.model.class_name == "table"}
    for table in tables:
        on = Counter(item.model.kind for item in made.items if item.carrier == table)
        if on["plate"]:
            assert on["cup"] + on["wine glass"] >= on["plate"]


def test_desks_of_many_rooms_have_their_screens() -> None:
    made = place("office", 8, 9103)
    desks = {item.placement.id for item in made.items if item.model.kind == "desk"}
    left = Counter(item.model.class_name for item in made.items if item.carrier is not None)
    equipped = {item.carrier for item in made.items if item.model.class_name in ("tv", "laptop")}
    assert len(desks) > 10
    assert not (desks - equipped and left["cup"] + left["book"] + left["keyboard"])


@pytest.mark.parametrize("seed", range(9110, 9114))
def test_a_tv_stands_before_no_window(seed: int) -> None:
    made = place("apartment", 2, seed)
    living = next(space for space in made.plan.spaces if space.function == "living room")
    windows = [found for found in made.plan.openings if found.kind == "window" and touches(living, found)]
    stands = {item.placement.id: item for item in made.items if item.model.kind in ("sideboard", "shelf")}
    for tv in made.items:
        if tv.model.class_name == "tv" and tv.carrier in stands:
            x, y, _ = tv.placement.position
            assert all(max(abs(x - window.at[0]), abs(y - window.at[1])) > 0.7 for window in windows)


@pytest.mark.parametrize("model", ["chair_spindle", "dining_chair_4"])
def test_chairs_in_a_row_stand_apart_with_room_before_them(model: str) -> None:
    waiting = room(0, (DOOR,), (WINDOW,))
    chairs = waiting.row_at_wall(pack("household").model(model), 3, 0.1, 0.6)
    assert len(chairs) == 3
    assert not any(one.box.overlaps(other.box, 0.05) for one in chairs for other in chairs if one != other)
    stool = pack("household").model("table_side_beech")
    before = waiting.relative(stool, chairs[1], chairs[1].size_m[0] / 2 + 0.4, 0.0)
    assert before is None
