"""Places from seeds: always the same, never stuck, nothing in anything else."""

import hashlib
import math
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.catalogue import pack as household
from benchbot_scenes.coverage import least_room
from benchbot_scenes.differences import furnished
from benchbot_scenes.free_space import free_space
from benchbot_scenes.generator.changes import changed
from benchbot_scenes.generator.furniture import PROGRAMMES
from benchbot_scenes.generator.generate import Generated, generate
from benchbot_scenes.generator.kinds import FUNCTIONS, KINDS
from benchbot_scenes.generator.plot import FLAT_M, Box, Item
from benchbot_scenes.generator.proxy import proxy
from benchbot_scenes.layout import read_layout, write_layout
from benchbot_scenes.variations import FRONTS
from benchbot_scenes.visibility import CARTER, bearings_rad, seen_from, targets, voxels
from plugins.scenes.tests.generator.furniture import pack

SETS = {
    *(
        "chair",
        "table",
        "fork",
        "knife",
        "spoon",
        "cup",
        "wine glass",
        "plate",
        "bedside table",
        "table lamp",
        "curtain",
    ),
    *("pendant lamp", "ceiling lamp", "kitchen counter", "wall cupboard", "office cabinet", "radiator"),
}
"""What comes in sets: about a table, a bed or a window, or everywhere in a place."""

PLACES = [("apartment", 4, 7), ("office", 5, 3), ("apartment", 1, 0)]


@cache
def place(kind: str, rooms: int, seed: int) -> Generated:
    return generate(seed, kind, rooms, pack())


@pytest.fixture(params=PLACES, ids=lambda chosen: f"{chosen[0]}-{chosen[1]}")
def made(request: pytest.FixtureRequest) -> Generated:
    return place(*request.param)


def on_floor(items: tuple[Item, ...]) -> Iterator[Item]:
    return (item for item in items if item.carrier is None and item.size_m[2] > FLAT_M)


def test_a_seed_gives_the_same_place_again() -> None:
    kind, rooms, seed = PLACES[0]
    assert generate(seed, kind, rooms, pack()) == place(kind, rooms, seed)


def test_without_a_secret_a_place_is_what_it_was() -> None:
    """Published places and the results in them are made again from their seeds."""
    layout = repr(
        [(found.id, found.model, found.position, found.yaw_deg) for found in place(*PLACES[0]).layout.objects]
    )
    assert (
        hashlib.sha256(layout.encode()).hexdigest()
        == "855c91bb3c059460b114a312e6f73ff91ddd24dd9d1815a36ddba360411960d3"
    )


@pytest.mark.parametrize("seed", range(8))
def test_from_the_couch_one_sees_the_tv(seed: int) -> None:
    items = place("house", 2, seed).items
    couch = next((item for item in items if item.model.kind == "couch"), None)
    tv = next(item for item in items if item.model.kind == "tv")
    (stand,) = (item for item in items if item.placement.id == tv.carrier)
    if couch is None:
        return
    low, high = ([choose(couch.box, stand.box, axis) for axis in (0, 1)] for choose in (lowest, highest))
    between = [
        item.model.kind
        for item in on_floor(items)
        if item not in (couch, stand) and item.box.overlaps(Box((low[0], low[1]), (high[0], high[1])))
    ]
    assert set(between) <= {"coffee table", "picture", "radiator", "curtain", "pendant lamp"}


def lowest(one: Box, other: Box, axis: int) -> float:
    return min(one.low[axis], other.low[axis])


def highest(one: Box, other: Box, axis: int) -> float:
    return max(one.high[axis], other.high[axis])


def test_with_a_secret_the_order_of_objects_is_not_that_of_rooms() -> None:
    made = generate(7, "apartment", 4, pack(), secret="ab" * 32)
    placed = [item.placement.id for item in made.items]
    listed = [found.id for found in made.layout.objects]
    assert sorted(listed) == sorted(placed)
    assert listed != placed
    assert made.layout == generate(7, "apartment", 4, pack(), secret="ab" * 32).layout


def test_another_seed_or_secret_gives_another_place() -> None:
    chosen = [(seed, secret) for seed in (7, 8, 2**256) for secret in ("", "ab" * 32, "ba" * 32)]
    ways = {generate(seed, "apartment", 1, pack(), secret=secret).trajectory_poses for seed, secret in chosen}
    assert len(ways) == len(chosen)


@cache
def furnished_place(kind: str, rooms: int, seed: int) -> Generated:
    return generate(seed, kind, rooms, household("household"))


VARIED = [("apartment", 3, 9001), ("house", 4, 9002), ("office", 3, 9003)]


@pytest.mark.parametrize("chosen", VARIED, ids=lambda chosen: chosen[0])
def test_only_what_belongs_together_is_alike(chosen: tuple[str, int, int]) -> None:
    items = furnished_place(*chosen).items
    counts = Counter(item.model.id for item in items)
    alike = {item.model.class_name or item.model.kind for item in items if counts[item.model.id] > 1}
    assert alike <= SETS
    assert len(counts) > 0.6 * len(items)


@pytest.mark.parametrize("chosen", VARIED, ids=lambda chosen: chosen[0])
def test_chairs_of_a_table_are_alike(chosen: tuple[str, int, int]) -> None:
    """At a desk there is one, at a table there are several: never of two models."""
    items = furnished_place(*chosen).items
    for table in items:
        if table.model.kind in ("table", "desk"):
            about = [item for item in items if item.model.class_name == "chair" and item.box.overlaps(table.box)]
            assert len({chair.model.id for chair in about}) <= 1


