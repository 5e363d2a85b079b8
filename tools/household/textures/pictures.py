"""Pictures for the wall; each covers its sheet once."""

import math

import numpy as np
from PIL import Image, ImageDraw

from tools.household.model import Texture
from tools.household.textures.encode import base_color
from tools.household.textures.noise import Field, cloud, gradient, hex_color, mix, smoothstep

_LONGEST_PX = 512
_FERN = ("#4f6b43", "#5f7a4c", "#43603f", "#6d8455")
_GEOMETRIC = (
    ("#d9694a", "#f0d9b5", "#2f4858", "#86a397"),
    ("#1f3044", "#e0b64a", "#f3ede0", "#a8b8c4"),
    ("#7a3b4a", "#e7c9b5", "#4f6b5a", "#f2ece2"),
    ("#2b2b2b", "#efe9dd", "#b5b0a5", "#c98f4e"),
)
_EUCALYPTUS = ("#7d8f7c", "#6c8273", "#8b9a86", "#5f7668")


def landscape(width_m: float = 0.6, height_m: float = 0.4, seed: int = 0) -> Texture:
    """A painting of misty ridges under a low sun."""
    rng = np.random.default_rng(seed)
    shape = _shape(width_m, height_m)
    u, v = _grid(shape)
    sky = gradient(v, [(0.0, hex_color("#8fa7b0")), (0.35, hex_color("#d9c9ac")), (0.6, hex_color("#e8b988"))])
    sun = smoothstep(0.062, 0.054, np.hypot((u - 0.66) * width_m / height_m, v - 0.36))
    picture = mix(sky, hex_color("#f6e3bd"), sun)
    ridges = ("#a9aca3", "#8a979a", "#657a80", "#475c5e", "#33443f")
    for level, code in enumerate(ridges):
        crest = 0.46 + 0.105 * level + (0.055 - 0.004 * level) * _ridge(u, rng)
        mist = smoothstep(0.26, 0.0, v - crest) * 0.10
        below = smoothstep(-0.004, 0.004, v - crest)
        shade = np.asarray(hex_color(code)) * (1.0 - mist + 0.16 * smoothstep(0.0, 0.3, v - crest))[..., None]
        picture = mix(picture, shade, below)
    return base_color(picture * _brush(shape, rng)[..., None], width_m, height_m)


def abstract(width_m: float = 0.4, height_m: float = 0.5, seed: int = 0) -> Texture:
    """Cut paper in earth colours: an arch, balanced stones or a moon over hills, by the seed."""
    rng = np.random.default_rng(seed)
    sheet, draw, (wide, high) = _sheet(width_m, height_m, "#ece3d2")
    (_arch, _stones, _moon)[seed % 3](draw, wide, high)
    rgb = _pixels(sheet)
    shape = rgb.shape[:2]
    tooth = 1.0 + 0.02 * cloud(shape, rng, (2.0, 2.0)) + 0.015 * cloud(shape, rng, (60.0, 60.0))
    return base_color(rgb * tooth[..., None], width_m, height_m)


def botanical(width_m: float = 0.3, height_m: float = 0.4, seed: int = 0) -> Texture:
    """A herbarium print on ivory paper: a fern or, every other seed pair, a round-leaved branch."""
    rng = np.random.default_rng(seed)
    sheet, draw, (wide, high) = _sheet(width_m, height_m, "#efe8d8")
    round_leaved = seed % 4 >= 2
    greens = (
        ("#7d8f7c", "#6c8273", "#8b9a86", "#5f7668") if round_leaved else ("#4f6b43", "#5f7a4c", "#43603f", "#6d8455")
    )
    stem = [(wide * (0.5 + 0.06 * math.sin(2.2 * t)), high * (0.90 - 0.76 * t)) for t in np.linspace(0.0, 1.0, 60)]
    for (x0, y0), (x1, y1), t in zip(stem, stem[1:], np.linspace(0.0, 1.0, 59), strict=False):
        draw.line((x0, y0, x1, y1), fill="#5a5237", width=max(2, int(7 * (1.1 - t))))
    step, fullness = (6, 0.30) if round_leaved else (3, 0.10)
    for k in range(8, 60, step):
        t = k / 59.0
        length = wide * (0.24 if round_leaved else 0.34) * math.sin(math.pi * (0.18 + 0.80 * t)) ** 0.9
        for side in (-1.0, 1.0):
            lean = math.radians(38.0 + rng.uniform(-5.0, 5.0))
            toward = (side * math.cos(lean), -math.sin(lean))
            draw.polygon(_leaf(stem[k], toward, length, fullness), fill=greens[int(rng.integers(4))])
    rgb = _pixels(sheet)
    foxing = 1.0 - 0.03 * smoothstep(0.5, 2.0, cloud(rgb.shape[:2], rng, (60.0, 60.0)))
    return base_color(rgb * foxing[..., None], width_m, height_m)


