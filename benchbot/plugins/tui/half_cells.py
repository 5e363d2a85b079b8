"""Pictures as lines of a terminal: pixels in true colour, two or more a cell, or shades of characters without colour.

Cells are assumed to be twice as high as wide, so that pixels are square.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.color_triplet import ColorTriplet
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from benchbot.plugins.drawing.palette import SHADES, Pixels
from benchbot.plugins.tui import mosaics

UPPER_HALF = "▀"
HALF = mosaics.GRIDS["halfcell"]
MOST_STYLES = 1 << 16
TOLERANCE = 12
"""By how much a channel may differ from the colour to its left and still be shown as that, of 255."""
_KEPT_BITS = 0b11111100
"""Colours that differ by less share a style: there are a quarter of a million of them instead of millions."""

Marks = Mapping[tuple[int, int], tuple[str, Style]]
"""Characters that lie on top of a picture, by (column, line)."""

_styles: dict[int, Style] = {}


def fit(width: int, height: int, columns: int, lines: int) -> tuple[int, int]:
    """Return the columns and lines that show a picture of so many pixels as large as possible, undistorted."""
    if min(width, height, columns, lines) < 1:
        return 0, 0
    scale = min(columns / width, 2 * lines / height)
    return max(1, min(columns, round(width * scale))), max(1, min(lines, round(height * scale / 2)))


def colored(pixels: Pixels, marks: Marks | None = None, grid: tuple[int, int] = HALF) -> list[Strip]:
    """Return the lines that show pixels, uint8 (H, W, 3), with as many columns and rows in a cell as its grid has."""
    if grid == HALF:
        packed = _packed(held(pixels))
        keys, behind = packed[0::2] << 24 | packed[1::2], packed[0::2]
        strips = [_runs(row, UPPER_HALF * len(row)) for row in keys]
    else:
        patterns, light, dark = mosaics.cells(pixels, grid)
        pairs = held(np.concatenate([light, dark], -1))
        behind, signs = _packed(pairs[..., 3:]), mosaics.characters(grid)
        keys = _packed(pairs[..., :3]) << 24 | behind
        texts = ["".join(signs[pattern] for pattern in row) for row in patterns.tolist()]
        strips = [_runs(row, text) for row, text in zip(keys, texts, strict=True)]
    return _marked(strips, marks or {}, behind)


def held(pixels: Pixels, tolerance: int = TOLERANCE) -> Pixels:
    """Return a picture whose rows keep a colour until one differs from it by more: far fewer bytes say it."""
    found = pixels.astype(np.int16)
    for column in range(1, found.shape[1]):
        before = found[:, column - 1]
        same = np.abs(found[:, column] - before).max(1) <= tolerance
        found[same, column] = before[same]
    return found.astype(np.uint8)


def shaded(pixels: Pixels, *, dark: bool = True) -> list[Strip]:
    """Return the same as characters, the lightest pixels as the densest ones; `dark` is the terminal's background.

    The contrast is stretched to the darkest and lightest pixels of the picture.
    """
    grey = pixels.astype(np.float32) @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    cells = (grey[0::2] + grey[1::2]) / 2
    low, high = np.percentile(cells, (1, 99)) if cells.size else (0.0, 1.0)
    shares = (cells - low) / max(high - low, 1.0)
    ranks = np.clip((shares if dark else 1 - shares) * len(SHADES), 0, len(SHADES) - 1).astype(int)
    lines = [[SHADES[rank] for rank in row] for row in ranks.tolist()]
    return plain("".join(line) for line in lines)


def plain(lines: Iterable[str]) -> list[Strip]:
    """Return lines of text as they are."""
    return [Strip([Segment(line)], len(line)) for line in lines]


def _packed(pixels: Pixels) -> NDArray[np.int64]:
    kept = (pixels & _KEPT_BITS).astype(np.int64)
    packed: NDArray[np.int64] = kept[..., 0] << 16 | kept[..., 1] << 8 | kept[..., 2]
    return packed


def _runs(keys: NDArray[np.int64], text: str) -> Strip:
    starts = np.concatenate([[0], np.flatnonzero(np.diff(keys)) + 1])
    lengths = np.diff(np.append(starts, len(keys)))
    segments = [
        Segment(text[start : start + length], _style(key))
        for key, start, length in zip(keys[starts].tolist(), starts.tolist(), lengths.tolist(), strict=True)
    ]
    return Strip(segments, len(keys))


def _style(key: int) -> Style:
    style = _styles.get(key)
    if style is None:
        if len(_styles) >= MOST_STYLES:
            _styles.clear()
        style = _styles[key] = Style(color=_color(key >> 24), bgcolor=_color(key & 0xFFFFFF))
    return style


def _color(packed: int) -> Color:
    return Color.from_triplet(ColorTriplet(packed >> 16, packed >> 8 & 255, packed & 255))


def _marked(strips: list[Strip], marks: Marks, behind: NDArray[np.int64]) -> list[Strip]:
    for (column, line), (character, style) in marks.items():
        if not (0 <= line < len(strips) and 0 <= column < behind.shape[1]):
            continue
        around = Style(bgcolor=_color(int(behind[line, column])))
        before, _, after = strips[line].divide([column, column + 1, behind.shape[1]])
        strips[line] = Strip.join([before, Strip([Segment(character, around + style)], 1), after])
    return strips
