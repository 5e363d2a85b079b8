"""Labels of bottles and faces of clocks; each covers its sheet once."""

import math

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tools.household.model import Texture
from tools.household.textures.encode import base_color

_NUMERALS = ("XII", "I", "II", "III", "IIII", "V", "VI", "VII", "VIII", "IX", "X", "XI")


def bottle_sleeve(width_m: float, height_m: float, title: str, note: str, ground: str, ink: str) -> Texture:
    """A printed label: a title between rules, a line below, a small emblem above."""
    wide, high = 384, max(32, round(384 * height_m / width_m))
    sheet = Image.new("RGB", (wide, high), ground)
    draw = ImageDraw.Draw(sheet)
    for y in (0.06, 0.94):
        draw.line((0, high * y, wide, high * y), fill=ink, width=4)
    draw.ellipse((wide / 2 - high * 0.11, high * 0.14, wide / 2 + high * 0.11, high * 0.36), outline=ink, width=4)
    draw.polygon(
        [(wide / 2, high * 0.17), (wide / 2 + high * 0.06, high * 0.32), (wide / 2 - high * 0.06, high * 0.32)],
        fill=ink,
    )
    size = min(high * 0.26, wide * 1.35 / max(len(title), 1))
    draw.text((wide / 2, high * 0.55), title, fill=ink, font=ImageFont.load_default(size), anchor="mm", stroke_width=1)
    draw.text((wide / 2, high * 0.78), note, fill=ink, font=ImageFont.load_default(size * 0.42), anchor="mm")
    return base_color(np.asarray(sheet, float) / 255.0, width_m, height_m)


def clock_face(diameter_m: float, style: str, hour: int, minute: int) -> Texture:
    """A wall clock's face in a square: `style` is roman, dots or station."""
    size = 512
    ground, ink = {"roman": ("#efe6d2", "#2b2118"), "dots": ("#2f3b3a", "#e9e4d6"), "station": ("#fbfbf8", "#151515")}[
        style
    ]
    sheet = Image.new("RGB", (size, size), ground)
    draw = ImageDraw.Draw(sheet)
    middle = size / 2

    def ray(angle_deg: float, start: float, end: float, width: float, code: str = ink) -> None:
        dx, dy = math.sin(math.radians(angle_deg)) * middle, -math.cos(math.radians(angle_deg)) * middle
        draw.line(
            (middle + start * dx, middle + start * dy, middle + end * dx, middle + end * dy),
            fill=code,
            width=round(width),
        )

    for tick in range(60):
        is_hour = tick % 5 == 0
        if style == "station":
            ray(tick * 6.0, 0.78 if is_hour else 0.88, 0.95, 16 if is_hour else 6)
        elif style == "dots" and is_hour:
            x, y = (
                middle + 0.82 * middle * math.sin(math.radians(tick * 6)),
                middle - 0.82 * middle * math.cos(math.radians(tick * 6)),
            )
            draw.ellipse((x - 11, y - 11, x + 11, y + 11), fill=ink)
        elif style == "roman":
            ray(tick * 6.0, 0.90, 0.95, 5 if is_hour else 2)
            if is_hour:
                x, y = (
                    middle + 0.74 * middle * math.sin(math.radians(tick * 6)),
                    middle - 0.74 * middle * math.cos(math.radians(tick * 6)),
                )
                draw.text(
                    (x, y), _NUMERALS[tick // 5], fill=ink, font=ImageFont.load_default(40), anchor="mm", stroke_width=1
                )
    ray((hour + minute / 60.0) * 30.0, -0.10, 0.50, 17)
    ray(minute * 6.0, -0.12, 0.76, 11)
    if style != "roman":
        ray(213.0, -0.18, 0.80, 4, "#b3261e")
    draw.ellipse((middle - 14, middle - 14, middle + 14, middle + 14), fill=ink)
    return base_color(np.asarray(sheet, float) / 255.0, diameter_m, diameter_m)
