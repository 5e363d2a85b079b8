"""Sheets of paper: a printed page, and what hangs on a refrigerator; each covers its sheet once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PIL import Image, ImageDraw

from tools.household.model import Texture
from tools.household.textures.encode import base_color

_INK, _PAPER = "#3b3d42", "#f4f2ea"


def _drawn(width_m: float, height_m: float, high_px: int, ground: str, draw: Callable[..., None]) -> Texture:
    wide_px = round(high_px * width_m / height_m)
    sheet = Image.new("RGB", (wide_px * 3, high_px * 3), ground)
    draw(ImageDraw.Draw(sheet), *sheet.size)
    small = sheet.resize((wide_px, high_px), Image.Resampling.BOX)
    return base_color(np.asarray(small, float) / 255.0, width_m, height_m)


def printed_page(width_m: float, height_m: float, seed: int = 0) -> Texture:
    """A page with a heading, three paragraphs and a chart."""
    rng = np.random.default_rng(seed)

    def draw(pen: ImageDraw.ImageDraw, wide: int, high: int) -> None:
        pen.rectangle((wide * 0.12, high * 0.08, wide * 0.62, high * 0.115), fill=_INK)
        for row in range(22):
            if row % 7 == 6 or 8 <= row < 13:
                continue
            y = high * (0.17 + 0.034 * row)
            end = wide * (0.88 if row % 7 != 5 else float(rng.uniform(0.35, 0.7)))
            pen.line((wide * 0.12, y, end, y), fill="#83858a", width=max(1, high // 110))
        for bar in range(6):
            x, top = wide * (0.16 + 0.12 * bar), high * (0.58 - float(rng.uniform(0.03, 0.14)))
            pen.rectangle((x, top, x + wide * 0.07, high * 0.585), fill=("#5c7ea6", "#c98a4b")[bar % 2])

    return _drawn(width_m, height_m, 128, _PAPER, draw)


def drawing_of_a_child(width_m: float, height_m: float) -> Texture:
    """A house, a sun and somebody on a meadow, in wax crayon."""

    def draw(pen: ImageDraw.ImageDraw, wide: int, high: int) -> None:
        line = max(2, high // 40)
        pen.rectangle((0, high * 0.80, wide, high), fill="#7db05a")
        pen.ellipse((wide * 0.70, high * 0.06, wide * 0.92, high * 0.30), fill="#f0c02e")
        pen.rectangle(
            (wide * 0.14, high * 0.46, wide * 0.50, high * 0.82), fill="#e39a8a", outline="#a8443a", width=line
        )
        pen.polygon(
            [(wide * 0.08, high * 0.47), (wide * 0.56, high * 0.47), (wide * 0.32, high * 0.20)], fill="#a8443a"
        )
        pen.rectangle((wide * 0.27, high * 0.60, wide * 0.38, high * 0.82), fill="#5a6fb0")
        pen.ellipse((wide * 0.66, high * 0.42, wide * 0.78, high * 0.56), outline="#333333", width=line)
        for start, end in (((0.72, 0.56), (0.72, 0.74)), ((0.62, 0.62), (0.82, 0.62))):
            pen.line((wide * start[0], high * start[1], wide * end[0], high * end[1]), fill="#333333", width=line)
        for foot in (0.64, 0.80):
            pen.line((wide * 0.72, high * 0.74, wide * foot, high * 0.86), fill="#333333", width=line)

    return _drawn(width_m, height_m, 96, "#f7f3e6", draw)


def shopping_list(width_m: float, height_m: float, seed: int = 0) -> Texture:
    """Lines of handwriting on yellow paper."""
    rng = np.random.default_rng(seed)

    def draw(pen: ImageDraw.ImageDraw, wide: int, high: int) -> None:
        for row in range(8):
            y = high * (0.12 + 0.10 * row)
            xs = np.linspace(0.14, float(rng.uniform(0.5, 0.86)), 24)
            strokes = [(wide * x, y + high * 0.018 * float(rng.normal())) for x in xs]
            pen.line(strokes, fill="#33476e", width=max(2, high // 70))

    return _drawn(width_m, height_m, 64, "#f2e08a", draw)
