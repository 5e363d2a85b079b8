"""What is seen from where."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

import benchbot_sim_taichi
from benchbot_scenes.generator.proxy import Shape
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.visibility import CARTER, observer, seen_from, surface_points, targets, voxels
from plugins.scenes.tests.boxes import box, room, scene

CUP = box("cup", (3.0, 1.4, 0.7), (3.1, 1.5, 0.8), "cup")
EYE = (1.0, 1.5, 1.05)


def sees(geometry: SceneGeometry, eye: tuple[float, float, float] = EYE, range_m: float = 4.0) -> bool:
    things = targets(geometry)
    return bool(seen_from(np.array([eye]), things, voxels(geometry), range_m, 29.4)[0, 0])


def test_an_object_in_the_open_is_seen() -> None:
    assert sees(scene(*room(), CUP))


@pytest.mark.parametrize(
    ("between", "seen"),
    [
        (box("wall", (2.0, 0.0, 0.0), (2.1, 3.0, 2.5)), False),
        (box("low", (2.0, 0.0, 0.0), (2.1, 3.0, 0.6)), True),
        (box("beside", (2.0, 2.0, 0.0), (2.1, 3.0, 2.5)), True),
        (box("lintel", (2.0, 0.0, 1.2), (2.1, 3.0, 2.5)), True),
    ],
)
def test_what_is_between_hides(between: Shape, seen: bool) -> None:
    assert sees(scene(*room(), CUP, between)) is seen


def test_glass_hides_nothing() -> None:
    pane = box("pane", (2.0, 0.0, 0.0), (2.05, 3.0, 2.5))
    assert sees(scene(*room(), CUP, pane, glass="pane"))


def test_far_away_things_count_as_unseen() -> None:
    assert not sees(scene(*room(), CUP), range_m=1.5)


def test_what_is_below_the_picture_is_not_seen() -> None:
    mat = box("mat", (1.2, 1.4, 0.0), (1.4, 1.6, 0.02), "book")
    assert not sees(scene(*room(), mat))


def test_only_objects_of_a_class_are_looked_for_unless_named() -> None:
    vase = box("vase", (3.0, 2.0, 0.7), (3.1, 2.1, 0.9))
    geometry = scene(*room(), CUP, vase)
    assert [thing.name for thing in targets(geometry)] == ["cup"]
    assert [thing.name for thing in targets(geometry, {"vase"})] == ["vase"]


def test_points_on_slivers_and_large_triangles_are_dense_and_few() -> None:
    corners = np.array([[(0.0, 0, 0), (5, 0, 0), (5, 0.01, 0)], [(0.0, 0, 0), (1, 0, 0), (0, 1, 0)]])
    points, triangle = surface_points(corners, 0.1)
    assert np.isin([0, 1], triangle).all()
    assert len(points) < 300
    along = np.sort(points[triangle == 0, 0])
    assert np.diff(along).max() <= 0.1 + 1e-9


def test_carter_is_what_its_declaration_says() -> None:
    declared = yaml.safe_load((Path(benchbot_sim_taichi.__file__).parent / "robots" / "carter.yaml").read_text())
    seen = observer(declared)
    assert seen.radius_m == CARTER.radius_m
    assert (seen.z_min_m, seen.z_max_m, seen.eye_m) == (CARTER.z_min_m, CARTER.z_max_m, CARTER.eye_m)
    assert math.isclose(seen.half_width_deg, CARTER.half_width_deg)
    assert math.isclose(seen.half_height_deg, CARTER.half_height_deg, abs_tol=0.1)


def test_a_robot_that_says_nothing_is_taken_for_carter() -> None:
    assert observer({}).radius_m == CARTER.radius_m


def test_a_camera_without_focal_lengths_is_taken_for_one_of_90_degrees() -> None:
    seen = observer({"camera": {"frame": "camera", "width": 48, "height": 32}})
    assert seen.half_width_deg == 45.0
    assert math.isclose(math.tan(math.radians(seen.half_height_deg)), 32 / 48)
