"""Wood: furniture boards and a plank floor. The grain runs along u."""

from dataclasses import dataclass

import numpy as np

from tools.household.model import Texture
from tools.household.textures.encode import base_color, normals
from tools.household.textures.noise import Color, Field, cloud, gradient, hex_color, mix, smoothstep


@dataclass(frozen=True)
class Species:
    """The look of a timber: early wood, late wood, and the strength of rings, pores and fibres."""

    early: Color
    late: Color
    rings: int
    contrast: float
    pores: float
    figure: float


SPECIES = {
    "oak": Species(hex_color("#c39b69"), hex_color("#98703f"), 20, 0.55, 0.55, 2.4),
    "walnut": Species(hex_color("#765843"), hex_color("#453226"), 17, 0.58, 0.45, 3.2),
    "pine": Species(hex_color("#dcb781"), hex_color("#bd8747"), 14, 0.80, 0.05, 3.4),
    "beech": Species(hex_color("#cfa37b"), hex_color("#b58357"), 18, 0.35, 0.30, 1.6),
    "cherry": Species(hex_color("#a5653e"), hex_color("#7c4225"), 15, 0.55, 0.18, 2.8),
}


_FLOOR_OAK = Species(hex_color("#c3a077"), hex_color("#94704a"), 14, 0.66, 0.30, 2.8)


def wood(species: str = "oak", seed: int = 0) -> Texture:
    """A finished furniture board, 0.6 × 0.3 m: `oak`, `walnut`, `pine`, `beech` or `cherry`."""
    rng = np.random.default_rng(seed)
    face = (512, 1024)
    return base_color(_timber(face, face, SPECIES[species], SPECIES[species].rings, 0.6 / 1024, rng), 0.6, 0.3)


def oak_planks(seed: int = 0) -> Texture:
    """An oiled oak floor of staggered boards, 2.16 × 2.16 m, boards 0.18 m wide."""
    colors, _ = _planks(seed)
    return base_color(colors, _FLOOR_M, _FLOOR_M)


def oak_planks_normal(seed: int = 0) -> Texture:
    """The bevelled joints and the brushed grain of `oak_planks(seed)`."""
    _, relief_m = _planks(seed)
    return normals(relief_m, _FLOOR_M, _FLOOR_M)


_FLOOR_M = 2.16
_FLOOR_PX = 1020
_BOARD_PX = 85


def _planks(seed: int) -> tuple[Field, Field]:
    """The floor's colours (H, W, 3) and its relief in metres (H, W)."""
    rng = np.random.default_rng(seed)
    colors, relief_m = np.zeros((_FLOOR_PX, _FLOOR_PX, 3)), np.zeros((_FLOOR_PX, _FLOOR_PX))
    first = 0
    for top in range(0, _FLOOR_PX, _BOARD_PX):
        first = (first + int(_FLOOR_PX * rng.uniform(0.17, 0.33))) % _FLOOR_PX
        cut = int(_FLOOR_PX * rng.uniform(0.42, 0.58))
        boards = [_board(length, rng) for length in (cut, _FLOOR_PX - cut)]
        rows = slice(top, top + _BOARD_PX)
        colors[rows] = np.roll(np.concatenate([color for color, _ in boards], axis=1), first, axis=1)
        relief_m[rows] = np.roll(np.concatenate([relief for _, relief in boards], axis=1), first, axis=1)
    # Joints run inside the tile, never along its edge.
    shift = _BOARD_PX // 2
    wear = 1.0 + 0.02 * cloud((_FLOOR_PX, _FLOOR_PX), rng, (240, 240))
    return np.roll(colors, shift, axis=0) * wear[..., None], np.roll(relief_m, shift, axis=0)


