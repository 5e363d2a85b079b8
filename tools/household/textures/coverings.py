"""Coverings of floors, walls and ceilings: carpet, tiles, brick, wallpaper, linoleum, concrete, panels.

Those that are called undyed are nearly white, to be coloured by the material's factor.
"""

import numpy as np

from tools.household.model import Texture
from tools.household.textures.encode import base_color, normals
from tools.household.textures.noise import Color, Field, blur, cloud, hex_color, mix, smoothstep

_CARPET_M, _FLOOR_TILES_M, _BRICK_M = 0.4, 1.2, 1.0


def carpet(seed: int = 0) -> Texture:
    """Undyed looped pile, 0.4 × 0.4 m."""
    pile, rng = _pile(seed)
    heather = 0.03 * cloud(pile.shape, rng, (2.0, 2.0)) + 0.02 * cloud(pile.shape, rng, (60.0, 60.0))
    shade = np.clip(0.88 + 0.06 * pile + heather, 0.0, 1.0)
    return base_color(np.repeat(shade[..., None], 3, axis=2), _CARPET_M, _CARPET_M)


def carpet_normal(seed: int = 0) -> Texture:
    """The loops of `carpet(seed)`."""
    return normals(0.0012 * _pile(seed)[0], _CARPET_M, _CARPET_M)


def _pile(seed: int) -> tuple[Field, np.random.Generator]:
    rng = np.random.default_rng(seed)
    return np.tanh(cloud((256, 256), rng, (3.0, 3.0), 0.15)), rng


def floor_tiles(seed: int = 0) -> Texture:
    """Undyed stoneware tiles of 0.3 m, 1.2 × 1.2 m."""
    rng = np.random.default_rng(seed)
    edge, tile = _squares(512, 4)
    tone = 1.0 + 0.025 * rng.standard_normal(16)[tile]
    veins = 0.010 * cloud(edge.shape, rng, (30.0, 40.0), 0.5) + 0.008 * cloud(edge.shape, rng, (3.0, 3.0))
    glaze = 0.93 * (tone + veins)[..., None] * np.array([1.0, 0.995, 0.985])
    grout = np.array(hex_color("#a9a49b")) * (1.0 + 0.04 * cloud(edge.shape, rng, (3.0, 3.0)))[..., None]
    return base_color(mix(grout, glaze, smoothstep(0.6, 1.6, edge)), _FLOOR_TILES_M, _FLOOR_TILES_M)


def floor_tiles_normal() -> Texture:
    """The sunken joints of `floor_tiles`."""
    edge, _ = _squares(512, 4)
    return normals(blur(0.0012 * smoothstep(0.2, 2.6, edge), 0.5), _FLOOR_TILES_M, _FLOOR_TILES_M)


def _squares(size_px: int, count: int) -> tuple[Field, np.ndarray]:
    """Distance in pixels to the nearest joint, and each pixel's tile; joints stay clear of the image's edges."""
    pitch = size_px / count
    row, column = (np.indices((size_px, size_px)) + 0.5 + pitch / 2) % size_px
    u, v = column % pitch, row % pitch
    tile = np.floor(row / pitch) * count + np.floor(column / pitch)
    return np.minimum.reduce([u, pitch - u, v, pitch - v]), tile.astype(np.intp)


def ceiling_panels(seed: int = 0) -> Texture:
    """Mineral-fibre panels of 0.6 m in a white grid, 1.2 × 1.2 m."""
    rng = np.random.default_rng(seed)
    edge, _ = _squares(512, 2)
    pores = smoothstep(1.7, 2.4, cloud(edge.shape, rng, (1.6, 1.6)))
    panel = (0.90 - 0.10 * pores + 0.01 * cloud(edge.shape, rng, (80.0, 80.0)))[..., None] * np.ones(3)
    grid = mix(hex_color("#8d8d8b"), hex_color("#f1f1ee"), smoothstep(5.2, 3.6, edge))
    return base_color(mix(grid, panel, smoothstep(5.0, 6.2, edge)), 1.2, 1.2)


def brick(seed: int = 0) -> Texture:
    """Red stock bricks of 0.25 × 0.0833 m with their joints, in running bond, 1 × 1 m."""
    rng = np.random.default_rng(seed)
    edge, number = _bricks()
    tones = np.array([hex_color(code) for code in ("#b8765a", "#a96a50", "#c08468", "#9d6350", "#c99277")])
    burnt = tones[rng.integers(0, len(tones), number.max() + 1)][number]
    grit = 1.0 + 0.07 * cloud(edge.shape, rng, (2.0, 2.0)) + 0.06 * cloud(edge.shape, rng, (12.0, 18.0))
    mortar = np.array(hex_color("#cfc8bb")) * (1.0 + 0.06 * cloud(edge.shape, rng, (2.5, 2.5)))[..., None]
    return base_color(mix(mortar, burnt * grit[..., None], smoothstep(2.2, 3.6, edge)), _BRICK_M, _BRICK_M)


