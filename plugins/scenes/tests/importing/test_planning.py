"""Starts and trajectories in places of any size."""

import math

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.importing import light
from benchbot_scenes.importing.model import Part, assemble
from benchbot_scenes.importing.planning import find_room, in_pieces, plan
from benchbot_scenes.scene import Instance, Material, SceneGeometry
from benchbot_scenes.visibility import CARTER
from plugins.scenes.tests.importing.places import Box


def _scene(*boxes: Box, classes: dict[str, str] | None = None) -> SceneGeometry:
    parts = [Part((box.name,), box.mesh.vertices, box.mesh.faces, 0) for box in boxes]
    geometry = assemble(parts, [Material()], []).geometry
    known = classes or {}
    instances = tuple(Instance(found.index, found.name, known.get(found.name)) for found in geometry.instances)
    return SceneGeometry(**{**vars(geometry), "instances": instances})


def _floor(length_m: float, width_m: float = 4.0) -> Box:
    return Box("floor", (0, 0, -0.1), (length_m, width_m, 0))


def test_the_start_is_in_the_larger_of_two_rooms_and_faces_the_long_way() -> None:
    wall = Box("wall", (3.0, 0, 0), (3.1, 4.0, 2.5))
    room = find_room(_scene(_floor(10.0), wall), CARTER, None)
    x, y, heading = room.start
    assert 3.5 < x < 9.5
    assert 1.0 < y < 3.0
    assert abs(math.cos(heading)) > 0.8
    assert room.area_m2 == pytest.approx(6.2 * 3.3, rel=0.15)


def test_objects_out_of_reach_are_named_not_forgotten() -> None:
    near, far = Box("near", (5, 2, 0), (5.4, 2.4, 0.9)), Box("far", (88, 2, 0), (88.4, 2.4, 0.9))
    scene = _scene(_floor(90.0), near, far, classes={"near": "chair", "far": "chair"})
    coverage = plan(scene, (3.0, 2.0, 0.0), CARTER)
    assert coverage.unseen == ("far",)
    assert coverage.poses


def test_a_place_that_is_far_too_large_is_refused() -> None:
    with pytest.raises(BenchbotError) as caught:
        find_room(_scene(_floor(400.0)), CARTER, None)
    assert "too large" in caught.value.title


def test_pieces_keep_every_triangle() -> None:
    scene = _scene(_floor(6.0), Box("wall", (0, 0, 0), (6.0, 0.1, 2.5)))
    pieces = in_pieces(scene)
    assert (pieces.triangles == scene.triangles).all()
    assert set(np.unique(pieces.triangle_instance)) == {found.index for found in pieces.instances}


def test_a_roof_covers_what_is_below_it() -> None:
    scene = _scene(_floor(8.0), Box("roof", (0, 0, 2.5), (4.0, 4.0, 2.6)))
    room = find_room(scene, CARTER, None)
    assert light.roofed_share(scene, room.space, room.reached) == pytest.approx(0.5, abs=0.1)
    assert not light.is_dark(scene, (2.0, 2.0))


def test_light_comes_through_glass_and_from_lamps() -> None:
    sides = [
        Box("west", (0, 0, 0), (0.1, 4, 2.5)),
        Box("north", (0, 3.9, 0), (4, 4, 2.5)),
        Box("south", (0, 0, 0), (4, 0.1, 2.5)),
        Box("ceiling", (0, 0, 2.5), (4, 4, 2.6)),
    ]
    closed = _scene(_floor(4.0), *sides, Box("east", (3.9, 0, 0), (4, 4, 2.5)))
    assert light.is_dark(closed, (2.0, 2.0))
    east = np.array([found.name == "east" for found in closed.instances])[closed.triangle_instance - 1]
    for other in (Material("glass", transmission=1.0), Material("lamp", emission=(1.0, 1.0, 1.0))):
        lit = {**vars(closed), "materials": (*closed.materials, other), "triangle_material": east.astype(np.int32)}
        assert not light.is_dark(SceneGeometry(**lit), (2.0, 2.0))


def test_the_start_is_under_a_ceiling_and_not_in_the_larger_garden() -> None:
    fence = Box("fence", (5.0, 0, 0), (5.1, 12.0, 2.0))
    roof = Box("roof", (0, 0, 2.5), (5.0, 12.0, 2.6))
    room = find_room(_scene(_floor(40.0, 12.0), fence, roof), CARTER, None)
    assert room.start[0] < 5.0
    assert room.area_m2 < 60

    # Open to the garden, all of it is to be reached, but the start stays in.
    gate = Box("fence", (5.0, 0, 0), (5.1, 4.0, 2.0)), Box("fence 2", (5.0, 6.0, 0), (5.1, 12.0, 2.0))
    room = find_room(_scene(_floor(40.0, 12.0), *gate, roof), CARTER, None)
    assert room.start[0] < 5.0
    assert room.area_m2 > 300
