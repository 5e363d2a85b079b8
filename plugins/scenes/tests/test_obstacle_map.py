"""Distances to what a footprint can bump into are exact, and motion stops at contact."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchbot.plugins.simulation.contact import Clearance, travel
from benchbot.plugins.simulation.dynamics import DriveLimits, State, drive
from benchbot_scenes import obstacle_map
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.slab import project_slab
from plugins.sim_taichi.tests.glb import box, sphere

LIMITS = DriveLimits((-0.6, 1.5), 1.0, math.inf, math.inf)
RADIUS_M = 0.3


def scene(*shapes: Any) -> SceneGeometry:
    """A scene of meshes (vertices, triangles, …)."""
    vertices, triangles = [np.zeros((0, 3))], [np.zeros((0, 3), np.int32)]
    for mesh in shapes:
        triangles.append(np.asarray(mesh[1]) + sum(map(len, vertices)))
        vertices.append(np.asarray(mesh[0]))
    points, faces = np.concatenate(vertices).astype(np.float32), np.concatenate(triangles).astype(np.int32)
    nothing = np.zeros(len(faces), np.int32)
    return SceneGeometry(points, faces, nothing, nothing, points, points[:, :2], (), ())


def obstacles(*shapes: Any, z_min_m: float = 0.03, z_max_m: float = 1.1) -> ObstacleMap:
    return ObstacleMap(scene(*shapes), z_min_m, z_max_m)


coordinates = st.floats(-3.0, 3.0)


def to_box_m(x: float, y: float) -> float:
    """The distance to the outline of the box from (-1, -0.5) to (1, 0.5)."""
    outside_m = math.hypot(max(abs(x) - 1, 0.0), max(abs(y) - 0.5, 0.0))
    return outside_m or min(1 - abs(x), 0.5 - abs(y))


@given(coordinates, coordinates)
def test_distance_to_a_box_is_exact(x: float, y: float) -> None:
    found = obstacles(box((-1, -0.5, 0), (1, 0.5, 2)))
    assert found.distance_m(x, y) == pytest.approx(to_box_m(x, y), abs=1e-6)


@given(coordinates, coordinates)
def test_a_box_covers_the_floor_below_its_top(x: float, y: float) -> None:
    assume(to_box_m(x, y) > 1e-6)
    found = obstacles(box((-1, -0.5, 0), (1, 0.5, 0.7)))
    assert found.covers(x, y) == (abs(x) < 1 and abs(y) < 0.5)


def test_a_ball_is_as_wide_as_its_widest_slice_in_reach() -> None:
    vertices, triangles, _ = sphere(64)
    vertices = vertices + np.array([0.0, 0.0, 1.6])
    # Only the cap from 0.6 m to 1.1 m is in reach, and 1.1 m is half a radius below the centre.
    assert obstacles((vertices, triangles)).distance_m(2.0, 0.0) == pytest.approx(2.0 - math.sqrt(0.75), abs=2e-3)


@pytest.mark.parametrize(
    "shape",
    [box((-5, -5, -0.1), (5, 5, 0.0)), box((-1, -1, 1.2), (1, 1, 1.3)), box((-5, -5, 0.0), (5, 5, 0.02))],
    ids=["floor", "high shelf", "carpet"],
)
def test_what_is_out_of_reach_is_no_obstacle(shape: Any) -> None:
    found = obstacles(shape)
    assert found.distance_m(0.0, 0.0) == math.inf
    assert not found.covers(0.0, 0.0)


def test_an_empty_scene_has_no_obstacles() -> None:
    assert obstacles().distance_m(1.0, 2.0) == math.inf


def test_a_vertical_sheet_is_a_line() -> None:
    sheet = np.array([(1, -1, 0), (1, 1, 0), (1, 1, 2), (1, -1, 2)]), np.array([(0, 1, 2), (0, 2, 3)])
    found = obstacles(sheet)
    assert found.distance_m(0.0, 0.0) == pytest.approx(1.0)
    assert found.distance_m(1.0, 2.0) == pytest.approx(1.0)
    assert not found.covers(1.0, 0.0)


def test_broken_triangles_are_left_out() -> None:
    vertices, triangles, _ = box((1, -1, 0), (2, 1, 1))
    broken = np.array([(np.nan, 0, 0.5), (0, 0.1, 0.5), (0.1, 0, np.inf)])
    found = obstacles((vertices, triangles), (broken, np.array([(0, 1, 2), (1, 1, 1)])))
    assert found.distance_m(0.0, 0.0) == pytest.approx(1.0)


triangles = arrays.arrays(np.float64, (8, 3, 3), elements=st.floats(-2.0, 2.0, width=32))


@given(triangles, coordinates, coordinates)
@settings(deadline=None)
def test_the_grid_forgets_no_edge(corners: np.ndarray, x: float, y: float) -> None:
    mesh = corners.reshape(-1, 3), np.arange(24).reshape(8, 3)
    found = obstacles(mesh, z_min_m=-1.0, z_max_m=1.0)
    everything = obstacle_map.distances_m(x, y, found._edges).min(initial=math.inf)
    assert found.distance_m(x, y) == pytest.approx(everything, abs=1e-12)


@given(triangles, st.floats(-2.0, 1.9), st.floats(0.05, 2.0), st.data())
@settings(deadline=None)
def test_clipping_keeps_exactly_what_is_between_the_heights(
    corners: np.ndarray, z_min_m: float, height_m: float, data: st.DataObject
) -> None:
    z_max_m = z_min_m + height_m
    corner = corners[:1]
    weights = np.array(data.draw(st.tuples(*[st.floats(0.01, 1.0)] * 3)))
    point = (weights / weights.sum()) @ corner[0]
    if z_min_m + 1e-6 <= point[2] <= z_max_m - 1e-6:
        polygon = project_slab(corner, z_min_m, z_max_m)
        assert len(polygon) == 1
        low, high = polygon[0].min(0), polygon[0].max(0)
        assert np.all(point[:2] >= low - 1e-6)
        assert np.all(point[:2] <= high + 1e-6)
    for polygon in project_slab(corner, z_min_m, z_max_m):
        assert np.all(polygon >= corner[0, :, :2].min(0) - 1e-6)
        assert np.all(polygon <= corner[0, :, :2].max(0) + 1e-6)


@given(st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=20))
@settings(deadline=None)
def test_what_is_remembered_of_one_place_is_never_too_much_for_another(places: list[tuple[float, float]]) -> None:
    found = obstacles(box((-1, -0.5, 0), (1, 0.5, 2)))
    clearance = Clearance(found.distance_m, RADIUS_M)
    for x, y in places:
        exact_m = found.distance_m(x, y) - RADIUS_M
        assume(min(abs(exact_m), abs(exact_m - 0.2)) > 1e-9)
        bound_m = clearance.at_least_m(State(x, y, 0.0))
        assert bound_m <= exact_m + 1e-12
        assert (bound_m < 0) == (exact_m < 0)
        assert clearance.exceeds(State(x, y, 0.0), 0.2) == (exact_m > 0.2)


def drive_in(found: ObstacleMap, state: State, linear_mps: float, angular_radps: float, duration_s: float) -> Any:
    way = drive(state, linear_mps, angular_radps, duration_s, LIMITS)
    return travel(state, way, Clearance(found.distance_m, RADIUS_M))


@given(st.floats(-1.0, 1.0), st.floats(-0.6, 0.6))
@settings(deadline=None)
def test_a_robot_stops_at_contact(heading_rad: float, y: float) -> None:
    found = obstacles(box((1.5, -9, 0), (2, 9, 1)))
    state, contact = drive_in(found, State(0.0, y, heading_rad), 1.5, 0.0, 4.0)
    assert contact
    assert found.distance_m(state.x, state.y) == pytest.approx(RADIUS_M, abs=2e-6)
    assert found.distance_m(state.x, state.y) >= RADIUS_M
    assert state.linear_mps == 0.0


def test_a_robot_in_contact_can_back_away_but_not_push_on() -> None:
    found = obstacles(box((1.5, -9, 0), (2, 9, 1)))
    stuck, _ = drive_in(found, State(0.0, 0.0, 0.0), 1.5, 0.0, 4.0)
    assert drive_in(found, stuck, 1.5, 0.0, 1.0)[1]
    assert not drive_in(found, stuck, -0.5, 0.0, 1.0)[1]
    assert not drive_in(found, stuck, 0.0, 1.0, 1.0)[1]


def test_a_robot_can_pass_a_gap_that_is_a_millimetre_wider_than_itself() -> None:
    gap_m = RADIUS_M + 0.0005
    found = obstacles(box((1, gap_m, 0), (2, 3, 1)), box((1, -3, 0), (2, -gap_m, 1)))
    state, contact = drive_in(found, State(0.0, 0.0, 0.0), 1.0, 0.0, 3.0)
    assert not contact
    assert state.x == pytest.approx(3.0)


def test_a_thin_pole_is_not_jumped_over() -> None:
    pole = box((1, 0.299, 0), (1.0001, 0.2991, 1))
    assert drive_in(obstacles(pole), State(0.0, 0.0, 0.0), 1.5, 0.0, 2.0)[1]


@given(st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=40))
@settings(deadline=None)
def test_many_points_at_once_are_as_far_as_one_by_one(places: list[tuple[float, float]]) -> None:
    found = obstacles(box((-1, -0.5, 0), (1, 0.5, 2)), box((2, 1, 0), (2.5, 1.5, 1)))
    x, y = np.array(places).T
    assert found.distances_m(x, y).tolist() == [found.distance_m(*place) for place in places]


def test_many_points_of_an_empty_scene_are_free() -> None:
    assert obstacles().distances_m(np.zeros(2), np.array([1.0, 2.0])).tolist() == [math.inf] * 2
