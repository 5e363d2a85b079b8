"""Boxes as lines in a picture: where a pinhole camera sees them, and which parts of them are hidden."""

import math
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.geometry import Pose
from benchbot.evaluation.evidence import Boxes, Camera, Scene
from benchbot.evaluation.frames import Frame
from benchbot.plugins.drawing.map_model import Box
from benchbot.plugins.report.camera_pictures import Shot

# One metre up, looking forward (optical frame: x right, y down, z forward).
ROBOT = {
    "frames": {"eye": {"xyz": [0, 0, 1.0], "rpy_deg": [-90, 0, -90]}},
    "camera": {"frame": "eye", "width": 320, "height": 180, "fx": 160, "fy": 160, "cx": 160, "cy": 90},
}
CUBE = Box((3.0, 0.0, 1.0), (1.0, 1.0, 1.0))


def camera() -> Camera:
    found = Camera.of(ROBOT)
    assert found is not None
    return found


def shot(base: Pose, *boxes: Box) -> Shot:
    return Shot(Frame(Path("none.jpg"), 0, base), camera(), Scene(Boxes.of([(b.centroid, b.extent) for b in boxes])))


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
    base: Pose, point: tuple[float, float, float], pixel: tuple[float, float]
) -> None:
    seen = camera().seen_from(base, np.array([point]))
    assert camera().pixels(seen)[0] == pytest.approx(pixel)
    (ray,) = camera().rays(base, np.array([pixel], float))
    eye = np.array((base @ camera().mount).translation_xyz)
    assert eye + seen[0, 2] * ray == pytest.approx(point)


def test_what_is_behind_has_no_lines_and_what_is_before_has_twelve_edges() -> None:
    assert shot(Pose()).lines(Box((-2.0, 0.0, 1.0), (1.0, 1.0, 1.0))) == []
    lines = shot(Pose()).lines(CUBE)
    assert [behind for _, behind in lines] == [False] * 12
    # Of a box around the camera the part before the lens is drawn.
    assert 0 < len(shot(Pose.planar(2.6, 0.0, 0.0)).lines(CUBE)) < 12


def test_the_part_of_an_edge_that_is_behind_something_is_hidden() -> None:
    lines = shot(Pose(), Box((1.5, 1.0, 1.0), (0.1, 2.0, 3.0))).lines(CUBE)

    assert {behind for _, behind in lines} == {True, False}
    for pixels, behind in lines:  # the screen covers what is to the left of the middle
        middle = float(pixels.mean(axis=0)[0])
        assert middle < 161 if behind else middle > 159
