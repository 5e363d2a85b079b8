"""Pictures in cells: sizes, colours, legends, and characters where there is no colour."""

import asyncio
import unicodedata

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.color import Color
from textual.app import App, ComposeResult
from textual.geometry import Size

from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing.palette import INVALID, class_colors, ramp
from benchbot.plugins.tui import camera, half_cells, mosaics, raster
from benchbot.plugins.tui.camera import CHANNELS, available, picture
from tests.plugins.tui.watched import CLASSES, snapshot

sides = st.integers(0, 300)


@given(sides, sides, sides, sides)
def test_a_picture_fits_into_its_room_undistorted(width: int, height: int, columns: int, lines: int) -> None:
    wide, tall = half_cells.fit(width, height, columns, lines)
    assert (wide <= columns, tall <= lines) == (True, True)
    if min(width, height, columns, lines) > 0:
        assert min(wide, tall) >= 1
        assert wide == columns or tall == lines or abs(wide / width - 2 * tall / height) < 2 / min(width, height)


def test_two_pixels_share_a_cell_and_equal_neighbours_a_style() -> None:
    pixels = np.zeros((2, 4, 3), np.uint8)
    pixels[0, :, 0], pixels[1, :, 2] = 200, 100
    (strip,) = half_cells.colored(pixels)
    (segment,) = strip
    assert segment.text == "▀▀▀▀"
    assert segment.style is not None
    assert (segment.style.color, segment.style.bgcolor) == (Color.from_rgb(200, 0, 0), Color.from_rgb(0, 0, 100))


def test_without_colour_what_is_light_is_dense_on_a_dark_terminal_and_thin_on_a_light_one() -> None:
    pixels = np.repeat(np.linspace(0, 255, 20).astype(np.uint8)[None, :, None], 3, 2).repeat(2, 0)
    (dark,) = half_cells.shaded(pixels)
    assert (dark.text[0], dark.text[-1]) == (" ", "@")
    assert list(dark.text) == sorted(dark.text, key=" .:-=+*#%@".index)
    assert half_cells.shaded(pixels, dark=False)[0].text[0] == "@"


def test_depth_is_bright_where_it_is_near_and_says_its_scale() -> None:
    depth_m = np.array([[0.5, 4.0], [np.nan, np.inf]], np.float32)
    seen = camera.depth(depth_m)
    assert [name for _, name in seen.legend] == ["0 m", "2.5 m", "5 m and more", "no value"]
    assert seen.image[0, 0].sum() > seen.image[0, 1].sum()
    assert tuple(seen.image[1, 0]) == INVALID
    assert seen.image[1, 1].tolist() == ramp()[255].tolist()
    assert seen.letters(2, 2) == ["@:", "? "]
    assert camera.depth(np.full((2, 2), np.nan, np.float32)).letters(2, 2) == ["??", "??"]


def test_classes_have_colours_of_their_own_that_stay_and_letters_where_there_is_none() -> None:
    colors = class_colors(CLASSES)
    assert len(set(colors.values())) == len(colors)
    assert class_colors(reversed(list(CLASSES))) == colors
    seen = picture(snapshot(), CHANNELS[2])
    assert seen is not None
    assert [name for _, name in seen.legend] == ["chair", "book", "sink", "bottle"]
    assert seen.legend[0][0] == colors["chair"]
    assert seen.marks == ("C", "B", "S", "O")
    text = "".join(line.text for line in seen.strips(Size(160, 60), colored=False, dark=True))
    assert set(text) == set(".CBSO")
    unknown = camera.classes(np.array([[0, 7, 7, 900]], np.uint16), {})
    assert [name for _, name in unknown.legend] == ["class 7", "class 900"]


def test_a_picture_has_its_widget_s_size_before_textual_tells_of_it() -> None:
    """Lines that were asked for between a layout and its `Resize` showed a picture too large, and cut off, for good."""
    box = raster.make("halfcell")

    class Shows(App[None]):
        def compose(self) -> ComposeResult:
            yield box

    async def scenario() -> None:
        app = Shows()
        async with app.run_test(size=(40, 12)) as pilot:
            box.show(raster.Picture(np.full((90, 160, 3), 128, np.uint8)))
            await pilot.pause()
            assert box.render_line(6).text.count(half_cells.UPPER_HALF) == 40
            box.styles.height = 6
            app.screen._clear_arrangement_cache()
            app.screen._refresh_layout()
            assert box.render_line(3).text.count(half_cells.UPPER_HALF) == 21

    asyncio.run(scenario())


def test_only_channels_that_a_run_observes_are_offered() -> None:
    assert [channel.title for channel in available(["laser", "image_depth", "image_rgb"])] == ["colour", "depth"]
    assert available([]) == []
    with pytest.raises(BenchbotError, match="cannot be shown as 'sixels'"):
        raster.make("sixels")


def test_each_pattern_of_pixels_has_a_character_of_its_own() -> None:
    sextants, octants = (mosaics.characters(mosaics.GRIDS[kind]) for kind in ("sextant", "octant"))
    for pattern, character in enumerate(sextants):
        if pattern not in mosaics.OLDER_SEXTANTS:
            numbers = "".join(str(bit + 1) for bit in range(6) if pattern >> bit & 1)
            assert unicodedata.name(character) == f"BLOCK SEXTANT-{numbers}"
    # Octants are younger than Python's table: the first and the last are OCTANT-3 and OCTANT-2345678.
    assert (octants[0b100], octants[0b11111110]) == ("\U0001cd00", "\U0001cde5")
    assert len(set(octants)) == 256
    assert {cell_len(character) for character in (*sextants, *octants)} == {1}


@given(st.sampled_from(["sextant", "octant"]), st.data())
def test_a_cell_of_two_colours_is_shown_as_it_is(kind: str, data: st.DataObject) -> None:
    wide, tall = grid = mosaics.GRIDS[kind]
    is_light = np.array(data.draw(st.lists(st.booleans(), min_size=wide * tall, max_size=wide * tall)))
    pixels = np.where(is_light[:, None], (200, 40, 96), (8, 60, 96)).astype(np.uint8).reshape(tall, wide, 3)
    (strip,) = half_cells.colored(pixels, grid=grid)
    (segment,) = strip
    pattern = mosaics.characters(grid).index(segment.text)
    assert segment.style is not None
    light, dark = segment.style.color, segment.style.bgcolor
    shown = [light if pattern >> bit & 1 else dark for bit in range(wide * tall)]
    assert shown == [Color.from_rgb(200, 40, 96) if each else Color.from_rgb(8, 60, 96) for each in is_light]


def test_a_picture_in_finer_cells_has_the_size_of_one_in_half_cells() -> None:
    seen = picture(snapshot(), CHANNELS[0])
    assert seen is not None
    sizes = {
        kind: [strip.cell_length for strip in seen.strips(Size(61, 21), colored=True, dark=True, grid=grid)]
        for kind, grid in mosaics.GRIDS.items()
    }
    assert sizes["sextant"] == sizes["octant"] == sizes["halfcell"]