def brick_normal(seed: int = 0) -> Texture:
    """The raked joints and the rough faces of `brick`."""
    edge, _ = _bricks()
    rough = cloud(edge.shape, np.random.default_rng(seed), (3.0, 3.0), 0.3)
    return normals(0.006 * smoothstep(1.2, 4.2, edge) + 0.0004 * rough, _BRICK_M, _BRICK_M)


def _bricks() -> tuple[Field, np.ndarray]:
    size, columns, rows = 512, 4, 12
    wide, high = size / columns, size / rows
    row, column = np.indices((size, size)) + 0.5
    course = np.floor((row + high / 2) % size / high)
    along = (column + wide / 4 + (course % 2) * wide / 2) % size
    u, v = along % wide, (row + high / 2) % high
    number = course * columns + np.floor(along / wide)
    return np.minimum.reduce([u, wide - u, v, high - v]), number.astype(np.intp)


def linoleum(seed: int = 0) -> Texture:
    """Marbled sheet flooring, grey-green, 0.8 × 0.8 m."""
    rng = np.random.default_rng(seed)
    marble = 0.5 + 0.20 * cloud((256, 256), rng, (3.0, 6.0), 0.35)
    color = mix(hex_color("#a9b1a6"), hex_color("#c3c8bc"), np.clip(marble, 0.0, 1.0))
    return base_color(color, 0.8, 0.8)


def concrete(seed: int = 0) -> Texture:
    """Trowelled concrete with pores, 2 × 2 m."""
    rng = np.random.default_rng(seed)
    shape = (512, 512)
    clouds = 0.018 * cloud(shape, rng, (60.0, 90.0), 0.5) + 0.012 * cloud(shape, rng, (2.0, 2.0))
    pores = 0.25 * smoothstep(3.0, 3.6, cloud(shape, rng, (2.2, 2.2)))
    shade = 0.74 * (1.0 + clouds) * (1.0 - pores)
    return base_color(shade[..., None] * np.array([1.0, 0.99, 0.965]), 2.0, 2.0)


def wallpaper_stripes(ground: Color, stripe: Color, seed: int = 0) -> Texture:
    """Printed paper with a broad and a fine stripe, 0.24 × 0.24 m."""
    rng = np.random.default_rng(seed)
    u = (np.arange(256)[None, :] + 0.5) / 256 * np.ones((256, 1))
    broad = smoothstep(0.175, 0.18, u) * smoothstep(0.505, 0.50, u)
    fine = smoothstep(0.69, 0.695, u) * smoothstep(0.72, 0.715, u)
    tooth = 1.0 + 0.012 * cloud((256, 256), rng, (2.0, 2.0))
    return base_color(mix(ground, stripe, np.maximum(broad, fine)) * tooth[..., None], 0.24, 0.24)


def wallpaper_leaves(ground: Color, leaf: Color, seed: int = 0) -> Texture:
    """Printed paper with scattered leaves, 0.6 × 0.6 m."""
    rng = np.random.default_rng(seed)
    ink = np.zeros((512, 512))
    for number in range(18):
        column, row = divmod(number, 3)
        x = (column + 0.5) * 512 / 6 + rng.uniform(-9.0, 9.0)
        y = (row + (0.25 if column % 2 else 0.75)) * 512 / 3 + rng.uniform(-14.0, 14.0)
        tilt = np.radians((48.0 if column % 2 else -42.0) + rng.uniform(-16.0, 16.0))
        ink = np.maximum(ink, rng.uniform(0.45, 1.0) * _leaf(x, y, float(tilt), float(rng.uniform(44.0, 58.0))))
    tooth = 1.0 + 0.010 * cloud((512, 512), rng, (2.0, 2.0))
    return base_color(mix(ground, leaf, ink) * tooth[..., None], 0.6, 0.6)


def _leaf(x: float, y: float, tilt: float, length_px: float) -> Field:
    """A pointed leaf with midrib and side veins left blank, on a stalk; its middle is at (x, y) pixels."""
    row, column = np.indices((512, 512)) + 0.5
    right, up = (column - x + 256) % 512 - 256, -((row - y + 256) % 512 - 256)
    along = right * np.sin(tilt) + up * np.cos(tilt)
    across = right * np.cos(tilt) - up * np.sin(tilt)
    t = along / length_px
    half = 0.36 * length_px * np.clip(1.0 - (2.0 * np.abs(t) + 0.25 * t) ** 1.7, 0.0, None)
    blade = smoothstep(-0.7, 0.9, half - np.abs(across))
    rib = smoothstep(1.5, 0.7, np.abs(across))
    vein = smoothstep(0.9, 0.4, np.abs((along - 0.75 * np.abs(across)) % 9.0 - 4.5))
    stalk = smoothstep(1.6, 0.8, np.abs(across)) * (t < -0.3) * (t > -0.78)
    return np.asarray(np.maximum(blade * (1.0 - 0.85 * np.maximum(rib, 0.6 * vein)), stalk))