def geometric(width_m: float = 0.4, height_m: float = 0.4, seed: int = 0) -> Texture:
    """Quarter circles, discs and halves on a grid of coloured squares; count and colours by the seed."""
    rng = np.random.default_rng(seed + 1000)
    sheet, draw, (wide, high) = _sheet(width_m, height_m, "#efe8d8")
    colors = _GEOMETRIC[seed % len(_GEOMETRIC)]
    count = 3 + seed % 3
    step_x, step_y = wide / count, high / count
    for column in range(count):
        for row in range(count):
            x, y = column * step_x, row * step_y
            ground, shape = (colors[i] for i in rng.permutation(len(colors))[:2])
            draw.rectangle((x, y, x + step_x, y + step_y), fill=ground)
            match int(rng.integers(4)):
                case 0:
                    right, below = (int(value) for value in rng.integers(0, 2, 2))
                    left, top = x + (right - 1) * step_x, y + (below - 1) * step_y
                    # Angles run clockwise from the right; the arc's middle is a corner of the square.
                    start = ((0, 90), (270, 180))[below][right]
                    draw.pieslice((left, top, left + 2 * step_x, top + 2 * step_y), start, start + 90, fill=shape)
                case 1:
                    margin = 0.18 * step_x
                    draw.ellipse((x + margin, y + margin, x + step_x - margin, y + step_y - margin), fill=shape)
                case 2:
                    draw.polygon([(x, y), (x + step_x, y + step_y), (x, y + step_y)], fill=shape)
    rgb = _pixels(sheet)
    tooth = 1.0 + 0.02 * cloud(rgb.shape[:2], rng, (2.0, 2.0))
    return base_color(rgb * tooth[..., None], width_m, height_m)


def _arch(draw: ImageDraw.ImageDraw, wide: float, high: float) -> None:
    """Nested arches on a ground line, a sprig and a sun."""
    unit = min(wide, high)
    _disc(draw, wide * 0.52 + unit * 0.15, high * 0.10 + unit * 0.15, unit * 0.15, "#c2703d")
    for ring, code in enumerate(("#7a3b2a", "#ece3d2", "#b9883f", "#ece3d2", "#44584f")):
        radius = unit * (0.40 - 0.07 * ring)
        x, y = wide * 0.44, high * 0.80
        draw.pieslice((x - radius, y - radius, x + radius, y + radius), 180, 360, fill=code)
    draw.rectangle((wide * 0.12, high * 0.80, wide * 0.90, high * 0.815), fill="#2e2b28")
    stem = [(wide * 0.20, high * 0.80), (wide * 0.19, high * 0.58), (wide * 0.23, high * 0.36)]
    draw.line(stem, fill="#2e2b28", width=max(3, int(unit * 0.010)))
    for k in range(7):
        t = k / 6.0
        side = 1.0 if k % 2 else -1.0
        foot = (wide * (0.19 + 0.04 * t**2), high * (0.62 - 0.28 * t))
        draw.polygon(_leaf(foot, (0.86 * side, -0.5), unit * (0.15 - 0.06 * t), 0.18), fill="#5c7060")


