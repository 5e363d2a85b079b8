"""Pictures on screens and keys; each covers its face once."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tools.household.model import Texture
from tools.household.textures.encode import base_color

_ICONS = ("#e4572e", "#2e86ab", "#f3a712", "#5b8e7d", "#a23b72", "#4a6fa5", "#c44536", "#6a994e")
_ROWS = ("1234567890-=", "QWERTYUIOP[]", "ASDFGHJKL;'", "ZXCVBNM,./")


def desktop(width_m: float, height_m: float, seed: int = 0) -> Texture:
    """A desktop: wallpaper of soft bands, a window with text or a chart, a row of icons."""
    rng = np.random.default_rng(seed)
    sheet, draw, (wide, high) = _screen(width_m, height_m, 512)
    _bands(draw, wide, high, rng, seed)
    left, top = wide * (0.10 + 0.06 * (seed % 3)), high * 0.12
    draw.rectangle((left, top, left + wide * 0.62, top + high * 0.66), fill="#f5f5f2")
    draw.rectangle((left, top, left + wide * 0.62, top + high * 0.06), fill="#3d4450")
    if seed % 2:
        _chart(draw, left, top, wide, high, rng)
    else:
        _text(draw, left, top, wide, high, rng)
    _icons(draw, wide, high, seed)
    return _texture(sheet, width_m, height_m)


def wallpaper(width_m: float, height_m: float, seed: int = 0) -> Texture:
    """A desktop without windows: mountains under a clear sky, a row of icons."""
    sheet, draw, (wide, high) = _screen(width_m, height_m, 512)
    _gradient(draw, wide, 0, high * 0.6, "#b8d4e8", "#5f93c2")
    _mountains(draw, wide, high, np.random.default_rng(seed))
    _icons(draw, wide, high, seed)
    return _texture(sheet, width_m, height_m)


def film(width_m: float, height_m: float, seed: int = 0) -> Texture:
    """A still of a film: a sea, a mountain range or a football field."""
    rng = np.random.default_rng(seed)
    sheet, draw, (wide, high) = _screen(width_m, height_m, 512)
    skies = (("#f2c48d", "#7fa8c9"), ("#b8d4e8", "#5f93c2"), ("#9ec6e6", "#cfe3f0"))
    _gradient(draw, wide, 0, high * 0.6, *skies[seed % 3])
    if seed % 3 == 0:
        draw.ellipse((wide * 0.62, high * 0.40, wide * 0.74, high * 0.40 + wide * 0.12), fill="#fff1cf")
        _gradient(draw, wide, high * 0.56, high, "#c98f5f", "#1f4a63")
        for _ in range(60):
            x, y = rng.uniform(0, wide), rng.uniform(high * 0.58, high)
            draw.line((x, y, x + wide * 0.07, y), fill="#e8c39a", width=2)
    elif seed % 3 == 1:
        _mountains(draw, wide, high, rng)
    else:
        draw.rectangle((0, high * 0.42, wide, high), fill="#3f8a3f")
        for index in range(8):
            draw.rectangle((wide * index / 8, high * 0.42, wide * (index + 0.5) / 8, high), fill="#479647")
        draw.line((wide * 0.5, high * 0.42, wide * 0.5, high), fill="#f0f0f0", width=4)
        draw.ellipse((wide * 0.36, high * 0.6, wide * 0.64, high * 0.85), outline="#f0f0f0", width=4)
        for index in range(14):
            x, y = rng.uniform(0.05, 0.95) * wide, rng.uniform(0.45, 0.92) * high
            draw.rectangle((x, y, x + 8, y + 22), fill=("#c0392b", "#f4f4f4")[index % 2])
    return _texture(sheet, width_m, height_m)


def phone_screen(width_m: float, height_m: float, seed: int = 0) -> Texture:
    """A telephone's home screen: clock, icons in a grid, a dock."""
    rng = np.random.default_rng(seed)
    sheet, draw, (wide, high) = _screen(width_m, height_m, 256)
    _bands(draw, wide, high, rng, seed + 3)
    draw.text(
        (wide / 2, high * 0.13),
        ("09:41", "18:05", "12:30")[seed % 3],
        fill="#ffffff",
        font=ImageFont.load_default(wide * 0.22),
        anchor="mm",
    )
    for row in range(5):
        for column in range(4):
            if row == 3:
                continue
            x, y = wide * (0.08 + 0.225 * column), high * (0.28 + 0.13 * row)
            draw.rounded_rectangle(
                (x, y, x + wide * 0.16, y + wide * 0.16), wide * 0.04, fill=_ICONS[int(rng.integers(8))]
            )
    return _texture(sheet, width_m, height_m)


def led_digits(width_m: float, height_m: float, text: str = "7:24") -> Texture:
    """Red digits on black."""
    sheet, draw, (wide, high) = _screen(width_m, height_m, 256)
    draw.text(
        (wide / 2, high / 2),
        text,
        fill="#ff3b24",
        font=ImageFont.load_default(high * 0.75),
        anchor="mm",
        stroke_width=3,
    )
    return _texture(sheet, width_m, height_m)


