"""Printed things: book jackets, magazine covers, page edges, a clock's dial. Each covers its object once."""

import math
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tools.household.model import Texture
from tools.household.textures.encode import base_color
from tools.household.textures.noise import Color, cloud, hex_color

_TITLES = (
    ("The Quiet Harbour", "Ines Aldana"),
    ("Maps of the Interior", "J. Okafor"),
    ("A Field of Clocks", "R. Lindqvist"),
    ("Salt & Timber", "Mara Whitlock"),
    ("On Looking Twice", "Teo Marchetti"),
    ("The Long Kitchen", "Adela Ruiz"),
    ("Small Machines", "H. Tanaka"),
    ("Letters to the Coast", "Anna Brandt"),
    ("North Light", "Per Solheim"),
    ("The Gardener's Year", "E. Hawthorn"),
    ("Rooms", "Odile Perrin"),
    ("Winter Atlas", "K. Novak"),
)
_MASTHEADS = ("FORMA", "Kitchen", "OUTSIDE", "Atelier", "VOYAGE", "Habitat")


@dataclass(frozen=True)
class Palette:
    """The paper, ink and accent of a jacket, as web colours."""

    paper: str
    ink: str
    accent: str


PALETTES = (
    Palette("#1f3a4a", "#e9dcc0", "#c7683c"),
    Palette("#a8442d", "#f2e6d0", "#22303a"),
    Palette("#e5d8bd", "#2c2a28", "#9c3d2a"),
    Palette("#44593f", "#efe4cb", "#d6a94a"),
    Palette("#c08c34", "#2b2118", "#f3ead6"),
    Palette("#5b2f3c", "#ecd9c4", "#d08a5a"),
    Palette("#8fa3a3", "#1f2a30", "#f1ebdd"),
    Palette("#2b2b2f", "#d9cfbb", "#7e9a8c"),
)


def book_jacket(
    width_m: float, height_m: float, thickness_m: float, seed: int = 0, palette: Palette | None = None
) -> Texture:
    """A jacket opened flat: back cover, spine, front cover from left to right, `2 width + thickness` × height."""
    rng = np.random.default_rng(seed)
    colors = palette or PALETTES[seed % len(PALETTES)]
    title, author = _TITLES[seed % len(_TITLES)]
    rows = 384
    cover, spine = round(width_m / height_m * rows), max(8, round(thickness_m / height_m * rows))
    sheet = Image.new("RGB", (2 * cover + spine, rows), colors.paper)
    sheet.paste(_back((cover, rows), colors, rng), (0, 0))
    sheet.paste(_spine((spine, rows), title, author, colors), (cover, 0))
    sheet.paste(_front((cover, rows), title, author, colors, int(rng.integers(4))), (cover + spine, 0))
    return _worn(sheet, rng, 2.0 * width_m + thickness_m, height_m)


