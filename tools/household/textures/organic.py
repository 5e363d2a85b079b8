"""Leaves, bark and fruit."""

import numpy as np

from tools.household.model import Texture
from tools.household.textures.encode import base_color, normals
from tools.household.textures.noise import Color, cloud, gradient, hex_color, mix, smoothstep


def leaf(blade: Color = (0.24, 0.42, 0.16), vein: Color = (0.55, 0.66, 0.34), veins: int = 9, seed: int = 0) -> Texture:
    """A broad leaf with midrib and side veins; the whole leaf once, 1 × 1: u across, stalk at the bottom."""
    rng = np.random.default_rng(seed)
    size = 256
    row, column = np.indices((size, size)) / size
    across, along = np.abs(column - 0.5) * 2.0, 1.0 - row
    shade = 1.0 + 0.07 * cloud((size, size), rng, (30.0, 30.0)) + 0.04 * cloud((size, size), rng, (4.0, 4.0))
    rise = (along - 0.42 * across**1.15 + 0.02 * np.sign(column - 0.5)) * veins
    rib = np.abs((rise % 1.0) - 0.5) * 2.0
    lines = smoothstep(0.86, 1.0, rib) * (1.0 - 0.6 * across) * 0.55
    quilt = 1.0 + 0.07 * (0.5 - rib)
    midrib = smoothstep(0.055, 0.015, across)
    color = np.asarray(blade) * (shade * quilt)[..., None] * (1.0 - 0.12 * smoothstep(0.7, 1.0, across))[..., None]
    return base_color(mix(mix(color, vein, lines), vein, midrib), 1.0, 1.0)


def strap_leaf(blade: Color = (0.22, 0.38, 0.17), margin: Color = (0.62, 0.66, 0.36), seed: int = 0) -> Texture:
    """A dracaena's parallel-veined leaf; the whole leaf once, 1 × 1: u across, stalk at the bottom."""
    rng = np.random.default_rng(seed)
    shape = (256, 128)
    across = np.abs((np.arange(shape[1]) + 0.5) / shape[1] - 0.5)[None, :] * 2.0 + np.zeros(shape)
    stripes = 0.07 * cloud(shape, rng, (400.0, 2.2)) + 0.05 * cloud(shape, rng, (60.0, 20.0))
    along = 1.0 - (np.arange(shape[0]) / shape[0])[:, None]
    color = np.asarray(blade) * (1.0 + stripes + 0.10 * (along - 0.5))[..., None]
    color = mix(color, margin, 0.8 * smoothstep(0.84, 0.93, across) + 0.35 * smoothstep(0.06, 0.02, across))
    tip = smoothstep(0.965, 1.0, along) * np.ones(shape)
    return base_color(mix(color, hex_color("#8a6a3c"), 0.8 * tip), 1.0, 1.0)


def bark(seed: int = 0) -> Texture:
    """The grey-brown cane of a dracaena, ringed with leaf scars: 0.24 m along u, 0.12 m around."""
    rng = np.random.default_rng(seed)
    shape = (128, 256)
    column = np.arange(shape[1])[None, :] / shape[1]
    scars = (column * 26.0 + 0.18 * cloud(shape, rng, (60.0, 40.0))) % 1.0
    tone = 0.5 + 0.2 * cloud(shape, rng, (5.0, 60.0), 0.1)
    color = gradient(np.clip(tone, 0.0, 1.0), [(0.0, hex_color("#6d5a45")), (1.0, hex_color("#a8957a"))])
    return base_color(mix(color, hex_color("#46372a"), 0.6 * smoothstep(0.78, 0.98, scars)), 0.24, 0.12)


