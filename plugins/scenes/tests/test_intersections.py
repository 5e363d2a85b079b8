"""Which bodies reach into each other, and by how much."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.intersections import intersecting, triangles_of
from benchbot_scenes.layout import Placement
from plugins.scenes.tests import packs
from plugins.scenes.tests.generator.furniture import model

BLOCK = model("block", (0.4, 0.6, 0.5), "block")


def block(x: float, y: float = 0.0, z: float = 0.0, yaw_deg: float = 0.0) -> np.ndarray:
    return triangles_of(Placement("block", "block", (x, y, z), yaw_deg), BLOCK)


@pytest.mark.parametrize(
    ("other", "crosses"),
    [
        ((0.41, 0.0, 0.0), False),
        ((0.395, 0.0, 0.0), False),  # 5 mm deep
        ((0.38, 0.0, 0.0), True),
        ((0.0, 0.0, 0.5), False),  # on top, touching
        ((0.0, 0.0, 0.495), False),
        ((0.1, 0.1, 0.47), True),
        ((0.45, 0.45, 0.0, 45.0), False),  # their boxes overlap, they do not
        ((0.3, 0.3, 0.0, 45.0), True),
    ],
)
def test_bodies_intersect_when_no_shift_of_a_centimetre_parts_them(other: tuple[float, ...], crosses: bool) -> None:
    found = intersecting({"one": block(0.0), "two": block(*other)})
    assert found == ([("one", "two")] if crosses else [])


def test_every_pair_is_named_once_and_what_is_empty_meets_nothing() -> None:
    bodies = {"a": block(0.0), "b": block(0.2), "c": block(5.0), "d": block(5.2), "e": np.empty((0, 3, 3))}
    assert intersecting(bodies) == [("a", "b"), ("c", "d")]


def test_a_placed_model_is_its_mesh_scaled_and_turned(tmp_path: Path) -> None:
    table = packs.pack(tmp_path).model("table")
    corners = triangles_of(Placement("t", "table", (1.0, 2.0, 0.5), 90.0, (2.0, 1.0, 0.8)), table)
    np.testing.assert_allclose(corners.min(axis=(0, 1)), (0.5, 1.0, 0.5), atol=1e-5)
    np.testing.assert_allclose(corners.max(axis=(0, 1)), (1.5, 3.0, 1.3), atol=1e-5)