def magazine_cover(width_m: float = 0.21, height_m: float = 0.27, seed: int = 0) -> Texture:
    """A magazine's front: masthead, a picture, a few lines."""
    rng = np.random.default_rng(seed)
    colors = PALETTES[(seed * 3 + 3) % len(PALETTES)]
    rows = 512
    columns = round(width_m / height_m * rows)
    sheet = Image.new("RGB", (columns, rows), "#f0ece2")
    draw = ImageDraw.Draw(sheet)
    margin = columns // 16
    picture = (margin, rows // 5, columns - margin, rows - rows // 6)
    draw.rectangle(picture, fill=colors.paper)
    _scene(draw, picture, colors, rng)
    _write(draw, (margin, rows // 28, columns - margin, rows // 5.6), _MASTHEADS[seed % len(_MASTHEADS)], "#201d1a", 2)
    _lines(draw, (margin, rows - rows // 8, columns * 0.62, rows - rows // 22), "#55504a", 3)
    _write(
        draw,
        (columns * 0.7, rows - rows / 8, columns - margin, rows - rows / 14),
        f"No. {seed % 40 + 12}",
        "#201d1a",
        0,
    )
    return _worn(sheet, rng, width_m, height_m)


def pages(seed: int = 0) -> Texture:
    """The edge of a block of pages, sheets along u, 0.2 × 0.03 m."""
    rng = np.random.default_rng(seed)
    sheets = 1.0 + 0.05 * cloud((64, 256), rng, (0.8, 500.0)) + 0.015 * cloud((64, 256), rng, (8.0, 60.0))
    return base_color(np.asarray(hex_color("#e2d7bf")) * sheets[..., None], 0.2, 0.03)


def paper(color: Color = (0.93, 0.91, 0.86), seed: int = 0) -> Texture:
    """Uncoated paper, 0.2 × 0.2 m."""
    rng = np.random.default_rng(seed)
    tone = 1.0 + 0.008 * cloud((256, 256), rng, (3.0, 3.0)) + 0.008 * cloud((256, 256), rng, (80.0, 80.0))
    return base_color(np.asarray(color) * tone[..., None], 0.2, 0.2)


def clock_dial(diameter_m: float = 0.14, hour: int = 10, minute: int = 9) -> Texture:
    """A dial with numerals, minute track and printed hands at the given time; a square around the circle."""
    size = 1024
    middle = size / 2
    dial = Image.new("RGB", (size, size), "#e9e2d0")
    draw = ImageDraw.Draw(dial)
    ink = "#26241f"
    for tick in range(60):
        major = tick % 5 == 0
        _ray(draw, middle, tick * 6.0, 0.415 if major else 0.44, 0.47, size, 12 if major else 5, ink)
    font = ImageFont.load_default(108)
    for number in range(1, 13):
        angle = math.radians(number * 30.0)
        x, y = middle + 0.335 * size * math.sin(angle), middle - 0.335 * size * math.cos(angle)
        draw.text((x, y), str(number), fill=ink, font=font, anchor="mm", stroke_width=3, stroke_fill=ink)
    _write(draw, (middle - 110, middle + 120, middle + 110, middle + 165), "QUARTZ", "#7d7669", 0)
    _ray(draw, middle, hour % 12 * 30.0 + minute * 0.5, -0.05, 0.225, size, 30, ink)
    _ray(draw, middle, minute * 6.0, -0.06, 0.36, size, 20, ink)
    _ray(draw, middle, 210.0, -0.05, 0.26, size, 7, "#b5402c")
    draw.ellipse((middle - 26, middle - 26, middle + 26, middle + 26), fill=ink)
    return Texture(np.asarray(dial.resize((512, 512), Image.Resampling.LANCZOS)), diameter_m, diameter_m)


def bottle_label(width_m: float = 0.078, height_m: float = 0.06) -> Texture:
    """The label of a bottle of washing-up liquid."""
    rows = 320
    columns = round(width_m / height_m * rows)
    sheet = Image.new("RGB", (columns, rows), "#efe9da")
    draw = ImageDraw.Draw(sheet)
    draw.rectangle((0, 0, columns, rows * 0.05), fill="#44594f")
    draw.rectangle((0, rows * 0.95, columns, rows), fill="#44594f")
    _write(draw, (columns * 0.15, rows * 0.16, columns * 0.85, rows * 0.40), "KLAR", "#2b2a27", 3)
    _write(draw, (columns * 0.22, rows * 0.48, columns * 0.78, rows * 0.57), "washing-up liquid", "#2b2a27", 0)
    _write(draw, (columns * 0.36, rows * 0.64, columns * 0.64, rows * 0.71), "lemon & sage", "#7a6d3c", 0)
    _lines(draw, (columns * 0.36, rows * 0.79, columns * 0.64, rows * 0.90), "#77726a", 3)
    return Texture(np.asarray(sheet), width_m, height_m)


Box = tuple[float, float, float, float]


def _front(size: tuple[int, int], title: str, author: str, colors: Palette, layout: int) -> Image.Image:
    wide, high = size
    page = Image.new("RGB", size, colors.paper)
    draw = ImageDraw.Draw(page)
    margin = wide * 0.09
    if layout == 0:
        radius = wide * 0.30
        center = (wide / 2, high * 0.64)
        draw.ellipse(
            (center[0] - radius, center[1] - radius, center[0] + radius, center[1] + radius), fill=colors.accent
        )
        draw.rectangle((margin, high * 0.64, wide - margin, high * 0.65), fill=colors.ink)
    elif layout == 1:
        for band in range(7):
            top = high * (0.46 + band * 0.055)
            shade = colors.accent if band % 2 else colors.ink
            draw.rectangle((0, top, wide, top + high * (0.012 + 0.004 * band)), fill=shade)
    elif layout == 2:
        draw.rectangle((margin, margin, wide - margin, high - margin), outline=colors.accent, width=max(2, wide // 60))
        draw.polygon(
            [
                (wide * 0.2, high * 0.82),
                (wide * 0.45, high * 0.5),
                (wide * 0.62, high * 0.68),
                (wide * 0.7, high * 0.6),
                (wide * 0.85, high * 0.82),
            ],
            fill=colors.accent,
        )
    else:
        draw.rectangle((0, high * 0.62, wide, high), fill=colors.accent)
        radius = min(wide * 0.32, high * 0.22)
        disc = (wide / 2 - radius, high * 0.62 - radius, wide / 2 + radius, high * 0.62 + radius)
        draw.pieslice(disc, 180, 360, fill=colors.ink)
    words = title.split()
    half = (len(words) + 1) // 2
    first, second = " ".join(words[:half]), " ".join(words[half:])
    left, right = margin * 1.6, wide - margin * 1.6
    _write(draw, (left, high * 0.09, right, high * 0.19), first, colors.ink, 2)
    if second:
        _write(draw, (left, high * 0.20, right, high * 0.30), second, colors.ink, 2)
    _write(draw, (left, high * 0.88, right, high * 0.93), author, colors.ink if layout != 3 else colors.paper, 0)
    return page


def _spine(size: tuple[int, int], title: str, author: str, colors: Palette) -> Image.Image:
    """Text runs down the spine, as on books printed in English."""
    wide, high = size
    strip = Image.new("RGB", (high, wide), colors.paper)
    draw = ImageDraw.Draw(strip)
    draw.rectangle((high * 0.03, 0, high * 0.055, wide), fill=colors.accent)
    draw.rectangle((high * 0.945, 0, high * 0.97, wide), fill=colors.accent)
    _write(draw, (high * 0.09, wide * 0.22, high * 0.62, wide * 0.78), title, colors.ink, 1)
    _write(draw, (high * 0.66, wide * 0.32, high * 0.92, wide * 0.68), author, colors.ink, 0)
    return strip.transpose(Image.Transpose.ROTATE_270)


def _back(size: tuple[int, int], colors: Palette, rng: np.random.Generator) -> Image.Image:
    wide, high = size
    page = Image.new("RGB", size, colors.paper)
    draw = ImageDraw.Draw(page)
    _lines(draw, (wide * 0.14, high * 0.12, wide * 0.86, high * 0.42), colors.ink, 9)
    code = (wide * 0.60, high * 0.82, wide * 0.88, high * 0.92)
    draw.rectangle(code, fill="#f5f2ea")
    x = code[0] + 4
    while x < code[2] - 6:
        bar = float(rng.integers(1, 4))
        draw.rectangle((x, code[1] + 4, x + bar - 1, code[3] - 4), fill="#1c1b1a")
        x += bar + float(rng.integers(1, 4))
    return page


def _scene(draw: ImageDraw.ImageDraw, box: Box, colors: Palette, rng: np.random.Generator) -> None:
    """A sun over two ridges: the picture on a magazine."""
    left, top, right, bottom = box
    wide, high = right - left, bottom - top
    x, y, radius = left + wide * rng.uniform(0.3, 0.7), top + high * 0.34, wide * 0.16
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colors.accent)
    for level, shade in ((0.55, colors.ink), (0.72, colors.accent)):
        ridge = [(left + wide * k / 12, top + high * (level + 0.07 * math.sin(k * 0.9 + level * 9))) for k in range(13)]
        draw.polygon([*ridge, (right, bottom), (left, bottom)], fill=shade)


def _lines(draw: ImageDraw.ImageDraw, box: Box, ink: str, count: int) -> None:
    """Text too small to read."""
    left, top, right, bottom = box
    step = (bottom - top) / count
    for line in range(count):
        end = right - (right - left) * (0.4 if line == count - 1 else 0.06 * (line * 7 % 3))
        draw.line((left, top + line * step, end, top + line * step), fill=ink, width=max(1, int(step * 0.35)))


def _write(draw: ImageDraw.ImageDraw, box: Box, text: str, ink: str, weight: int) -> None:
    """The text centred in the box, as large as fits."""
    left, top, right, bottom = box
    reference = ImageFont.load_default(100.0)
    x0, y0, x1, y1 = reference.getbbox(text, stroke_width=weight)
    size = 100.0 * min((right - left) / (x1 - x0), (bottom - top) / (y1 - y0))
    font = ImageFont.load_default(max(4.0, size))
    stroke = round(weight * size / 60.0)
    draw.text(((left + right) / 2, (top + bottom) / 2), text, fill=ink, font=font, anchor="mm", stroke_width=stroke)


def _ray(
    draw: ImageDraw.ImageDraw,
    middle: float,
    angle_deg: float,
    start: float,
    end: float,
    size: int,
    width: int,
    ink: str,
) -> None:
    dx, dy = math.sin(math.radians(angle_deg)) * size, -math.cos(math.radians(angle_deg)) * size
    draw.line((middle + start * dx, middle + start * dy, middle + end * dx, middle + end * dy), fill=ink, width=width)


def _worn(sheet: Image.Image, rng: np.random.Generator, width_m: float, height_m: float) -> Texture:
    """Paper grain, and edges a little rubbed."""
    rgb = np.asarray(sheet, dtype=np.float64) / 255.0
    shape = rgb.shape[:2]
    row, column = np.indices(shape)
    edge = np.minimum.reduce([row, shape[0] - 1 - row, column, shape[1] - 1 - column])
    rubbed = np.clip(1.0 - edge / 5.0, 0.0, 1.0) * np.clip(0.5 + 0.5 * cloud(shape, rng, (14.0, 14.0)), 0.0, 1.0)
    rgb = rgb * (1.0 + 0.015 * cloud(shape, rng, (2.0, 2.0)))[..., None]
    return base_color(rgb + (0.86 - rgb) * (0.5 * rubbed)[..., None], width_m, height_m)
