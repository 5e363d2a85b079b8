"""People in generated places: seated on what is made for it, or standing out of the way."""

from functools import cache

import numpy as np
import pytest

from benchbot_scenes.catalogue import pack
from benchbot_scenes.generator.floor_plan import Space
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.generate import generate
from benchbot_scenes.generator.people import MOST_PEOPLE, put_in
from benchbot_scenes.generator.plot import Item, Plot
from benchbot_scenes.generator.supply import Supply
from benchbot_scenes.intersections import intersecting, triangles_of
from benchbot_scenes.layout import Opening


def room(function: str, seed: int) -> Furnisher:
    """An empty room of 5 m by 5 m with a door."""
    space = Space(function, function, (-2.5, -2.5), (2.5, 2.5))
    door = Opening("door", "door", (0.0, -2.52), 1.0, 0.0, 2.05)
    plot = Plot(space, 2.6, (door,), (), np.random.default_rng(seed))
    return Furnisher(plot, Supply(pack("household"), plot.rng))


def people(furnished: Furnisher) -> list[Item]:
    return [item for item in furnished.plot.items if item.model.class_name == "person"]


@cache
def seated(model_id: str) -> tuple[Item, Item]:
    """A seat and the first who sits on it, of some seeds."""
    for seed in range(40):
        furnished = room("living room", seed)
        seat = furnished.against_wall(pack("household").model(model_id), ["north"], middle=True)
        put_in([furnished])
        if seat is not None and people(furnished) and people(furnished)[0].carrier == seat.placement.id:
            return seat, people(furnished)[0]
    raise AssertionError(f"nobody sits on {model_id}")


@pytest.mark.parametrize("model_id", ["armchair_blue", "couch_green", "couch_grey", "sofa_2"])
def test_who_sits_rests_on_the_seat_and_on_the_floor_and_reaches_into_nothing(model_id: str) -> None:
    seat, person = seated(model_id)
    assert person.placement.yaw_deg == seat.placement.yaw_deg
    assert person.placement.position[2] == 0.0
    body, below = triangles_of(person.placement, person.model), triangles_of(seat.placement, seat.model)
    assert not intersecting({"person": body, "seat": below})
    # A little lower they would meet.
    assert intersecting({"person": body - [0.0, 0.0, 0.03], "seat": below})


def test_in_some_rooms_somebody_stands_and_leaves_the_way_to_the_door() -> None:
    counts = []
    for seed in range(12):
        furnished = room("open office", seed)
        put_in([furnished])
        counts.append(len(people(furnished)))
        assert furnished.plot.leaves_ways()
        for person in people(furnished):
            assert not any(person.box.overlaps(zone) for zone in furnished.plot.kept)
    assert set(counts) == {0, 1}


def test_a_place_is_not_crowded() -> None:
    rooms = [room("lobby", seed) for seed in range(12)]
    put_in(rooms)
    assert sum(len(people(furnished)) for furnished in rooms) == MOST_PEOPLE


def test_a_pack_without_people_has_empty_rooms() -> None:
    whole = pack("household")
    lifeless = {name: model for name, model in whole.models.items() if model.class_name != "person"}
    made = generate(5, "office", 2, type(whole)("lifeless", lifeless))
    assert all(item.model.class_name != "person" for item in made.items)
