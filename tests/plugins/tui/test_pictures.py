"""What the robot sees, in cells: sizes, colours, legends, and characters where there is no colour."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.color import Color
from textual.geometry import Size

from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing.palette import INVALID, class_colors, ramp
from benchbot.plugins.tui.watching import half_cells, picture_boxes, pictures
from benchbot.plugins.tui.watching.camera import CHANNELS, available, picture
from benchbot.plugins.tui.watching.log_view import LogFilter
from benchbot.plugins.tui.watching.matrix_grid import Grid, counts, letter, shares, tally
from benchbot.plugins.tui.watching.raster import Still
from benchbot.plugins.watching.views import LogLine
from tests.plugins.tui.watched import CLASSES, batch_view, look

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
    seen = pictures.depth(depth_m)
    assert [name for _, name in seen.legend] == ["0 m", "2.5 m", "5 m and more", "no value"]
    assert seen.pixels[0, 0].sum() > seen.pixels[0, 1].sum()
    assert tuple(seen.pixels[1, 0]) == INVALID
    assert seen.pixels[1, 1].tolist() == ramp()[255].tolist()
    assert seen.letters(2, 2) == ["@:", "? "]
    assert pictures.depth(np.full((2, 2), np.nan, np.float32)).letters(2, 2) == ["??", "??"]


def test_classes_have_colours_of_their_own_that_stay_and_letters_where_there_is_none() -> None:
    colors = class_colors(CLASSES)
    assert len(set(colors.values())) == len(colors)
    assert class_colors(reversed(list(CLASSES))) == colors
    seen = picture(look(), CHANNELS[2])
    assert seen is not None
    assert [name for _, name in seen.legend] == ["chair", "book", "sink", "bottle"]
    assert seen.legend[0][0] == colors["chair"]
    assert seen.marks == ("C", "B", "S", "O")
    text = "".join(line.text for line in Still(seen).strips(Size(160, 60), colored=False, dark=True))
    assert set(text) == set(".CBSO")
    unknown = pictures.classes(np.array([[0, 7, 7, 900]], np.uint16), {})
    assert [name for _, name in unknown.legend] == ["class 7", "class 900"]


def test_only_channels_that_a_run_observes_are_offered() -> None:
    assert [channel.title for channel in available(["laser", "image_depth", "image_rgb"])] == ["colour", "depth"]
    assert available([]) == []
    with pytest.raises(BenchbotError, match="cannot be shown as 'sixels'"):
        picture_boxes.make("sixels")


@given(st.lists(st.integers(0, 2000), max_size=8), st.integers(0, 120))
def test_the_parts_of_a_bar_fill_it_and_nothing_that_is_there_vanishes(numbers: list[int], width: int) -> None:
    parts = shares(numbers, width)
    present = [part for part, number in zip(parts, numbers, strict=True) if number]
    assert sum(parts) == (width if present else 0)
    assert all(part == 0 for part, number in zip(parts, numbers, strict=True) if not number)
    if len(present) <= width:
        assert all(part >= 1 for part in present)


def test_each_episode_has_its_place_in_the_matrix() -> None:
    cells = batch_view(3, 8).cells
    grid = Grid.of(cells)
    assert (grid.environments, len(grid.columns)) == (("room:1", "room:2", "room:3"), 8)
    assert grid.columns[4] == ("carter_lowres", 0, 0, 0)
    assert sorted(grid.position) == list(range(24))
    assert all(grid.index(*grid.position[index]) == index for index in range(24))
    states = [cell.state for cell in cells]
    assert sum(counts(grid, states, 0).values()) == 8
    assert next(iter(tally(states))) == "done"
    # Episodes that differ in nothing but a setting stand beside each other.
    twice = Grid.of([*cells[:2], *cells[:2]])
    assert [column[1:] for column in twice.columns] == [(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 1)]
    assert (letter("done"), letter("never heard of")) == ("D", "F")


def test_a_log_is_filtered_by_source_level_and_text() -> None:
    line = LogLine(0.0, "solution", "warning", "No depth for the Table")
    every = LogFilter()
    assert every.passes(line)
    assert not every.with_text("chair").passes(line)
    assert every.with_text(" table ").passes(line)
    assert every.next_level().passes(line)
    assert not every.next_level().next_level().passes(line)
    sources = ["platform", "solution"]
    assert [str(every.next_source(sources)), str(every.next_source(sources).next_source(sources))] == [
        "platform · info and worse",
        "solution · info and worse",
    ]
    assert every.next_source(sources).next_source(sources).next_source(sources) == every
