"""Buildings that are closed but for their openings."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes import building
from benchbot_scenes.floor_plan import floor_plan
from benchbot_scenes.layout import Building, Opening, Room
from benchbot_scenes.mesh import merge
from plugins.scenes.tests.plans import DOOR, EAST, WEST, WINDOW, opening, room, two_rooms

FRONT_DOOR = opening("door", (-0.1, 1.5))


def pieces(made: Building) -> Iterator[building.Piece]:
    return building.pieces(made, floor_plan(made))


def solid(made: Building, *names: str) -> trimesh.Trimesh:
    """The pieces of these names, or all, as one mesh."""
    meshes = [mesh for piece in pieces(made) if not names or piece.name in names for mesh, _ in piece.parts]
    whole = merge(meshes)
    return trimesh.Trimesh(whole.vertices, whole.triangles, process=False)


def rays(made: Building, count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    """Origins within the rooms, at least 10 cm from all walls, and directions all around."""
    random = np.random.default_rng(0)
    plan = floor_plan(made)
    free = shapely.union_all([polygon.buffer(-0.1) for polygon in plan.rooms])
    low, high = np.split(np.array(free.bounds), 2)
    points = random.uniform(low, high, (20 * count, 2))
    points = points[shapely.contains_xy(free, points[:, 0], points[:, 1])][:count]
    origins = np.column_stack([points, random.uniform(0.1, made.height_m - 0.1, len(points))])
    directions = random.standard_normal(origins.shape)
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def escaping(made: Building) -> tuple[np.ndarray, np.ndarray]:
    """Those of `rays` that meet nothing."""
    origins, directions = rays(made)
    hit = solid(made).ray.intersects_any(origins, directions)  # type: ignore[no-untyped-call]
    return origins[~hit], directions[~hit]


@pytest.mark.parametrize("openings", [(), (DOOR,), (FRONT_DOOR,), (opening("passage", (4.05, 1.0)),)])
def test_no_ray_leaves_a_building_without_windows(openings: tuple[Opening, ...]) -> None:
    assert not len(escaping(two_rooms(*openings))[0])


def test_rays_leave_through_windows_only() -> None:
    origins, directions = escaping(two_rooms(WINDOW, DOOR))
    assert len(origins) > 20
    reach = -origins[:, 1] / directions[:, 1]
    for depth in (0.0, 0.3 / np.abs(directions[:, 1])):
        points = origins + (reach + depth)[:, None] * directions
        assert (np.abs(points[:, 0] - 2.0) <= 0.6).all()
        assert ((points[:, 2] >= 0.8) & (points[:, 2] <= 2.1)).all()


def test_what_a_room_shows_faces_into_it() -> None:
    origins, directions = rays(two_rooms(DOOR, WINDOW))
    shell = solid(two_rooms(DOOR, WINDOW))
    _, ray, triangle = shell.ray.intersects_location(origins, directions, multiple_hits=False)
    assert len(ray) > 3900
    assert (np.einsum("ij,ij->i", shell.face_normals[triangle], directions[ray]) < 0).all()


@given(
    st.lists(st.tuples(st.integers(10, 40), st.integers(10, 40)), min_size=1, max_size=3), st.sampled_from([0, 1, 3])
)
@settings(max_examples=15)
def test_rooms_of_any_size_are_closed(sizes: list[tuple[int, int]], gap: int) -> None:
    """In a row, with walls between them, or touching and then open to each other."""
    rooms, x = [], 0.0
    for number, (width, depth) in enumerate(sizes):
        rooms.append(room(f"room {number}", (round(x, 1), 0), (round(x + width / 10, 1), depth / 10)))
        x += (width + gap) / 10
    assert not len(escaping(Building(2.4, 0.3, tuple(rooms), ()))[0])


def test_walls_have_the_area_that_openings_leave() -> None:
    walls = solid(two_rooms(DOOR, WINDOW), "walls west")
    assert walls.area == pytest.approx(14 * 2.5 - 0.9 * 2.0 - 1.2 * 1.3)


def test_between_rooms_that_touch_there_is_no_wall() -> None:
    alcove = Building(2.5, 0.3, (WEST, room("alcove", (4, 1), (5, 2))), ())
    assert solid(alcove, "walls west").area == pytest.approx((14 - 1) * 2.5)
    assert solid(alcove, "walls alcove").area == pytest.approx(3 * 2.5)
    assert not len(escaping(alcove)[0])


def test_floors_and_ceilings_are_those_of_the_rooms_and_thresholds_of_doors() -> None:
    made = two_rooms(DOOR)
    assert solid(made, "floor west").area == pytest.approx(12)
    assert solid(made, "ceiling west").bounds[:, 2] == pytest.approx([2.5, 2.5])
    reveal = solid(made, f"reveal {DOOR.name}")
    up = reveal.face_normals[:, 2] > 0.5
    assert reveal.area_faces[up].sum() == pytest.approx(0.9 * 0.1)


def test_boards_run_along_the_longer_side() -> None:
    long_in_y = replace(EAST, outline=((4.1, 0), (7, 0), (7, 9), (4.1, 9)))
    for shape, along in ((WEST, 0), (long_in_y, 1)):
        (floor,) = (piece for piece in pieces(Building(2.5, 0.3, (shape,), ())) if piece.name.startswith("floor"))
        mesh = floor.parts[0][0]
        assert np.ptp(mesh.uvs[:, 0]) == pytest.approx(np.ptp(mesh.vertices[:, along]))


def test_skirting_runs_around_but_not_across_doors() -> None:
    boards = solid(two_rooms(DOOR), "skirting west")
    up = boards.face_normals[:, 2] > 0.5
    ring = 4 * 3 - (4 - 0.028) * (3 - 0.028)
    assert boards.area_faces[up].sum() == pytest.approx(ring - 0.014 * (0.9 + 2 * 0.062), rel=1e-3)
    assert boards.bounds[1, 2] == pytest.approx(0.08)


def test_tiled_walls_have_no_skirting() -> None:
    tiled = replace(WEST, walls="wall_tiles_white")
    names = {piece.name for piece in pieces(Building(2.5, 0.3, (tiled, EAST), ()))}
    assert "skirting east" in names
    assert "skirting west" not in names


def test_casings_end_where_the_wall_does() -> None:
    near_corner = replace(DOOR, at=(4.05, 0.47))
    casing = solid(two_rooms(near_corner), f"trim {near_corner.name}")
    assert casing.bounds[0, 1] == pytest.approx(0.0)
    assert casing.bounds[1, 1] == pytest.approx(0.47 + 0.45 + 0.062)


def test_a_window_has_a_sill_and_a_passage_no_trim() -> None:
    passage = opening("passage", (4.05, 1.0))
    sill = solid(two_rooms(WINDOW), f"trim {WINDOW.name}")
    assert sill.is_volume or sill.process(validate=True).is_watertight
    assert sill.bounds[:, 2] == pytest.approx([0.8 - 0.011, 0.8 + 0.011])
    assert sill.bounds[1, 1] == pytest.approx(0.025)
    assert f"trim {passage.name}" not in {piece.name for piece in pieces(two_rooms(passage))}


def test_oblique_walls_are_closed_too() -> None:
    hexagon = Room("tower", ((0, 0), (2, -1), (4, 0), (4, 2), (2, 3), (0, 2)), "#ffffff", "#ffffff", "#ffffff")
    made = Building(2.5, 0.3, (hexagon,), (opening("window", (1.0, -0.6), 1.0, 0.8, 2.0),))
    origins, _ = escaping(made)
    assert 0 < len(origins) < 400
    assert not len(escaping(replace(made, openings=()))[0])
