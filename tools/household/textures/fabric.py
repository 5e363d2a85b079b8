"""Cloth: linen, stripes, curtain, upholstery and a rug."""

import numpy as np

from tools.household.model import Texture
from tools.household.textures.encode import base_color, normals
from tools.household.textures.noise import Color, Field, blur, cloud, hex_color, mix, smoothstep

_LINEN_TILE_M = 0.32
_LINEN_PX = 512


def linen(color: Color = (0.87, 0.84, 0.78), seed: int = 0) -> Texture:
    """Plain-woven linen with slubs, 0.32 × 0.32 m."""
    weave, slubs = _linen_threads(seed)
    shade = 1.0 + 0.045 * (weave - 0.5) + 0.035 * slubs
    return base_color(np.asarray(color) * shade[..., None], _LINEN_TILE_M, _LINEN_TILE_M)


def linen_normal(seed: int = 0) -> Texture:
    """The threads of `linen(…, seed)`."""
    weave, slubs = _linen_threads(seed)
    return normals(0.00012 * weave + 0.00006 * slubs, _LINEN_TILE_M, _LINEN_TILE_M)


def striped_linen(ground: Color = (0.90, 0.88, 0.83), stripe: Color = (0.36, 0.44, 0.52), seed: int = 0) -> Texture:
    """Linen with grouped woven stripes along v, 0.32 × 0.32 m."""
    weave, slubs = _linen_threads(seed)
    shade = 1.0 + 0.045 * (weave - 0.5) + 0.035 * slubs
    u_m = (np.arange(_LINEN_PX) + 0.5) / _LINEN_PX * _LINEN_TILE_M
    within = u_m % (_LINEN_TILE_M / 4)
    wide = smoothstep(0.0, 0.0012, 0.0075 - np.abs(within - 0.040))
    fine = sum(smoothstep(0.0, 0.0008, 0.0016 - np.abs(within - centre)) for centre in (0.026, 0.054))
    weight = np.broadcast_to(np.clip(wide + fine, 0.0, 1.0) * 0.85, weave.shape)
    return base_color(mix(ground, stripe, weight) * shade[..., None], _LINEN_TILE_M, _LINEN_TILE_M)


def curtain(color: Color = (0.86, 0.82, 0.74), seed: int = 0) -> Texture:
    """Loosely woven curtain cloth, 0.32 × 0.32 m."""
    weave, slubs = _linen_threads(seed + 101)
    shade = 1.0 + 0.06 * (weave - 0.5) + 0.05 * slubs
    return base_color(np.asarray(color) * shade[..., None], _LINEN_TILE_M, _LINEN_TILE_M)


def boucle(color: Color = (0.55, 0.53, 0.48), seed: int = 0) -> Texture:
    """Looped upholstery wool, 0.2 × 0.2 m."""
    rng = np.random.default_rng(seed)
    loops = cloud((256, 256), rng, (7.0, 7.0), 0.15)
    melange = cloud((256, 256), rng, (2.0, 2.0))
    shade = 1.0 + 0.09 * np.tanh(loops) + 0.05 * melange
    return base_color(np.asarray(color) * shade[..., None], 0.2, 0.2)


def knit_throw(color: Color = (0.66, 0.40, 0.27), seed: int = 0) -> Texture:
    """A chunky herringbone throw, 0.24 × 0.24 m."""
    rng = np.random.default_rng(seed)
    size = 384
    row, column = np.indices((size, size)) / size
    zigzag = np.abs((column * 6.0) % 1.0 - 0.5) * 2.0
    strand = (row * 48.0 + zigzag * 4.0) % 1.0
    relief = np.sin(np.pi * strand)
    shade = 0.90 + 0.13 * relief + 0.03 * cloud((size, size), rng, (2.0, 6.0))
    pale = tuple(0.35 + 0.65 * channel for channel in color)
    band = smoothstep(0.42, 0.5, zigzag) * 0.18
    return base_color(mix(color, (pale[0], pale[1], pale[2]), band) * shade[..., None], 0.24, 0.24)


