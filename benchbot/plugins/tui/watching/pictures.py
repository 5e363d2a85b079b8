"""What a channel of an observation looks like: its picture, and the legend that says what the colours mean."""

import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchbot.plugins.drawing.palette import INVALID, SHADES, UNLABELLED, Color, Pixels, class_colors, ramp

LONGEST_LEGEND = 24
NO_CLASS = "."
_SPARE = string.ascii_uppercase + string.digits
_SHADES = np.frombuffer(SHADES.encode("ascii"), np.uint8)
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
_SHINES_UNLABELLED, _SHINES_LABELLED = np.float32(0.45), np.float32(0.3)
_ROUND_M = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)


@dataclass(frozen=True)
class Picture:
    """A picture, uint8 (H, W, 3), and its legend: a colour and what it stands for, most important first."""

    pixels: Pixels
    legend: tuple[tuple[Color, str], ...] = ()
    symbols: NDArray[np.uint8] | None = None
    """For each pixel a character that says what it is, where there is no colour to say it; ASCII, (H, W)."""
    marks: tuple[str, ...] = ()
    """The characters that stand for the entries of the legend then."""

    exact: bool = False
    """Whether a pixel between two others is one of them, not their mean: classes have no mean."""

    def letters(self, columns: int, lines: int) -> list[str]:
        """Return the symbols of so many lines."""
        if self.symbols is None:
            return []
        return [bytes(row).decode("ascii") for row in _nearest(self.symbols, columns, lines)]

    def resized(self, width: int, height: int) -> Pixels:
        """Return it in another size."""
        if self.exact:
            return _nearest(self.pixels, width, height)
        # The mean of what a pixel covers: a smooth filter costs more and shows no more at this size.
        image = Image.fromarray(self.pixels).resize((width, height), Image.Resampling.BOX)
        return np.asarray(image)


def rgb(image: NDArray[np.uint8]) -> Picture:
    """Return a colour image as it is; uint8 (H, W, 3)."""
    return Picture(np.ascontiguousarray(image[..., :3]))


def depth(depth_m: NDArray[np.float32]) -> Picture:
    """Return a depth image (H, W) in metres: near is bright, far is dark, invalid is a dull red.

    The farthest value is rounded up, so that the scale stays while the robot drives.
    """
    finite = np.isfinite(depth_m)
    # One far corner seen through a door must not make everything near look the same.
    far_m = float(np.percentile(depth_m[finite], 98)) if finite.any() else 1.0
    far_m = next((round_m for round_m in _ROUND_M if round_m >= far_m), _ROUND_M[-1])
    ranks = np.clip(np.nan_to_num(depth_m / far_m, nan=0.0, posinf=1.0, neginf=0.0) * 255, 0, 255).astype(np.uint8)
    pixels = ramp()[ranks]
    pixels[np.isnan(depth_m)] = INVALID
    near, middle, far = (_of_ramp(rank) for rank in (0, 128, 255))
    legend = [(near, "0 m"), (middle, f"{far_m / 2:g} m"), (far, f"{far_m:g} m and more")]
    if np.isnan(depth_m).any():
        legend.append((INVALID, "no value"))
    symbols = _SHADES[len(_SHADES) - 1 - ranks.astype(int) * len(_SHADES) // 256]
    symbols[np.isnan(depth_m)] = ord("?")
    marks = (chr(_SHADES[-1]), chr(_SHADES[len(_SHADES) // 2]), "' '", "?")[: len(legend)]
    return Picture(pixels, tuple(legend), symbols, marks)


def classes(image: NDArray[np.integer], ids: Mapping[str, int], behind: NDArray[np.uint8] | None = None) -> Picture:
    """Return a segmentation (H, W) with the colour of each class; the legend names what is seen, largest first.

    `ids` are the numbers of the classes by name; 0 is unlabelled. A colour image `behind` it shines through, in grey.
    """
    colors = class_colors(ids)
    names = {number: name for name, number in ids.items()}
    largest = int(image.max(initial=0))
    table = np.full((max(256, largest + 1), 3), UNLABELLED, np.uint8)
    for name, number in ids.items():
        if 0 < number < len(table):
            table[number] = colors[name]
    counts = np.bincount(image.ravel(), minlength=len(table))
    seen = [int(number) for number in np.argsort(-counts) if counts[number] and number]
    legend = [
        ((int(table[number][0]), int(table[number][1]), int(table[number][2])), names.get(number, f"class {number}"))
        for number in seen[:LONGEST_LEGEND]
    ]
    marks = _letters([name for _, name in legend])
    symbols = np.full(len(table), ord(NO_CLASS), np.uint8)
    symbols[seen[:LONGEST_LEGEND]] = [ord(mark) for mark in marks]
    pixels = table[image]
    if behind is not None and behind.shape[:2] == image.shape:
        grey = (behind[..., :3] @ _LUMINANCE)[..., None]
        share = np.where(image == 0, _SHINES_UNLABELLED, _SHINES_LABELLED)[..., None]
        pixels = (pixels * (1 - share) + grey * share).astype(np.uint8)
    return Picture(pixels, tuple(legend), symbols[image], tuple(marks), exact=True)


def _letters(names: Sequence[str]) -> list[str]:
    """Return a letter for each name, one of its own where one is left; all of them differ."""
    found: list[str] = []
    for name in names:
        wanted = [*(letter for letter in name.upper() if letter.isascii() and letter.isalnum()), *_SPARE]
        found.append(next(letter for letter in wanted if letter not in found))
    return found


def _nearest(values: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    rows = np.arange(height) * values.shape[0] // height
    columns = np.arange(width) * values.shape[1] // width
    chosen: NDArray[np.uint8] = values[rows[:, None], columns]
    return chosen


def _of_ramp(rank: int) -> Color:
    red, green, blue = (int(value) for value in ramp()[rank])
    return red, green, blue
