import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.map_model import Box
from benchbot.plugins.report.camera_pictures import Camera

# One metre up, looking forward (optical frame: x right, y down, z forward).
ROBOT = {
    "frames": {"eye": {"xyz": [0, 0, 1.0], "rpy_deg": [-90, 0, -90]}},
    "camera": {"frame": "eye", "width": 320, "height": 180, "fx": 160, "fy": 160, "cx": 160, "cy": 90},
}


@pytest.fixture
def camera() -> Camera:
    found = Camera.of(ROBOT)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("base", "point", "pixel"),
    [
        (Pose(), (2.0, 0.0, 1.0), (160, 90)),
        (Pose(), (2.0, -1.0, 1.0), (240, 90)),  # to the right
        (Pose(), (2.0, 0.0, 0.5), (160, 130)),  # below
        (Pose.planar(5.0, 1.0, math.pi / 2), (5.0, 4.0, 1.0), (160, 90)),
        (Pose.planar(5.0, 1.0, math.pi / 2), (6.0, 3.0, 1.0), (240, 90)),
    ],
)
def test_points_appear_where_a_pinhole_camera_sees_them(
    camera: Camera, base: Pose, point: tuple[float, float, float], pixel: tuple[float, float]
) -> None:
    seen = camera.pixels(base, [point]) or []
    assert seen[0] == pytest.approx(pixel)


def test_what_is_behind_is_not_seen(camera: Camera) -> None:
    assert camera.pixels(Pose(), [(2.0, 0.0, 1.0), (-1.0, 0.0, 1.0)]) is None
    assert camera.edges(Pose(), Box((0.0, 0.0, 1.0), (1.0, 1.0, 1.0))) == []


def test_a_box_has_twelve_edges(camera: Camera) -> None:
    edges = camera.edges(Pose(), Box((3.0, 0.0, 1.0), (1.0, 1.0, 1.0)))

    assert len(edges) == len({frozenset(edge) for edge in edges}) == 12


def test_a_better_view_is_nearer_whole_and_not_hidden(camera: Camera) -> None:
    box = Box((3.0, 0.0, 1.0), (0.3, 0.3, 0.3))
    screen = Box((1.5, 0.0, 1.0), (0.1, 2.0, 2.0))

    here = camera.view_of(Pose(), box)
    assert camera.view_of(Pose.planar(1.0, 0.0, 0.0), box) > here > camera.view_of(Pose.planar(-3.0, 0.0, 0.0), box)
    assert camera.view_of(Pose(), box, [screen]) < here
    assert camera.view_of(Pose.planar(0.0, 0.0, math.pi / 4), box) < here
    assert camera.view_of(Pose.planar(0.0, 0.0, math.pi), box) == 0


@given(st.tuples(*[st.floats(-2, 2)] * 3), st.tuples(*[st.floats(0.1, 2)] * 3), st.tuples(*[st.floats(-9, 9)] * 3))
def test_the_line_to_its_middle_passes_through_a_box(
    centroid: tuple[float, float, float], extent: tuple[float, float, float], eye: tuple[float, float, float]
) -> None:
    box = Box(centroid, extent)

    assert box.is_between(eye, centroid) or eye == centroid
    beyond = (centroid[0] + 20, centroid[1], centroid[2])
    assert not box.is_between(beyond, (beyond[0] + 1, beyond[1], beyond[2]))


@pytest.mark.parametrize("robot", [None, {}, {"camera": {"frame": "eye"}}, {"frames": ROBOT["frames"]}])
def test_a_robot_may_not_say_where_its_camera_is(robot: dict[str, object] | None) -> None:
    assert Camera.of(robot) is None
