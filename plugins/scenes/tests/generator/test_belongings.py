"""What people leave about, where it belongs."""

from functools import cache

import numpy as np
import pytest

from benchbot_scenes.catalogue import pack
from benchbot_scenes.generator.generate import Generated, generate
from benchbot_scenes.generator.plot import Item

HOMES, OFFICES = [("apartment", 4, 5004), ("house", 5, 5009)], [("office", 3, 5002), ("office", 4, 5006)]


@cache
def place(kind: str, rooms: int, seed: int) -> Generated:
    return generate(seed, kind, rooms, pack("household"))


def of_kind(made: Generated, kind: str) -> list[Item]:
    return [item for item in made.items if item.model.kind == kind]


def carrier(made: Generated, item: Item) -> Item:
    return next(other for other in made.items if other.placement.id == item.carrier)


@pytest.mark.parametrize("chosen", HOMES, ids=lambda chosen: chosen[0])
def test_shoes_stand_at_a_wall_of_the_hall(chosen: tuple[str, int, int]) -> None:
    made = place(*chosen)
    (hall,) = (space for space in made.plan.spaces if space.function == "hall")
    pairs = of_kind(made, "shoes")
    assert pairs
    for pair in pairs:
        box = pair.box
        off_m = [abs(box.low[i] - hall.low[i]) for i in (0, 1)] + [abs(box.high[i] - hall.high[i]) for i in (0, 1)]
        assert min(off_m) < 0.05


@pytest.mark.parametrize("chosen", HOMES, ids=lambda chosen: chosen[0])
def test_magnets_hold_on_the_front_of_a_refrigerator(chosen: tuple[str, int, int]) -> None:
    made = place(*chosen)
    hung = of_kind(made, "magnets")
    assert hung
    for magnets in hung:
        refrigerator = carrier(made, magnets)
        assert refrigerator.model.class_name == "refrigerator"
        assert magnets.placement.yaw_deg == refrigerator.placement.yaw_deg
        assert magnets.box.top_m < refrigerator.box.top_m
        ahead = np.subtract(magnets.placement.position, refrigerator.placement.position)[:2]
        turn = np.radians(refrigerator.placement.yaw_deg)
        front_m = ahead @ [np.cos(turn), np.sin(turn)]
        assert 0.35 * refrigerator.size_m[0] < front_m < 0.5 * refrigerator.size_m[0] + 0.02


@pytest.mark.parametrize("chosen", OFFICES, ids=lambda chosen: str(chosen[2]))
def test_cables_lead_from_the_floor_to_the_tops_of_desks_at_walls(chosen: tuple[str, int, int]) -> None:
    made = place(*chosen)
    led = of_kind(made, "desk cables")
    assert led
    for cables in led:
        desk = carrier(made, cables)
        assert desk.model.kind == "desk"
        assert cables.placement.position[2] == 0.0
        assert 0.0 < cables.box.top_m - desk.box.top_m < 0.02


def test_other_packs_have_nothing_to_leave_about() -> None:
    bare = pack("household")
    furniture = {name: model for name, model in bare.models.items() if model.class_name is not None}
    made = generate(5002, "office", 3, type(bare)("bare", furniture))
    assert {item.model.class_name for item in made.items} <= {model.class_name for model in furniture.values()}