def cactus_skin(seed: int = 0) -> Texture:
    """A column cactus of ten ribs, wrapped once: u around from a rib, v from the foot (bottom) to the tip, 1 × 1.

    On each rib tufts of straw-coloured spines, in rows that are about as far apart as ribs are.
    """
    rng = np.random.default_rng(seed)
    shape = (256, 256)
    ribs, rows, spine = 10, 13, 0.46
    up = (1.0 - (np.arange(shape[0]) + 0.5) / shape[0])[:, None]
    around = ((np.arange(shape[1]) + 0.5) / shape[1])[None, :]
    across = (around * ribs + 0.5) % 1.0 - 0.5 + np.zeros(shape)
    along = (up * rows + 0.5 * (np.floor(around * ribs + 0.5) % 2)) % 1.0 - 0.5
    distance, angle = np.hypot(across, along), np.arctan2(along, across)
    crest = smoothstep(0.45, 0.05, np.abs(across))
    shade = 1.0 + 0.08 * cloud(shape, rng, (40.0, 40.0)) + 0.05 * cloud(shape, rng, (4.0, 4.0))
    color = gradient(crest, [(0.0, hex_color("#2f4a2c")), (0.6, hex_color("#54793f")), (1.0, hex_color("#7d9a58"))])
    color = mix(color * shade[..., None], hex_color("#8a7a4a"), 0.5 * smoothstep(0.06, 0.0, up) * np.ones(shape))
    ray = distance * np.abs(np.sin(3.5 * angle))
    spines = smoothstep(0.10, 0.04, ray) * smoothstep(spine, 0.8 * spine, distance)
    color = mix(color, hex_color("#d9cfa4"), 0.9 * spines)
    return base_color(mix(color, hex_color("#efe8cf"), smoothstep(0.17, 0.11, distance)), 1.0, 1.0)


def apple_skin(seed: int = 0) -> Texture:
    """A red-blushed apple, wrapped once: u around, v from the base (bottom) to the stalk, 1 × 1."""
    rng = np.random.default_rng(seed)
    shape = (256, 512)
    up = 1.0 - (np.arange(shape[0])[:, None] + 0.5) / shape[0]
    around = np.arange(shape[1])[None, :] / shape[1] * 2.0 * np.pi
    blush = 0.74 + 0.24 * np.cos(around + 0.6) + 0.10 * cloud(shape, rng, (70.0, 60.0))
    streaks = 0.075 * cloud(shape, rng, (90.0, 3.0)) + 0.05 * cloud(shape, rng, (30.0, 2.0))
    amount = (
        blush + streaks - 0.9 * smoothstep(0.80, 0.98, up + 0 * around) - 0.7 * smoothstep(0.16, 0.02, up + 0 * around)
    )
    color = gradient(
        np.clip(amount, 0.0, 1.0),
        [
            (0.0, hex_color("#b9a84a")),
            (0.28, hex_color("#c67a35")),
            (0.5, hex_color("#b23026")),
            (1.0, hex_color("#84121d")),
        ],
    )
    lenticels = smoothstep(2.5, 3.0, cloud(shape, rng, (2.6, 2.6))) * 0.45
    return base_color(mix(color, hex_color("#e2c48c"), lenticels), 1.0, 1.0)


def green_apple_skin(seed: int = 0) -> Texture:
    """A green apple with pale specks and a faint blush, wrapped once as `apple_skin`."""
    rng = np.random.default_rng(seed)
    shape = (256, 512)
    around = np.arange(shape[1])[None, :] / shape[1] * 2.0 * np.pi
    blush = np.clip(0.25 + 0.35 * np.cos(around + 1.0) + 0.15 * cloud(shape, rng, (70.0, 60.0)), 0.0, 1.0)
    color = gradient(blush, [(0.0, hex_color("#7f9f2f")), (0.6, hex_color("#97ad3b")), (1.0, hex_color("#c0a94a"))])
    specks = smoothstep(2.2, 2.8, cloud(shape, rng, (2.6, 2.6))) * 0.5
    return base_color(mix(color, hex_color("#dfe3b0"), specks), 1.0, 1.0)