def _stones(draw: ImageDraw.ImageDraw, wide: float, high: float) -> None:
    """A tower of pebbles before a half-hidden sun."""
    unit = min(wide, high)
    _disc(draw, wide * 0.64, high * 0.36, unit * 0.27, "#d9a25c")
    draw.rectangle((wide * 0.14, high * 0.845, wide * 0.86, high * 0.86), fill="#2e2b28")
    bottom = high * 0.845
    for across, tall, shift, code in (
        (0.62, 0.15, 0.0, "#3f4f4a"),
        (0.46, 0.13, -0.03, "#a8573a"),
        (0.36, 0.12, 0.02, "#7d8b84"),
        (0.25, 0.10, -0.01, "#c9b18c"),
        (0.14, 0.08, 0.01, "#5a3a30"),
    ):
        x, half = wide * (0.46 + shift), unit * across / 2
        draw.ellipse((x - half, bottom - unit * tall, x + half, bottom), fill=code)
        bottom -= unit * tall * 0.97


def _moon(draw: ImageDraw.ImageDraw, wide: float, high: float) -> None:
    """A crescent over overlapping hills."""
    unit = min(wide, high)
    draw.rectangle((wide * 0.10, high * 0.08, wide * 0.90, high * 0.92), fill="#33484d")
    _disc(draw, wide * 0.58, high * 0.27, unit * 0.14, "#ead9b0")
    _disc(draw, wide * 0.535, high * 0.245, unit * 0.125, "#33484d")
    for x, y, across, code in (
        (0.30, 0.70, 0.62, "#7b8c80"),
        (0.72, 0.74, 0.66, "#b0694a"),
        (0.40, 0.88, 0.84, "#c99a5b"),
    ):
        half = wide * across / 2
        draw.pieslice((wide * x - half, high * y - half, wide * x + half, high * y + half), 180, 360, fill=code)
        draw.rectangle((wide * x - half, high * y, wide * x + half, high * 0.92), fill=code)
    draw.rectangle((0, 0, wide * 0.10, high), fill="#ece3d2")
    draw.rectangle((wide * 0.90, 0, wide, high), fill="#ece3d2")
    draw.rectangle((0, high * 0.92, wide, high), fill="#ece3d2")


def _disc(draw: ImageDraw.ImageDraw, x: float, y: float, radius: float, code: str) -> None:
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=code)


def _leaf(
    foot: tuple[float, float], toward: tuple[float, float], length: float, fullness: float
) -> list[tuple[float, float]]:
    """The outline of a leaf on paper; `fullness` is half its width by its length."""
    (x, y), (dx, dy) = foot, toward
    outline: list[tuple[float, float]] = []
    for t in np.concatenate([np.linspace(0.0, 1.0, 9), np.linspace(1.0, 0.0, 9)[1:-1]]):
        side = 1.0 if len(outline) < 9 else -1.0
        across = side * fullness * length * math.sin(math.pi * t**0.8)
        outline.append((x + dx * length * t - dy * across, y + dy * length * t + dx * across))
    return outline


def _sheet(width_m: float, height_m: float, paper: str) -> tuple[Image.Image, ImageDraw.ImageDraw, tuple[float, float]]:
    """A sheet at twice the final resolution, a pen for it, and its size."""
    rows, columns = _shape(width_m, height_m)
    sheet = Image.new("RGB", (2 * columns, 2 * rows), paper)
    return sheet, ImageDraw.Draw(sheet), (2.0 * columns, 2.0 * rows)


def _pixels(sheet: Image.Image) -> Field:
    """The drawn sheet at its final resolution, in 0–1."""
    half = (sheet.width // 2, sheet.height // 2)
    return np.asarray(sheet.resize(half, Image.Resampling.LANCZOS), dtype=np.float64) / 255.0


def _shape(width_m: float, height_m: float) -> tuple[int, int]:
    scale = _LONGEST_PX / max(width_m, height_m)
    return round(height_m * scale), round(width_m * scale)


def _grid(shape: tuple[int, int]) -> tuple[Field, Field]:
    row, column = np.indices(shape)
    return (column + 0.5) / shape[1], (row + 0.5) / shape[0]


def _ridge(u: Field, rng: np.random.Generator) -> Field:
    phases = rng.uniform(0.0, 2.0 * math.pi, 5)
    return np.asarray(
        sum(math.pow(0.55, k) * np.sin(2.0 * math.pi * u * (1.1 + 1.9 * k) + phases[k]) for k in range(5))
    )


def _brush(shape: tuple[int, int], rng: np.random.Generator) -> Field:
    return 1.0 + 0.035 * cloud(shape, rng, (2.2, 34.0)) + 0.02 * cloud(shape, rng, (3.0, 3.0))
