"""Trajectories that see everything, and that can be driven."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.coverage import LEG_M, MARGIN_M, TURN_RAD, Coverage, Pose7, least_room, plan_coverage, room_of
from benchbot_scenes.free_space import free_space
from benchbot_scenes.routes import short_order
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.visibility import CARTER, bearings_rad, seen_from, targets, voxels
from plugins.scenes.tests.boxes import box, room, scene

START = (0.6, 0.6, 0.0)
SHAPES = [
    *room(6.0, 4.0),
    box("wall", (2.9, 0.0, 0.0), (3.1, 2.6, 2.5)),
    box("table", (4.0, 1.0, 0.0), (5.0, 2.0, 0.75), "table"),
    box("cup", (4.4, 1.4, 0.75), (4.5, 1.5, 0.85), "cup"),
    box("couch", (0.1, 2.8, 0.0), (1.9, 3.7, 0.8), "couch"),
    box("plant", (5.5, 3.4, 0.0), (5.9, 3.8, 1.2), "potted plant"),
]
SCENE = scene(*SHAPES)


@pytest.fixture(scope="module")
def planned() -> Coverage:
    return plan_coverage(SCENE, START, CARTER)


def heading(pose: Pose7) -> float:
    return 2 * math.atan2(pose[3], pose[0])


def test_every_object_is_seen_from_a_pose_that_looks_at_it(planned: Coverage) -> None:
    things = targets(SCENE)
    eyes = np.array([(pose[4], pose[5], CARTER.eye_m) for pose in planned.poses])
    seen = seen_from(eyes, things, voxels(SCENE), CARTER.range_m, CARTER.half_height_deg)
    off = bearings_rad(eyes, things) - np.array([[heading(pose)] for pose in planned.poses])
    ahead = np.abs((off + np.pi) % (2 * np.pi) - np.pi) < math.radians(CARTER.half_width_deg)
    assert planned.unseen == ()
    assert (seen & ahead).any(0).all()


def test_it_begins_where_the_robot_is(planned: Coverage) -> None:
    first = planned.poses[0]
    assert (first[4], first[5], heading(first)) == START


def test_legs_are_short_straight_and_clear(planned: Coverage) -> None:
    space = free_space(SCENE, CARTER.z_min_m, CARTER.z_max_m, cell_m=0.02)
    assert least_room(space, planned.poses) >= CARTER.radius_m + MARGIN_M - 0.01
    for before, after in pairwise(planned.poses):
        length_m = math.dist(before[4:6], after[4:6])
        assert length_m <= LEG_M + 1e-3
        if length_m > 0.01:
            direction = math.atan2(after[5] - before[5], after[4] - before[4])
            for pose in (before, after):
                assert abs(math.remainder(heading(pose) - direction, 2 * math.pi)) < math.radians(0.5)
        else:
            assert abs(math.remainder(heading(after) - heading(before), 2 * math.pi)) <= TURN_RAD + 1e-3


def test_the_same_scene_gives_the_same_poses(planned: Coverage) -> None:
    assert plan_coverage(SCENE, START, CARTER) == planned


def test_what_cannot_be_seen_is_named() -> None:
    # A cup within a closed cupboard.
    cupboard = [box("cupboard", (5.0, 0.0, 0.0), (5.9, 0.6, 1.5)), box("cup", (5.4, 0.2, 0.7), (5.5, 0.3, 0.8), "cup")]
    assert plan_coverage(scene(*room(6.0, 4.0), *cupboard), START, CARTER).unseen == ("cup",)


def test_a_robot_that_does_not_fit_goes_nowhere() -> None:
    found = plan_coverage(SCENE, (4.5, 1.5, 0.0), CARTER)
    assert found.poses == ()
    assert set(found.unseen) == {"table", "cup", "couch", "plant"}


def test_a_camera_that_is_too_narrow_is_refused_in_words() -> None:
    with pytest.raises(BenchbotError, match="No trajectory shows the objects") as refused:
        plan_coverage(SCENE, START, replace(CARTER, half_width_deg=6.0))
    assert "12 degrees wide" in refused.value.why


def test_named_things_are_looked_for_whether_they_have_a_class_or_not() -> None:
    assert plan_coverage(SCENE, START, CARTER, names=["wall"]).unseen == ()


@pytest.mark.parametrize("cut", ["heading", "way"])
def test_a_trajectory_that_cannot_be_driven_has_no_room(cut: str) -> None:
    space = free_space(SCENE, CARTER.z_min_m, CARTER.z_max_m)
    poses = [(1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0), (1.0, 0.0, 0.0, 0.0, 1.0, 1.5, 0.0)]
    if cut == "way":
        poses[1] = (1.0, 0.0, 0.0, 0.0, 4.5, 1.0, 0.0)
    assert least_room(space, poses) == 0.0


def test_a_tour_of_places_on_a_line_is_in_order() -> None:
    places = np.array([0.0, 5.0, 1.0, 3.0, 2.0, 4.0])
    order = short_order(np.abs(places[:, None] - places[None]))
    assert places[order].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def test_an_empty_scene_has_a_start_and_nothing_more() -> None:
    empty: SceneGeometry = scene(*room())
    assert len(plan_coverage(empty, START, CARTER).poses) == 1


def test_the_room_along_a_way_is_that_to_the_surfaces_themselves() -> None:
    geometry = scene(*room(6.0, 4.0), box("post", (3.0, 1.4317, 0.0), (3.004, 1.5, 1.0)))
    space = free_space(geometry, CARTER.z_min_m, CARTER.z_max_m)
    poses = [(1.0, 0.0, 0.0, 0.0, x, 1.0, 0.0) for x in (1.0, 1.013, 5.0)]
    assert 0.4317 - 0.0011 <= room_of(geometry, space, poses, CARTER) <= 0.4317 + 1e-6
    assert least_room(space, poses) < 0.43
    assert room_of(geometry, space, [(0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0), poses[2]], CARTER) == 0.0
    assert room_of(geometry, space, poses[:1], CARTER) == math.inf
