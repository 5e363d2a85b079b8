"""A scene from above."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from benchbot_scenes.scene import Material
from benchbot_scenes.top_down import CUT_COLOR, png, top_down
from plugins.scenes.tests.boxes import box, room, scene

PIXEL_M = 0.05


def painted() -> Image.Image:
    """A room with a green box near its north-east corner, under a ceiling."""
    geometry = scene(
        *room(), box("green", (3.0, 2.0, 0.0), (3.5, 2.5, 0.5)), box("ceiling", (-0.2, -0.2, 2.5), (4.2, 3.2, 2.6))
    )
    green = next(found.index for found in geometry.instances if found.name == "green")
    materials = (Material(base_color=(0.5, 0.5, 0.5)), Material(base_color=(0.0, 0.8, 0.0)))
    owners = (geometry.triangle_instance == green).astype(np.int32)
    return top_down(replace(geometry, materials=materials, triangle_material=owners), pixel_m=PIXEL_M)


def at(picture: Image.Image, x: float, y: float) -> tuple[int, ...]:
    """The pixel of a place; the picture's lower left corner is at (-0.2, -0.2)."""
    pixel = picture.getpixel((round((x + 0.2) / PIXEL_M), picture.height - 1 - round((y + 0.2) / PIXEL_M)))
    assert isinstance(pixel, tuple)
    return pixel


def test_things_are_where_they_are_and_the_ceiling_is_cut_away() -> None:
    picture = painted()
    red, green, blue = at(picture, 3.25, 2.25)
    assert green > 100
    assert red == blue == 0
    red, green, blue = at(picture, 1.0, 0.5)
    assert red == green == blue > 100, "the floor"


def test_walls_show_their_section() -> None:
    dark = max(at(painted(), 0.0, 1.5))
    assert dark <= 255 * max(CUT_COLOR) ** (1 / 2.2) + 1


def test_all_of_the_scene_is_in_the_picture() -> None:
    picture = painted()
    assert picture.width == pytest.approx(4.4 / PIXEL_M + 1, abs=1)
    assert picture.height == pytest.approx(3.4 / PIXEL_M + 1, abs=1)


def test_a_scene_with_nothing_in_it_is_a_white_picture() -> None:
    geometry = scene(box("high", (0.0, 0.0, 3.0), (1.0, 1.0, 4.0)))
    assert top_down(geometry).getpixel((0, 0)) == (255, 255, 255)


def test_the_file_is_a_picture() -> None:
    picture = painted()
    assert Image.open(io.BytesIO(png(picture))).size == picture.size