def test_units_of_a_kitchen_have_the_same_fronts() -> None:
    units = [
        item.model for item in furnished_place(*VARIED[0]).items if item.model.varies and item.model.varies.is_fitted
    ]
    assert len(units) >= 3
    fronts = {
        finish
        for unit in units
        for palette, finish in zip(unit.varies.palettes if unit.varies else (), unit.finish, strict=True)
        if palette is not None and palette.name == FRONTS
    }
    assert len(fronts) == 1


def test_another_time_brings_what_is_not_there_yet(tmp_path: Path) -> None:
    before = furnished_place(*VARIED[0])
    path = tmp_path / "place_1.yaml"
    write_layout(path, before.layout)
    layout = changed(before, path, 2, household("household"), removed=2, moved=2, added=6, people=1)
    models = {placement.model for placement in layout.objects}
    assert len(models) == len(layout.objects)
    assert not models & {item.model.id for item in before.items}


def test_the_way_is_clear_and_every_object_is_seen(made: Generated) -> None:
    building = made.layout.building
    assert building is not None
    scene = proxy(made.plan.spaces, made.plan.openings, made.items, building.height_m)
    space = free_space(scene, CARTER.z_min_m, CARTER.z_max_m)
    assert least_room(space, made.trajectory_poses) >= CARTER.radius_m
    things = targets(scene)
    eyes = np.array([(pose[4], pose[5], CARTER.eye_m) for pose in made.trajectory_poses])
    seen = seen_from(eyes, things, voxels(scene), CARTER.range_m, CARTER.half_height_deg)
    off = bearings_rad(eyes, things) - np.array([[2 * math.atan2(p[3], p[0])] for p in made.trajectory_poses])
    ahead = np.abs((off + np.pi) % (2 * np.pi) - np.pi) < math.radians(CARTER.half_width_deg)
    assert (seen & ahead).any(0).all()


def test_furniture_stands_apart_in_its_room(made: Generated) -> None:
    spaces = made.plan.spaces
    standing = list(on_floor(made.items))
    for number, item in enumerate(standing):
        box = item.box
        assert any(
            all(box.low[i] >= room.low[i] - 1e-3 and box.high[i] <= room.high[i] + 1e-3 for i in (0, 1))
            for room in spaces
        ), item.placement.id
        for other in standing[:number]:
            tucked = {item.model.class_name, other.model.class_name} == {"chair", "table"}
            assert tucked or not box.overlaps(other.box, -0.011), (item.placement.id, other.placement.id)


def test_small_things_stand_on_their_carriers(made: Generated) -> None:
    items = {item.placement.id: item for item in made.items}
    for item in made.items:
        if item.carrier is not None:
            carrier = items[item.carrier].box
            x, y, z = item.placement.position
            assert carrier.low[0] <= x <= carrier.high[0]
            assert carrier.low[1] <= y <= carrier.high[1]
            assert z <= carrier.top_m + 1e-6


def test_what_is_for_the_floor_stands_on_it_and_what_is_for_walls_hangs() -> None:
    for rooms, seed in ((5, 3), (3, 1), (4, 9)):
        items = place("office", rooms, seed).items
        assert any(item.model.kind == "whiteboard" for item in items)
        for item in items:
            if item.model.placement in ("floor", "wall"):
                assert (item.placement.position[2] == 0.0) == (item.model.placement == "floor"), item.placement.id


def test_names_are_unique_and_a_file_keeps_the_layout(made: Generated, tmp_path: Path) -> None:
    names = [item.placement.id for item in made.items]
    assert len(set(names)) == len(names)
    write_layout(tmp_path / "place.yaml", made.layout)
    again = read_layout(tmp_path / "place.yaml")
    assert [found.id for found in again.objects] == names


def test_objects_are_not_few_and_the_more_the_more_rooms() -> None:
    counts = [
        sum(item.model.class_name is not None for item in place(kind, rooms, seed).items)
        for kind, rooms, seed in (PLACES[0], PLACES[1], ("office", 8, 3))
    ]
    assert 25 <= counts[0] < counts[1] < counts[2]


def test_every_function_has_its_furniture() -> None:
    assert {function.furniture for function in FUNCTIONS.values()} == set(PROGRAMMES)


def test_a_pack_without_models_makes_bare_rooms() -> None:
    bare = pack()
    made = generate(1, "apartment", 3, type(bare)("empty", {}))
    assert made.layout.objects == ()
    assert len(made.trajectory_poses) >= 1


@pytest.mark.parametrize(("rooms", "seed"), [(0, 1), (13, 1), (3, -1)])
def test_what_cannot_be_is_refused(rooms: int, seed: int) -> None:
    with pytest.raises(BenchbotError):
        generate(seed, next(iter(KINDS)), rooms, pack())


def test_a_variant_is_the_base_with_some_objects_gone_moved_and_new(tmp_path: Path) -> None:
    base = place(*PLACES[0])
    file = tmp_path / "base.yaml"
    write_layout(file, base.layout)
    variant = changed(base, file, 4, pack(), removed=4, moved=2, added=3, people=1)
    assert variant == changed(base, file, 4, pack(), removed=4, moved=2, added=3, people=1)
    assert len(variant.removed) == 4
    assert len(variant.moved) == 2
    assert len(variant.objects) == 4
    scene = {placement.id: placement for _, placement in furnished(variant).objects}
    names = {placement.id for placement in base.layout.objects}
    assert set(scene) == names - set(variant.removed) | {placement.id for placement in variant.objects}
    for move in variant.moved:
        assert scene[move.id].position == pytest.approx(move.position)
