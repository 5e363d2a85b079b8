"""A contact sheet: some of the frames that were recorded, evenly spread, each with its number."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from benchbot.plugins.drawing import figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDEST_PX = 640


def chosen(frames: Mapping[int, Path], count: int) -> dict[int, Path]:
    """Return so many of the frames, evenly spread, the first and the last among them."""
    numbers = sorted(frames)
    if len(numbers) <= count:
        return {number: frames[number] for number in numbers}
    steps = [round(place * (len(numbers) - 1) / max(count - 1, 1)) for place in range(count)]
    return {numbers[step]: frames[numbers[step]] for step in steps}


def draw(frames: Mapping[int, Path], width_mm: float, columns: int) -> "Figure":
    """Return the figure of frames, row by row. A frame is counted from 1, as the observations are."""
    pictures = {number: _read(path) for number, path in frames.items()}
    height, width = next(iter(pictures.values())).shape[:2]
    across = min(columns, len(pictures))
    drawn, panels = figure.panels(len(pictures), width_mm, width_mm / across * height / width + 1, across)
    drawn.get_layout_engine().set(w_pad=0.01, h_pad=0.01, wspace=0.0, hspace=0.0)  # type: ignore[union-attr, call-arg]
    for axes, (number, picture) in zip(panels, pictures.items(), strict=True):
        axes.imshow(picture)
        axes.set_axis_off()
        axes.text(
            0.02,
            0.97,
            str(number + 1),
            transform=axes.transAxes,
            ha="left",
            va="top",
            fontsize=figure.SMALL_PT,
            color="white",
            bbox={"boxstyle": "round,pad=0.25", "facecolor": figure.INK, "edgecolor": "none", "alpha": 0.75},
        )
    return drawn


def _read(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        image.thumbnail((WIDEST_PX, WIDEST_PX))
        return np.asarray(image.convert("RGB"))
