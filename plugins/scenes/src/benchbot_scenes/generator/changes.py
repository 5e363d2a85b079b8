"""The same place at another time: some objects gone, some elsewhere, some new; as differences to its layout."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchbot_scenes.catalogue import AssetModel, Catalogue
from benchbot_scenes.generator.furnish import Furnisher
from benchbot_scenes.generator.generate import Generated, touches
from benchbot_scenes.generator.plot import FLAT_M, Box, Item, Plot
from benchbot_scenes.generator.supply import Supply
from benchbot_scenes.layout import Layout, Move, Placement

# What comes and goes in a home or an office, in the order in which it is tried.
COMING = ("book", "cup", "bottle", "bowl", "laptop", "cell phone", "banana", "apple", "orange", "cake", "clock", "vase")
# Who sits stays with the seat, and people come as variants ask for them.
STAYS = ("sink", "toilet", "refrigerator", "oven", "bed", "couch", "table", "person")
TRIES = 40


def changed(
    place: Generated,
    base: Path,
    variant: int,
    catalogue: Catalogue,
    removed: int,
    moved: int,
    added: int,
    people: int = 0,
) -> Layout:
    """The differences of a variant to the layout in the file `base`; the same numbers always give the same.

    `removed`, `moved` and `added` say how many objects; less where there is no room for as many. `people` are added
    on the floor beside those.
    """
    rng = np.random.default_rng([variant, len(place.items)])
    supply = Supply(catalogue, rng, taken={item.model.id for item in place.items})
    rooms = [_plot(place, number, rng) for number in range(len(place.plan.spaces))]
    gone = _choose(_loose(place.items), removed, rng)
    for room in rooms:
        room.items = [item for item in room.items if item not in gone]
        room.taken = _standing(room.items)
    carriers = [(room, item) for room in rooms for item in room.items if item.model.surfaces and item.box.top_m < 1.4]
    elsewhere = _choose([item for item in _loose(place.items) if item not in gone and item.carrier], moved, rng)
    moves = [move for item in elsewhere if (move := _moved(item, carriers, supply))]
    new: list[Placement] = []
    for name in _kinds(catalogue, added, rng):
        item = _somewhere(supply.draw(name, placement="surface"), carriers, supply)
        if item is not None:
            new.append(_named(item, variant, len(new)))
    for _ in range(people):
        person = _standing_person(supply, rooms, rng)
        if person is not None:
            new.append(_named(person, variant, len(new)))
    names = tuple(sorted(item.placement.id for item in gone))
    return Layout(place.layout.assets, base=base, removed=names, moved=tuple(moves), objects=tuple(new))


def _plot(place: Generated, number: int, rng: np.random.Generator) -> Plot:
    space = place.plan.spaces[number]
    openings = [opening for opening in place.plan.openings if touches(space, opening)]
    building = place.layout.building
    plot = Plot(
        space,
        building.height_m if building else 2.6,
        tuple(opening for opening in openings if opening.bottom_m == 0.0),
        tuple(opening for opening in openings if opening.kind == "window"),
        rng,
    )
    plot.items = [
        item for item in place.items if all(space.low[i] <= item.placement.position[i] <= space.high[i] for i in (0, 1))
    ]
    plot.taken = _standing(plot.items)
    return plot


def _standing(items: Sequence[Item]) -> list[Box]:
    return [item.box for item in items if item.carrier is None and item.size_m[2] > FLAT_M]


def _loose(items: Sequence[Item]) -> list[Item]:
    """The objects that can be removed: those that carry nothing."""
    carrying = {item.carrier for item in items}
    return [
        item
        for item in items
        if item.model.class_name not in (None, *STAYS)
        and item.placement.id not in carrying
        and (item.carrier is not None or item.placement.position[2] == 0.0)
    ]


def _choose(items: list[Item], count: int, rng: np.random.Generator) -> list[Item]:
    """Some, of as many classes as possible."""
    order = [items[i] for i in rng.permutation(len(items))]
    seen: dict[str, int] = {}
    ranks = []
    for item in order:
        name = item.model.class_name or ""
        seen[name] = seen.get(name, 0) + 1
        ranks.append(seen[name])
    return [order[i] for i in np.argsort(ranks, kind="stable")[:count]]


def _kinds(catalogue: Catalogue, count: int, rng: np.random.Generator) -> list[str]:
    known = [name for name in COMING if catalogue.of_class(name) and name != "vase"]
    return [known[i] for i in rng.permutation(len(known))][:count]


def _somewhere(model: AssetModel | None, carriers: Sequence[tuple[Plot, Item]], supply: Supply) -> Item | None:
    for number in supply.rng.permutation(len(carriers)):
        room, carrier = carriers[number]
        item = Furnisher(room, supply).on_top(model, carrier, turn_deg=float(supply.rng.uniform(-40, 40)))
        if item is not None:
            return item
    return None


def _moved(item: Item, carriers: Sequence[tuple[Plot, Item]], supply: Supply) -> Move | None:
    others = [(room, carrier) for room, carrier in carriers if carrier.placement.id != item.carrier]
    placed = _somewhere(item.model, others, supply)
    if placed is None:
        return None
    turn = (placed.placement.yaw_deg - item.placement.yaw_deg) % 360.0
    return Move(item.placement.id, placed.placement.position, round(turn, 1))


def _standing_person(supply: Supply, rooms: Sequence[Plot], rng: np.random.Generator) -> Item | None:
    people = [model for model in supply.catalogue.of_class("person") if max(model.size_m[:2]) < 0.7]
    if not people:
        return None
    model = supply.varied(people[int(rng.integers(len(people)))])
    for _ in range(TRIES):
        room = rooms[int(rng.integers(len(rooms)))]
        x, y = (float(rng.uniform(room.space.low[i] + 0.4, room.space.high[i] - 0.4)) for i in (0, 1))
        item = Furnisher(room, supply).standing(model, x, y, float(rng.uniform(0, 360)))
        if item is not None:
            return item
    return None


def _named(item: Item, variant: int, number: int) -> Placement:
    """Under a name that no other variant has."""
    stem = (item.model.class_name or item.model.kind).replace(" ", "_")
    return replace(item.placement, id=f"{stem}_{variant}{number + 1:02d}")
