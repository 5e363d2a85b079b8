"""Hard surfaces: plaster, ceramic, glaze, tiles, metal, terracotta, soil, concrete."""

import numpy as np

from tools.household.model import Texture
from tools.household.textures.encode import base_color, normals
from tools.household.textures.noise import Color, Field, blur, cells, cloud, gradient, hex_color, mix, smoothstep

_PLASTER_TILE_M = 0.8
_TILES_TILE_M = 0.6


def plaster(color: Color = (0.91, 0.89, 0.85), seed: int = 0) -> Texture:
    """Rolled wall paint on plaster, barely mottled, 0.8 × 0.8 m."""
    rng = np.random.default_rng(seed)
    shape = (512, 512)
    mottle = 0.004 * cloud(shape, rng, (130.0, 130.0)) + 0.001 * cloud(shape, rng, (90.0, 14.0))
    shade = 1.0 + mottle + 0.003 * cloud(shape, rng, (2.5, 2.5))
    return base_color(np.asarray(color) * shade[..., None], _PLASTER_TILE_M, _PLASTER_TILE_M)


def plaster_normal(seed: int = 0) -> Texture:
    """The orange-peel stipple a paint roller leaves, 0.8 × 0.8 m."""
    rng = np.random.default_rng(seed)
    shape = (512, 512)
    stipple = np.tanh(cloud(shape, rng, (3.2, 3.2), 0.1))
    waves = cloud(shape, rng, (60.0, 60.0))
    return normals(0.00003 * stipple + 0.00018 * waves, _PLASTER_TILE_M, _PLASTER_TILE_M)


def ceramic(color: Color = (0.93, 0.92, 0.89), seed: int = 0) -> Texture:
    """White glazed ceramic with the faintest specks, 0.2 × 0.2 m."""
    rng = np.random.default_rng(seed)
    shape = (256, 256)
    shade = 1.0 + 0.006 * cloud(shape, rng, (60.0, 60.0)) - 0.05 * smoothstep(3.1, 3.5, cloud(shape, rng, (2.0, 2.0)))
    return base_color(np.asarray(color) * shade[..., None], 0.2, 0.2)


def stoneware(color: Color = (0.78, 0.74, 0.66), speck: Color = (0.36, 0.27, 0.20), seed: int = 0) -> Texture:
    """Matt speckled stoneware glaze, 0.2 × 0.2 m."""
    rng = np.random.default_rng(seed)
    shape = (512, 512)
    points = rng.uniform(0.0, 512.0, (1100, 2))
    distance, index = cells(shape, points)
    radius = rng.gamma(2.0, 0.40, len(points))[index]
    specks = smoothstep(-0.6, 0.6, radius - distance) * rng.uniform(0.25, 0.9, len(points))[index]
    shade = 1.0 + 0.022 * cloud(shape, rng, (70.0, 160.0)) + 0.012 * cloud(shape, rng, (6.0, 6.0))
    return base_color(mix(np.asarray(color) * shade[..., None], speck, specks), 0.2, 0.2)


def reactive_glaze(top: Color = (0.23, 0.34, 0.36), bottom: Color = (0.55, 0.60, 0.55), seed: int = 0) -> Texture:
    """Mottled pooling glaze of a studio pot, 0.25 × 0.25 m."""
    rng = np.random.default_rng(seed)
    shape = (512, 512)
    pooling = 0.5 + 0.22 * cloud(shape, rng, (60.0, 28.0), 0.12)
    crystal = smoothstep(1.5, 2.6, cloud(shape, rng, (2.4, 2.4))) * 0.22
    color = gradient(np.clip(pooling, 0.0, 1.0), [(0.0, top), (1.0, bottom)])
    return base_color(mix(color, (0.80, 0.80, 0.72), crystal), 0.25, 0.25)


def terracotta(seed: int = 0) -> Texture:
    """Unglazed fired clay with throwing rings and lime bloom, 0.3 × 0.3 m."""
    rng = np.random.default_rng(seed)
    shape = (512, 512)
    clay = gradient(
        0.5 + 0.18 * cloud(shape, rng, (80.0, 120.0), 0.05), [(0.0, hex_color("#935c44")), (1.0, hex_color("#b67f61"))]
    )
    rings = 1.0 + 0.018 * cloud(shape, rng, (4.0, 600.0)) + 0.015 * cloud(shape, rng, (2.0, 2.0))
    bloom = smoothstep(-0.2, 2.8, cloud(shape, rng, (70.0, 130.0), 0.6)) * 0.20
    return base_color(mix(clay * rings[..., None], hex_color("#d8c3ae"), bloom), 0.3, 0.3)


