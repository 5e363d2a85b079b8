"""Whether things stand, and where."""

from pathlib import Path

import pytest

from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.layout import Layout, Placement
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.soundness import floating, in_walls
from plugins.scenes.tests import packs
from plugins.scenes.tests.plans import DOOR, two_rooms

BUILDING = two_rooms(DOOR)
TABLE = Placement("table", "table", (2.0, 1.5, 0.0))


def scene(folder: Path, *objects: Placement) -> SceneGeometry:
    blocks = packs.pack(folder / "blocks")
    (folder / "scene.glb").write_bytes(compose(Layout("blocks", BUILDING, objects), {"blocks": blocks}))
    return load_scene(folder / "scene.glb")


@pytest.mark.parametrize(
    ("x", "z", "floats"),
    [
        (1.0, 0.0, False),
        (1.0, 0.015, False),
        (1.0, 0.1, True),
        (2.0, 0.7, False),
        (2.0, 0.67, False),
        (2.0, 0.8, True),
        (2.6, 0.7, False),  # half over the edge
        (2.7, 0.7, True),
    ],
)
def test_what_stands_on_the_floor_or_on_a_table_does_not_float(
    tmp_path: Path, x: float, z: float, floats: bool
) -> None:
    geometry = scene(tmp_path, TABLE, Placement("chair", "chair", (x, 1.5, z)))
    assert floating(geometry) == (["chair"] if floats else [])


def test_only_what_is_named_needs_to_stand(tmp_path: Path) -> None:
    geometry = scene(tmp_path, TABLE, Placement("chair", "chair", (3.0, 1.5, 1.0)))
    assert floating(geometry, ["table"]) == []
    assert floating(geometry, ["table", "chair"]) == ["chair"]


@pytest.mark.parametrize(
    ("x", "y", "stuck"),
    [
        (3.75, 2.5, False),
        (3.76, 2.5, False),
        (3.78, 2.5, True),
        (4.05, 1.0, False),
        (4.05, 2.5, True),
        (8.0, 1.0, True),
    ],
)
def test_what_stands_in_a_wall_is_found_but_not_in_a_doorway(tmp_path: Path, x: float, y: float, stuck: bool) -> None:
    geometry = scene(tmp_path, Placement("chair", "chair", (x, y, 0.0)))
    assert in_walls(geometry, BUILDING) == (["chair"] if stuck else [])
