"""Books: one standing, a stack, and a pile of magazines. Spines look to +x."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tools.household import textures
from tools.household.model import Material, Mesh, Model, Part, fit_to_box, merge, placed, rotation, transformed
from tools.household.outlines import catmull_rom
from tools.household.shapes import bevelled_box, grid_surface

if TYPE_CHECKING:
    from collections.abc import Sequence

_BOARD_M = 0.0024


def book(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A hardback standing upright: width along x, thickness along y, front cover to +y."""
    width, thickness, height = extent_m
    jacket = textures.book_jacket(width, height, thickness, seed)
    cloth = Material("book_jacket", base_color_texture=jacket, roughness=0.55)
    lining = Material("book_lining", textures.linear_color("#d8cdb6"), roughness=0.8)
    sheets = Material("book_pages", base_color_texture=textures.pages(seed), roughness=0.9)

    outer = _cover_line(width, thickness)
    inner = _cover_line(width, thickness, inset=_BOARD_M)
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(outer, axis=0), axis=1))])
    u = lengths / lengths[-1] * jacket.width_m
    uvs = np.stack([np.stack([u, np.full_like(u, height)], 1), np.stack([u, np.zeros_like(u)], 1)])

    def band(first: np.ndarray, first_z: float, second: np.ndarray, second_z: float) -> Mesh:
        points = np.stack([np.insert(first, 2, first_z, axis=1), np.insert(second, 2, second_z, axis=1)])
        return grid_surface(points, uvs, crease_deg=50.0)

    top, bottom = height / 2, -height / 2
    outside = band(outer, top, outer, bottom)
    rims = [
        band(inner, top, outer, top),
        band(outer, bottom, inner, bottom),
        band(inner, bottom, inner, top),
        _fore_edge_rim(inner[0], outer[0], height),
        _fore_edge_rim(outer[-1], inner[-1], height),
    ]
    block = _page_block(width, thickness, height)
    return fit_to_box((Part(outside, cloth), Part(merge(rims), lining), Part(block, sheets)), extent_m, may_turn=False)


def book_row(extent_m: Sequence[float], seed: int = 0) -> Model:
    """Eight books standing side by side along y, of different heights and thicknesses."""
    rng = np.random.default_rng(seed)
    depth, width, height = extent_m
    shares = rng.uniform(0.6, 1.5, 8)
    parts: list[Part] = []
    side = -width / 2
    for number, thickness in enumerate(shares / shares.sum() * width):
        tall, deep = height * rng.uniform(0.8, 1.0), depth * rng.uniform(0.85, 1.0)
        one = book((deep, thickness * 0.97, tall), seed + number)
        parts += placed(one, ((depth - deep) / 2, side + thickness / 2, tall / 2))
        side += thickness
    return fit_to_box(tuple(parts), extent_m, may_turn=False)


def book_stack(extent_m: Sequence[float], seed: int = 0) -> Model:
    """Four books lying on one another, a little askew."""
    rng = np.random.default_rng(seed)
    depth, width, height = extent_m
    parts: list[Part] = []
    floor = -height / 2
    for share, scale, turn_deg, jacket in (
        (0.30, 0.98, 0.0, 1),
        (0.22, 0.94, 4.0, 3),
        (0.29, 0.86, -5.0, 6),
        (0.19, 0.80, 9.0, 4),
    ):
        thickness = height * share
        lying = _lying(depth * scale, width * scale * 0.97, thickness, seed + jacket)
        x, y = rng.uniform(-0.006, 0.006, 2)
        parts += placed(lying, (x, y, floor + thickness / 2), turn_deg)
        floor += thickness
    return fit_to_box(tuple(parts), extent_m, may_turn=False)