def soil(seed: int = 0) -> Texture:
    """Potting soil with bark and perlite, 0.15 × 0.15 m."""
    rng = np.random.default_rng(seed)
    shape = (256, 256)
    points = rng.uniform(0.0, 256.0, (700, 2))
    distance, index = cells(shape, points)
    lump = rng.uniform(0.0, 1.0, len(points))[index] * smoothstep(9.0, 0.0, distance)
    color = gradient(lump, [(0.0, hex_color("#1d140e")), (0.6, hex_color("#4a3524")), (1.0, hex_color("#6b5139"))])
    perlite = (rng.uniform(0.0, 1.0, len(points)) > 0.965)[index] * smoothstep(3.6, 2.6, distance)
    shade = 1.0 + 0.15 * cloud(shape, rng, (2.0, 2.0))
    return base_color(mix(color * shade[..., None], hex_color("#d9d4c6"), perlite), 0.15, 0.15)


def brushed_metal(color: Color = (0.74, 0.74, 0.73), seed: int = 0) -> Texture:
    """Brushed stainless steel, lines along u, 0.25 × 0.25 m."""
    rng = np.random.default_rng(seed)
    lines = 0.03 * cloud((512, 512), rng, (1.0, 200.0)) + 0.012 * cloud((512, 512), rng, (60.0, 100.0))
    return base_color(np.asarray(color) * (1.0 + lines)[..., None], 0.25, 0.25)


def brushed_metal_roughness(seed: int = 0) -> Texture:
    """Metallic-roughness map of `brushed_metal(…, seed)`: green roughness, blue metalness."""
    rng = np.random.default_rng(seed)
    rough = np.clip(0.33 + 0.04 * cloud((512, 512), rng, (1.0, 200.0)), 0.1, 0.7)
    return base_color(np.stack([np.ones_like(rough), rough, np.ones_like(rough)], axis=-1), 0.25, 0.25)


def tiles(color: Color = (0.86, 0.87, 0.84), grout: Color = (0.62, 0.60, 0.56), seed: int = 0) -> Texture:
    """Hand-made 0.15 × 0.075 m wall tiles in running bond, 0.6 × 0.6 m."""
    rng = np.random.default_rng(seed)
    edge, tile = _running_bond()
    tone = 1.0 + 0.02 * rng.standard_normal(tile.max() + 1)[tile]
    tint = 0.004 * rng.standard_normal((tile.max() + 1, 3))[tile]
    cloudiness = 1.0 + 0.018 * cloud(edge.shape, rng, (24.0, 40.0))
    glaze = np.asarray(color) * (tone * cloudiness)[..., None] + tint
    glaze = glaze * (0.94 + 0.06 * smoothstep(1.0, 7.0, edge))[..., None]
    cement = np.asarray(grout) * (1.0 + 0.05 * cloud(edge.shape, rng, (3.0, 3.0)))[..., None]
    return base_color(mix(cement, glaze, smoothstep(0.8, 1.8, edge)), _TILES_TILE_M, _TILES_TILE_M)


def tiles_normal(seed: int = 0) -> Texture:
    """The pillowed faces and sunken joints of `tiles(…, seed)`."""
    rng = np.random.default_rng(seed)
    edge, _ = _running_bond()
    wave = cloud(edge.shape, rng, (26.0, 34.0))
    relief_m = 0.0012 * smoothstep(0.3, 4.0, edge) + 0.00015 * wave * smoothstep(1.0, 5.0, edge)
    return normals(blur(relief_m, 0.6), _TILES_TILE_M, _TILES_TILE_M)


def quartz_worktop(color: Color = (0.80, 0.78, 0.74), seed: int = 0) -> Texture:
    """Engineered stone for a worktop, 0.5 × 0.5 m."""
    rng = np.random.default_rng(seed)
    shape = (512, 512)
    points = rng.uniform(0.0, 512.0, (6000, 2))
    distance, index = cells(shape, points)
    grain = rng.normal(0.0, 0.05, len(points))[index] * smoothstep(4.5, 1.0, distance)
    fleck = (rng.uniform(0.0, 1.0, len(points)) > 0.94)[index] * smoothstep(2.4, 1.2, distance) * 0.5
    stone = np.asarray(color) * (1.0 + grain + 0.02 * cloud(shape, rng, (80.0, 80.0)))[..., None]
    return base_color(mix(stone, (0.36, 0.33, 0.30), fleck), 0.5, 0.5)


def _running_bond() -> tuple[Field, np.ndarray]:
    """Distance to the joint in pixels, and each pixel's tile; joints stay clear of the image's edges."""
    size, columns, rows = 512, 4, 8
    wide, high = size / columns, size / rows
    row, column = np.indices((size, size)) + 0.5
    row_shifted = (row + high / 2) % size
    course = np.floor(row_shifted / high)
    column_shifted = (column + wide / 4 + (course % 2) * wide / 2) % size
    u, v = column_shifted % wide, row_shifted % high
    edge = np.minimum.reduce([u, wide - u, v, high - v])
    tile = (course * columns + np.floor(column_shifted / wide)).astype(np.intp)
    return edge, tile