def banana_skin(seed: int = 0, ripeness: float = 0.5) -> Texture:
    """A banana's peel, once: u from stalk to tip, v around, 1 × 1; `ripeness` from green (0) to spotted (1)."""
    rng = np.random.default_rng(seed)
    shape = (128, 512)
    along = (np.arange(shape[1])[None, :] + 0.5) / shape[1] + 0.0 * np.arange(shape[0])[:, None]
    tone = np.clip(ripeness + 0.08 * cloud(shape, rng, (30.0, 90.0)) - 0.45 * smoothstep(0.16, 0.0, along), 0.0, 1.0)
    color = gradient(tone, [(0.0, hex_color("#8f9d36")), (0.35, hex_color("#d3b53c")), (1.0, hex_color("#dcae3a"))])
    streaks = smoothstep(1.3, 2.4, cloud(shape, rng, (2.0, 26.0))) * 0.5 * ripeness
    spots = smoothstep(1.9, 2.5, cloud(shape, rng, (5.0, 7.0))) * ripeness
    color = mix(color, hex_color("#6b4a22"), np.clip(streaks + spots, 0.0, 0.85))
    return base_color(mix(color, hex_color("#33261a"), smoothstep(0.965, 0.985, along)), 1.0, 1.0)


def orange_peel(seed: int = 0, code: str = "#e5821e") -> Texture:
    """The peel of an orange, 0.06 × 0.06 m."""
    rng = np.random.default_rng(seed)
    shape = (256, 256)
    shade = 1.0 + 0.05 * cloud(shape, rng, (60.0, 60.0)) - 0.16 * smoothstep(1.2, 2.2, cloud(shape, rng, (3.2, 3.2)))
    return base_color(np.asarray(hex_color(code)) * shade[..., None], 0.06, 0.06)


def orange_peel_normal(seed: int = 0) -> Texture:
    """The pores of `orange_peel(seed)`."""
    rng = np.random.default_rng(seed)
    cloud((256, 256), rng, (60.0, 60.0))
    return normals(-0.00012 * smoothstep(0.4, 2.0, cloud((256, 256), rng, (3.2, 3.2))), 0.06, 0.06)


def citrus_slice(seed: int = 0) -> Texture:
    """A halved orange's face, once, 1 × 1."""
    rng = np.random.default_rng(seed)
    size = 256
    row, column = (np.indices((size, size)) + 0.5) / size * 2.0 - 1.0
    radius, angle = np.hypot(row, column), np.arctan2(row, column)
    wedge = np.abs((angle / (2.0 * np.pi) * 10.0) % 1.0 - 0.5) * 2.0
    pulp = smoothstep(0.90, 0.82, radius) * smoothstep(0.06, 0.12, radius) * smoothstep(1.0, 0.90, wedge)
    vesicles = 1.0 + 0.10 * cloud((size, size), rng, (5.0, 5.0))
    flesh = np.asarray(hex_color("#f0932b")) * vesicles[..., None]
    rind = mix(hex_color("#f6e3bd"), hex_color("#e5821e"), smoothstep(0.95, 0.98, radius))
    return base_color(mix(rind, flesh, pulp), 1.0, 1.0)


def crumb(code: str = "#c98f4e", seed: int = 0) -> Texture:
    """The inside of a sponge cake, 0.08 × 0.08 m."""
    rng = np.random.default_rng(seed)
    shape = (256, 256)
    pores = smoothstep(0.9, 2.0, cloud(shape, rng, (5.0, 6.0), 0.4))
    shade = 1.0 + 0.06 * cloud(shape, rng, (30.0, 30.0)) - 0.30 * pores
    return base_color(np.asarray(hex_color(code)) * shade[..., None], 0.08, 0.08)


def hair(code: str = "#3a281d", seed: int = 0) -> Texture:
    """Combed hair, strands along u, 0.2 × 0.1 m."""
    rng = np.random.default_rng(seed)
    shape = (128, 256)
    strands = cloud(shape, rng, (1.2, 120.0)) + 0.6 * cloud(shape, rng, (5.0, 160.0))
    return base_color(np.asarray(hex_color(code)) * (1.0 + 0.16 * strands)[..., None], 0.2, 0.1)
