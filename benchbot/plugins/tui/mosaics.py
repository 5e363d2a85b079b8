"""Pictures as characters of six or eight pixels in two colours: finer than half cells, where the font has them.

Sextants are of Unicode 13, octants of Unicode 16 (https://www.unicode.org/charts/PDF/U1FB00.pdf and U1CC00.pdf). A cell
that has more than two colours shows the means of its lighter and darker half.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from benchbot.plugins.drawing.palette import Pixels

GRIDS = {"halfcell": (1, 2), "sextant": (2, 3), "octant": (2, 4)}
"""The columns and rows of pixels in a cell."""
OLDER_SEXTANTS = {0: " ", 21: "▌", 42: "▐", 63: "█"}
OLDER_OCTANTS = {
    0: " ", 5: "▘", 10: "▝", 80: "▖", 160: "▗", 15: "▀", 85: "▌", 170: "▐", 240: "▄", 165: "▚", 90: "▞", 95: "▛",
    175: "▜", 245: "▙", 250: "▟", 192: "▂", 252: "▆", 255: "█", 3: "\U0001fb82", 63: "\U0001fb85", 1: "\U0001cea8",
    2: "\U0001ceab", 64: "\U0001cea3", 128: "\U0001cea0", 20: "\U0001fbe6", 40: "\U0001fbe7",
}  # fmt: skip
"""Patterns that had characters before. A pattern has a bit for each pixel, row by row from the top left."""


@lru_cache
def characters(grid: tuple[int, int]) -> tuple[str, ...]:
    """Return the character of each pattern of a grid of 2 × 3 or 2 × 4 pixels."""
    count = grid[0] * grid[1]
    older, first = (OLDER_SEXTANTS, 0x1FB00) if count == 6 else (OLDER_OCTANTS, 0x1CD00)
    new = iter(range(first, first + 2**count))
    return tuple(older[pattern] if pattern in older else chr(next(new)) for pattern in range(2**count))


def cells(pixels: Pixels, grid: tuple[int, int]) -> tuple[NDArray[np.int64], Pixels, Pixels]:
    """Return the pattern of each cell with its two colours, (lines, columns) and twice (lines, columns, 3).

    `pixels` is uint8 (lines * rows, columns * columns of the grid, 3). Pixels are told apart by the channel in which
    those of their cell differ most.
    """
    wide, tall = grid
    lines, columns = pixels.shape[0] // tall, pixels.shape[1] // wide
    parts = pixels.reshape(lines, tall, columns, wide, 3).swapaxes(1, 2).reshape(lines, columns, wide * tall, 3)
    low, high = parts.min(2).astype(np.int16), parts.max(2).astype(np.int16)
    channel = (high - low).argmax(-1)[..., None]
    told = np.take_along_axis(parts, channel[..., None], -1)[..., 0].astype(np.int16)
    middle = (np.take_along_axis(low, channel, -1) + np.take_along_axis(high, channel, -1)) / 2
    is_light = told > middle
    patterns = (is_light << np.arange(wide * tall)).sum(-1)
    light, dark = (_means(parts, chosen) for chosen in (is_light, ~is_light))
    flat = ~is_light.any(-1)
    light[flat] = dark[flat]
    return patterns, light, dark


def _means(parts: Pixels, chosen: NDArray[np.bool_]) -> Pixels:
    count = np.maximum(chosen.sum(-1, keepdims=True), 1)
    means: Pixels = ((parts * chosen[..., None]).sum(2) / count).astype(np.uint8)
    return means