def _board(length_px: int, rng: np.random.Generator) -> tuple[Field, Field]:
    """One floor board: its colours and its relief in metres."""
    rings, knots = int(rng.integers(9, 18)), int(rng.random() < 0.28)
    shape, face = (_BOARD_PX, length_px), (2 * _BOARD_PX, _FLOOR_PX)
    grain = _timber(shape, face, _FLOOR_OAK, rings, _FLOOR_M / _FLOOR_PX, rng, knots)
    tone = 1.0 + 0.05 * np.clip(rng.standard_normal(), -1.6, 1.6)
    warmth = np.array([1.0, 1.0 + 0.006 * rng.standard_normal(), 1.0 + 0.02 * rng.standard_normal()])
    row, column = np.indices((_BOARD_PX, length_px)) + 0.5
    edge_px = np.minimum.reduce([row, _BOARD_PX - row, column, length_px - column])
    shaded = grain * tone * warmth * (0.94 + 0.06 * smoothstep(0.0, 4.0, edge_px))[..., None]
    color = mix(shaded, hex_color("#4a3422"), 0.7 * (1.0 - smoothstep(0.2, 1.1, edge_px)))
    relief_m = 0.0002 * (grain.mean(axis=-1) - grain.mean()) - 0.0010 * (1.0 - smoothstep(0.0, 2.5, edge_px))
    return color, relief_m


def _timber(
    shape: tuple[int, int],
    face: tuple[int, int],
    species: Species,
    rings: int,
    pixel_m: float,
    rng: np.random.Generator,
    knots: int = 0,
) -> Field:
    """The colours (*shape, 3) of a piece of a sawn face that shows so many growth rings across.

    It repeats without a seam when the piece is the whole face.
    """
    rows, columns = face
    across = np.arange(shape[0])[:, None] / rows
    warp = species.figure * 0.55 * cloud(shape, rng, (rows * 0.9, columns * 1.1))
    wobble = 0.16 * cloud(shape, rng, (rows / 12, columns / 3)) + 0.02 * cloud(shape, rng, (4, columns / 10))
    phase = rings * across + warp + wobble
    heart = np.zeros(shape)
    for _ in range(knots):
        phase, heart = _with_knot(phase, heart, pixel_m, rng)
    ring = phase % 1.0
    # A growth ring darkens slowly from early to late wood and ends abruptly.
    late = ring**2.2 * (1.0 - smoothstep(0.84, 1.0, ring))
    ring_strength = 0.75 + 0.25 * cloud(shape, rng, (rows / 6, columns / 2))
    fibre = cloud(shape, rng, (1.2, 0.045 / pixel_m), 0.2)
    tone = cloud(shape, rng, (rows / 5, columns / 2))
    weight = np.clip(0.12 + species.contrast * late * ring_strength + 0.07 * fibre + 0.07 * tone, 0.0, 1.0)
    color = gradient(weight, [(0.0, species.early), (1.0, species.late)])
    streak = smoothstep(1.35, 2.3, cloud(shape, rng, (0.9, 0.016 / pixel_m))) * (0.35 + 0.65 * (ring < 0.45))
    red, green, blue = species.late
    color = mix(color, (0.55 * red, 0.55 * green, 0.55 * blue), species.pores * streak)
    return mix(color, (0.42 * red, 0.36 * green, 0.32 * blue), heart)


def _with_knot(phase: Field, heart: Field, pixel_m: float, rng: np.random.Generator) -> tuple[Field, Field]:
    """Rings bent around a knot, and the knot's dark heart."""
    rows, columns = phase.shape
    row, column = np.indices(phase.shape)
    down = (row - rows * rng.uniform(0.3, 0.7)) * pixel_m
    along = (column - columns * rng.uniform(0.2, 0.8)) * pixel_m
    radius_m = rng.uniform(0.006, 0.011)
    distance = np.hypot(down, along * 0.62) / radius_m
    aside = np.hypot(down * 0.8, along * 0.22) / radius_m
    bent = phase + np.sign(down) * 1.6 * np.exp(-0.35 * aside**2)
    inside = smoothstep(1.5, 0.8, distance)
    return bent + (distance * 2.5 - bent) * inside, np.maximum(heart, 0.75 * smoothstep(1.1, 0.3, distance))