def magazines(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A large picture book under two magazines and a paperback."""
    depth, width, height = extent_m
    floor = -height / 2
    parts: list[Part] = list(
        placed(_lying(width * 0.97, depth * 0.985, height * 0.44, seed + 4), (0, 0, floor + height * 0.22), 90.0)
    )
    level = floor + height * 0.44
    for k, turn_deg in enumerate((84.0, 101.0)):
        thickness = height * 0.10
        parts += placed(_magazine(0.205, 0.265, thickness, seed + k), (0.006 - 0.012 * k, 0.004 * k, level), turn_deg)
        level += thickness * 1.02
    rest = height / 2 - level
    parts += placed(_lying(0.11, 0.175, rest, seed + 9), (-0.045, 0.045, level + rest / 2), 68.0)
    return fit_to_box(tuple(parts), extent_m, may_turn=False)


def _lying(width: float, height: float, thickness: float, seed: int) -> Model:
    """A book on its back cover: width along x, height along y."""
    return transformed(book((width, thickness, height), seed), rotation("x", 90.0))


def _magazine(width: float, height: float, thickness: float, seed: int) -> Model:
    """A magazine lying on z = 0, its loose corner lifting a little."""
    cover = textures.magazine_cover(width, height, seed)
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, 12), np.linspace(-height / 2, height / 2, 12))
    lift = 0.5 * thickness * np.clip(x / width + y / height, 0.0, 1.0) ** 2
    points = np.stack([x, y, 0.80 * thickness + 0.4 * lift], axis=2)
    uvs = np.stack([x + width / 2, y + height / 2], axis=2)
    top = grid_surface(points[:, ::-1], uvs[:, ::-1])
    body = bevelled_box((width, height, 0.79 * thickness), (0, 0, 0.395 * thickness), bevel=0.0006)
    return (
        Part(top, Material("magazine_cover", base_color_texture=cover, roughness=0.25, double_sided=True)),
        Part(body, Material("magazine_pages", base_color_texture=textures.pages(seed), roughness=0.6)),
    )


def _cover_line(width: float, thickness: float, inset: float = 0.0) -> np.ndarray:
    """The cover seen from above, from the back's fore-edge around the rounded spine to the front's (K, 2)."""
    x, y = width / 2 - inset, thickness / 2 - inset
    start = -width / 2
    bulge = min(0.12 * thickness, 0.0045)
    groove = min(0.0012, 0.06 * thickness)
    half = [
        (start, -y),
        (x * 0.2, -y),
        (x - 0.010, -y),
        (x - 0.0075, -y + groove),
        (x - 0.005, -y),
        (x - bulge, -y * 0.93),
    ]
    spine = catmull_rom(
        [
            (x - bulge, -y * 0.93),
            (x - 0.25 * bulge, -y * 0.55),
            (x, 0.0),
            (x - 0.25 * bulge, y * 0.55),
            (x - bulge, y * 0.93),
        ],
        11,
    )
    return np.array([*half[:-1], *map(tuple, spine), *((px, -py) for px, py in half[-2::-1])])


def _fore_edge_rim(first: np.ndarray, second: np.ndarray, height: float) -> Mesh:
    z = np.array([height / 2, -height / 2])
    points = np.stack([np.column_stack([np.tile(point, (2, 1)), z]) for point in (first, second)], axis=1)
    return grid_surface(points, np.zeros((2, 2, 2)))


def _page_block(width: float, thickness: float, height: float) -> Mesh:
    """Pages set back from the covers, the fore-edge hollow as in a rounded binding."""
    y, z = thickness / 2 - _BOARD_M, height / 2 - 0.003
    hollow = 0.10 * thickness
    across = np.linspace(-y, y, 7)
    fore = -width / 2 + 0.004 + hollow * (1.0 - (across / y) ** 2)
    back = np.full_like(across, width / 2 - _BOARD_M - 0.004)
    loop = np.concatenate([np.stack([back, across], 1), np.stack([fore, across], 1)[::-1], [[back[0], -y]]])
    sides = np.stack([np.column_stack([loop, np.full(len(loop), z)]), np.column_stack([loop, np.full(len(loop), -z)])])
    # Sheets lie across the thickness, and the texture's lines run along u.
    uvs = np.stack([np.stack([np.full(len(loop), level), loop[:, 1]], 1) for level in (z, -z)])
    flat = np.stack([np.stack([fore, across], 1), np.stack([back, across], 1)])
    top = np.concatenate([flat, np.full((2, 7, 1), z)], axis=2)
    bottom = np.concatenate([flat, np.full((2, 7, 1), -z)], axis=2)[::-1]
    return merge([grid_surface(sides, uvs), grid_surface(top, flat), grid_surface(bottom, flat[::-1])])