def legends(width_m: float, height_m: float, ground: str, ink: str) -> Texture:
    """The letters of a keyboard's main block on plain keys, for `key_rows` of five rows by fifteen units."""
    sheet, draw, (wide, high) = _screen(width_m, height_m, 1024)
    draw.rectangle((0, 0, wide, high), fill=ground)
    font = ImageFont.load_default(high * 0.075)
    unit = wide / 15.0
    for row, (letters, offset) in enumerate(zip(_ROWS, (1.0, 1.5, 1.75, 2.25), strict=True)):
        for index, letter in enumerate(letters):
            draw.text((unit * (offset + index + 0.5), high * (row + 1.5) / 6), letter, fill=ink, font=font, anchor="mm")
    return _texture(sheet, width_m, height_m)


def _screen(width_m: float, height_m: float, longest: int) -> tuple[Image.Image, ImageDraw.ImageDraw, tuple[int, int]]:
    share = longest / max(width_m, height_m)
    size = (max(8, round(width_m * share)), max(8, round(height_m * share)))
    sheet = Image.new("RGB", size, "#101114")
    return sheet, ImageDraw.Draw(sheet), size


def _texture(sheet: Image.Image, width_m: float, height_m: float) -> Texture:
    return base_color(np.asarray(sheet, dtype=np.float64) / 255.0, width_m, height_m)


def _gradient(draw: ImageDraw.ImageDraw, wide: float, top: float, bottom: float, first: str, last: str) -> None:
    start, end = (np.array([int(code[k : k + 2], 16) for k in (1, 3, 5)]) for code in (first, last))
    for y in range(int(top), int(bottom) + 1):
        share = (y - top) / max(bottom - top, 1)
        red, green, blue = (int(value) for value in start + (end - start) * share)
        draw.line((0, y, wide, y), fill=(red, green, blue))


def _bands(draw: ImageDraw.ImageDraw, wide: float, high: float, rng: np.random.Generator, seed: int) -> None:
    palettes = (("#12355b", "#7d9cc0"), ("#5a2a4a", "#e08e6d"), ("#1f4d3f", "#a5c9a1"), ("#2b2d42", "#8d99ae"))
    first, last = palettes[seed % 4]
    _gradient(draw, wide, 0, high, first, last)
    x = np.linspace(0, wide, 20)
    for level in range(3):
        y = high * (0.45 + 0.18 * level) + high * 0.10 * np.sin(x / wide * rng.uniform(3, 7) + rng.uniform(0, 6))
        shade = tuple(
            int(value * (0.75 - 0.15 * level)) for value in (int(last[1:3], 16), int(last[3:5], 16), int(last[5:7], 16))
        )
        draw.polygon([(0, high), *zip(x, y, strict=True), (wide, high)], fill=(shade[0], shade[1], shade[2]))


def _mountains(draw: ImageDraw.ImageDraw, wide: float, high: float, rng: np.random.Generator) -> None:
    for level, code in enumerate(("#8ba4b8", "#5d7d8c", "#3c5b53", "#2a3f2f")):
        across = np.linspace(0, wide, 24)
        crest = high * (0.36 + 0.13 * level) + high * 0.09 * np.cumsum(rng.normal(0, 0.4, 24)) / 2
        draw.polygon([(0, high), *zip(across, crest, strict=True), (wide, high)], fill=code)


def _icons(draw: ImageDraw.ImageDraw, wide: float, high: float, seed: int) -> None:
    for index in range(7):
        x = wide * (0.22 + 0.085 * index)
        draw.rounded_rectangle(
            (x, high * 0.90, x + wide * 0.055, high * 0.90 + wide * 0.055), 6, fill=_ICONS[(index + seed) % 8]
        )


def _text(
    draw: ImageDraw.ImageDraw, left: float, top: float, wide: float, high: float, rng: np.random.Generator
) -> None:
    for line in range(13):
        y = top + high * (0.10 + 0.041 * line)
        length = wide * rng.uniform(0.25, 0.56) if line % 5 else wide * 0.2
        draw.line(
            (left + wide * 0.03, y, left + wide * 0.03 + length, y), fill="#3a3a3a" if line % 5 else "#2e86ab", width=4
        )


def _chart(
    draw: ImageDraw.ImageDraw, left: float, top: float, wide: float, high: float, rng: np.random.Generator
) -> None:
    for index in range(9):
        x, length = left + wide * (0.05 + 0.062 * index), high * rng.uniform(0.1, 0.45)
        draw.rectangle((x, top + high * 0.60 - length, x + wide * 0.04, top + high * 0.60), fill=_ICONS[index % 3])
    draw.line((left + wide * 0.03, top + high * 0.60, left + wide * 0.59, top + high * 0.60), fill="#444444", width=3)
