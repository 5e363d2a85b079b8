"""Meshes sorted into objects."""

import pytest

from benchbot_scenes.importing.objects import Found, recognise
from benchbot_scenes.scene import Instance

Path = tuple[str, ...]


def _objects(*paths: Path, said: dict[str, str | None] | None = None) -> list[tuple[str, str | None, int]]:
    instances = [Instance(number + 1, path[-1], None) for number, path in enumerate(paths)]
    found = recognise(paths, instances, said or {}, None)
    return [(thing.name, thing.class_name, len(thing.instances)) for thing in found.objects]


def test_parts_that_hang_on_a_chair_are_one_chair() -> None:
    assert _objects(("Room", "Chair_1", "leg"), ("Room", "Chair_1", "Mesh.002")) == [("Chair_1", "chair", 2)]


def test_what_stands_on_a_table_is_not_the_table() -> None:
    assert _objects(("Table", "top"), ("Table", "Mug")) == [("Table", "table", 1), ("Mug", "cup", 1)]


def test_a_collection_is_not_one_thing() -> None:
    assert _objects(("Chairs", "Chair.001"), ("Chairs", "Chair.002")) == [
        ("Chair.001", "chair", 1),
        ("Chair.002", "chair", 1),
    ]


def test_pieces_by_material_are_one_thing() -> None:
    assert _objects(("Sofa", "Sofa_fabric"), ("Sofa", "Sofa_wood")) == [("Sofa", "couch", 2)]


def test_equal_names_are_told_apart() -> None:
    assert _objects(("a", "Chair"), ("b", "Chair")) == [("Chair", "chair", 1), ("Chair 2", "chair", 1)]


def test_a_person_knows_better() -> None:
    said = {"Thing": "laptop", "Chair": None}
    assert _objects(("Thing", "x"), ("Chair",), said=said) == [("Thing", "laptop", 1), ("Chair", None, 1)]


def test_colliders_are_left_out_and_named() -> None:
    paths = [("Table",), ("UCX_Table",)]
    found = recognise(paths, [Instance(1, "Table", None), Instance(2, "UCX_Table", None)], {}, None)
    assert found.colliders == ("UCX_Table",)
    assert found.objects == (Found("Table", "table", False, (1,), ("Table",)),)


@pytest.mark.parametrize(("hidden", "left"), [((), 2), (("Table",), 1)])
def test_a_person_says_what_is_hidden(hidden: tuple[str, ...], left: int) -> None:
    paths = [("Table",), ("UCX_Table",)]
    found = recognise(paths, [Instance(1, "Table", None), Instance(2, "UCX_Table", None)], {}, hidden)
    assert len(found.objects) == left


def test_classes_of_a_finished_scene_stay() -> None:
    found = recognise([("node 7",)], [Instance(1, "ball_7", "apple", is_group=True)], {}, None)
    assert found.objects == (Found("ball_7", "apple", True, (1,), ("node 7", "ball_7")),)