def rug(width_m: float = 2.0, height_m: float = 1.4, seed: int = 0) -> Texture:
    """A flat-woven wool rug with a lattice of diamonds and a banded border; covers the whole rug once."""
    rng = np.random.default_rng(seed)
    rows, columns = _rug_shape(width_m, height_m)
    row, column = np.indices((rows, columns))
    pixel_m = width_m / columns
    # Weavers count knots, so every outline is a staircase of 8 mm steps.
    knot_m = 0.008
    u = (np.floor(column * pixel_m / knot_m) + 0.5) * knot_m
    v = (np.floor(row * pixel_m / knot_m) + 0.5) * knot_m
    to_edge = np.minimum.reduce([u, width_m - u, v, height_m - v])

    ivory, charcoal = hex_color("#d6cab5"), hex_color("#4b4a4a")
    rust, ochre, blue = hex_color("#9d6449"), hex_color("#b3935f"), hex_color("#748488")
    color = np.broadcast_to(np.asarray(ivory), (rows, columns, 3)).copy()

    def paint(mask: np.ndarray, shade: Color) -> None:
        color[mask] = shade

    columns_of_diamonds = max(2, round((width_m - 0.44) / 0.30))
    rows_of_diamonds = max(2, round((height_m - 0.44) / 0.38))
    cell_u, cell_v = (width_m - 0.44) / columns_of_diamonds, (height_m - 0.44) / rows_of_diamonds
    a, b = (u - 0.22) / cell_u, (v - 0.22) / cell_v
    field = to_edge > 0.22
    diamond = np.abs(a % 1.0 - 0.5) + np.abs(b % 1.0 - 0.5)
    between = 1.0 - diamond
    odd = (np.floor(a) + np.floor(b)) % 2 == 0
    paint(field & (np.abs(diamond - 0.5) < 0.035), charcoal)
    paint(field & (diamond < 0.34) & odd, rust)
    paint(field & (diamond < 0.34) & ~odd, blue)
    paint(field & (diamond < 0.25), ivory)
    paint(field & (diamond < 0.16) & odd, charcoal)
    paint(field & (diamond < 0.16) & ~odd, rust)
    paint(field & (diamond < 0.07), ochre)
    paint(field & (between < 0.30), ochre)
    paint(field & (between < 0.20), ivory)
    paint(field & (between < 0.10), charcoal)

    paint(to_edge < 0.22, ivory)
    paint((to_edge > 0.196) & (to_edge < 0.22), charcoal)
    along = np.where(np.minimum(u, width_m - u) < np.minimum(v, height_m - v), v, u)
    tooth = np.abs((along / 0.096) % 1.0 - 0.5) * 2.0
    band = (to_edge > 0.07) & (to_edge < 0.18)
    paint(band, rust)
    paint(band & (np.abs(to_edge - 0.125) / 0.05 < tooth), ivory)
    paint(band & (np.abs(to_edge - 0.125) / 0.05 < tooth - 0.45), blue)
    paint((to_edge > 0.048) & (to_edge < 0.062), ochre)
    paint(to_edge < 0.032, charcoal)

    yarn = _yarn((rows, columns), rng)
    abrash = (
        1.0 + 0.05 * cloud((rows, columns), rng, (70.0, 900.0)) + 0.03 * cloud((rows, columns), rng, (200.0, 200.0))
    )
    worn = mix(color, np.asarray(ivory) * 0.93, 0.16 + 0.09 * np.tanh(cloud((rows, columns), rng, (160.0, 220.0))))
    return base_color(worn * (abrash * (0.93 + 0.10 * yarn))[..., None], width_m, height_m)


def rug_normal(width_m: float = 2.0, height_m: float = 1.4, seed: int = 0) -> Texture:
    """The ribs of the rug's weave; covers the whole rug once."""
    rng = np.random.default_rng(seed)
    return normals(0.0012 * _yarn(_rug_shape(width_m, height_m), rng), width_m, height_m)


def _rug_shape(width_m: float, height_m: float) -> tuple[int, int]:
    longest_px = 1024
    scale = longest_px / max(width_m, height_m)
    return round(height_m * scale), round(width_m * scale)


def _yarn(shape: tuple[int, int], rng: np.random.Generator) -> Field:
    row = np.arange(shape[0])[:, None]
    rib = 0.5 + 0.5 * np.cos(2.0 * np.pi * row / 4.0 + 0.4 * cloud(shape, rng, (6.0, 40.0)))
    return np.clip(0.6 * rib + 0.4 * (0.5 + 0.25 * cloud(shape, rng, (1.6, 5.0))), 0.0, 1.0)


def _linen_threads(seed: int) -> tuple[Field, Field]:
    rng = np.random.default_rng(seed)
    shape = (_LINEN_PX, _LINEN_PX)
    row, column = np.indices(shape)
    threads = _LINEN_PX // 4
    phase_u = 2.0 * np.pi * threads * column / _LINEN_PX + 0.9 * cloud(shape, rng, (90.0, 8.0))
    phase_v = 2.0 * np.pi * threads * row / _LINEN_PX + 0.9 * cloud(shape, rng, (8.0, 90.0))
    weave = 0.5 + 0.25 * (np.sin(phase_u) * np.sin(phase_v) + np.sin(phase_u + phase_v) * 0.3)
    slubs = cloud(shape, rng, (1.6, 80.0)) * 0.7 + cloud(shape, rng, (110.0, 1.6)) * 0.7
    return weave, blur(np.clip(slubs, -2.5, 2.5), 0.5)
