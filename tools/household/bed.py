"""A made bed: oak frame, tufted headboard, mattress, duvet turned back at the head, pillows and a throw.

The head is at +x, the floor at z = 0, the middle at the origin.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tools.household.joinery import board, leg
from tools.household.model import Floats, Material, Mesh, Model, Part, affine, merge, rotation
from tools.household.shapes import bevelled_box, grid_surface

if TYPE_CHECKING:
    from collections.abc import Sequence

LENGTH_M, WIDTH_M, HEIGHT_M = 2.2985, 1.8515, 0.8958
_MATTRESS_TOP = 0.60
_RAIL_BOTTOM = 0.365
_HALF_MATTRESS = 0.80


def double_bed(
    oak: Material,
    headboard: Material,
    sheet: Material,
    duvet: Material,
    throw: Material,
    pillow: Material,
    cushion: Material,
    detail: float = 1.0,
) -> Model:
    """The whole bed, in its published size; `detail` below 1 makes its cloths of fewer triangles."""
    head = LENGTH_M / 2
    return (
        Part(_frame(), oak),
        Part(_headboard(head, detail), headboard),
        Part(_mattress(), sheet),
        Part(_duvet(detail), duvet),
        Part(_turned_back(detail), sheet),
        Part(_throw(detail), throw),
        *(Part(mesh, pillow) for mesh in _pillows(head, detail)),
        Part(_cushion(head, detail), cushion),
    )


def _frame() -> Mesh:
    """Rails high enough for the side table to reach under, on turned-in tapered legs, with a low foot board."""
    foot, head, low = -LENGTH_M / 2, LENGTH_M / 2, _RAIL_BOTTOM
    parts = [
        board((foot + 0.02, side - 0.014, low), (head - 0.05, side + 0.014, low + 0.115), 0.006)
        for side in (-0.812, 0.812)
    ]
    parts.append(board((foot, -0.826, low - 0.02), (foot + 0.030, 0.826, 0.545), 0.010, grain="y"))
    parts.append(board((foot - 0.0, -0.826, 0.545), (foot + 0.040, 0.826, 0.57), 0.010, grain="y"))
    parts += [
        board((x - 0.04, -0.80, low + 0.01), (x + 0.04, 0.80, low + 0.03), 0.003) for x in np.linspace(-0.9, 0.9, 7)
    ]
    for x, splay in ((foot + 0.085, -0.03), (head - 0.16, 0.03)):
        parts.append(board((x - 0.035, -0.70, low - 0.05), (x + 0.035, 0.70, low + 0.012), 0.004))
        for side in (-1, 1):
            parts.append(leg((x + splay, side * 0.665, 0.0), (x, side * 0.640, low - 0.03), 0.019, 0.034))
    return merge(parts)


def _headboard(head: float, detail: float) -> Mesh:
    """A padded panel with eleven vertical channels and rounded shoulders."""
    half, bottom, top, channels = 0.86, 0.38, HEIGHT_M, 11
    y = np.linspace(-half, half, channels * round(6 * detail) + 1)
    channel = np.abs(np.sin(np.pi * (y + half) / (2 * half) * channels))
    shoulder = top - 0.10 * (1 - np.sqrt(np.clip(1 - np.clip((np.abs(y) - (half - 0.10)) / 0.10, 0, 1) ** 2, 0, 1)))
    rows = np.concatenate([[0.0, 0.004], np.linspace(0.02, 0.9, 9), [0.94, 0.965, 0.985, 0.996, 1.0]])
    edge = np.clip(np.minimum(rows / 0.02, (1 - rows) / 0.06), 0, 1)
    roll = np.sqrt(np.clip(1 - (1 - edge) ** 2, 0, 1))
    puff = 0.018 + 0.030 * channel**0.55
    side = np.sqrt(np.clip(1 - np.clip((np.abs(y) - (half - 0.012)) / 0.012, 0, 1) ** 2, 0, 1))
    depth = roll[:, None] * puff[None, :] * side[None, :]
    z = bottom + (shoulder - bottom)[None, :] * rows[:, None]
    front = np.stack([head - 0.022 - depth, np.broadcast_to(y, z.shape), z], axis=2)
    back = front.copy()
    back[..., 0] = head
    uvs = np.stack([np.broadcast_to(y, z.shape), z], axis=2)
    return merge(
        [
            grid_surface(front, uvs, crease_deg=50.0),
            grid_surface(back[:, ::-1], uvs[:, ::-1]),
            _strip(front[-1], back[-1]),
            _strip(back[0], front[0]),
            _strip(back[:, -1], front[:, -1]),
            _strip(front[:, 0], back[:, 0]),
        ]
    )


def _strip(first: Floats, second: Floats) -> Mesh:
    return grid_surface(np.stack([first, second]))


def _mattress() -> Mesh:
    return bevelled_box((2.12, 2 * _HALF_MATTRESS, 0.21), (0.005, 0, _MATTRESS_TOP - 0.105), bevel=0.055, segments=4)


def _wrinkles(x: Floats, y: Floats, seed: int, count: int = 26, scale: float = 1.0) -> Floats:
    """Soft creases: a sum of short ridges in random directions, about 1 in height."""
    rng = np.random.default_rng(seed)
    total = np.zeros(np.broadcast(x, y).shape)
    for _ in range(count):
        center = rng.uniform((x.min(), y.min()), (x.max(), y.max()))
        angle = rng.normal(0.0, 0.75)
        along = (x - center[0]) * np.cos(angle) + (y - center[1]) * np.sin(angle)
        across = -(x - center[0]) * np.sin(angle) + (y - center[1]) * np.cos(angle)
        length, width = rng.uniform(0.14, 0.42) * scale, rng.uniform(0.026, 0.060) * scale
        bend = across - rng.normal(0.0, 0.25) * along**2 / length
        total += rng.uniform(0.4, 1.0) * np.exp(-((along / length) ** 2) - (bend / width) ** 2)
    return total


def _draped(
    x0: float,
    x1: float,
    lift: float,
    drop: float,
    seed: int,
    hem_folds: float,
    columns: int = 84,
    rows: int = 72,
    detail: float = 1.0,
) -> tuple[Floats, Floats]:
    """A cloth over the mattress from x0 to x1: points (rows, columns, 3) and its texture coordinates.

    It lies `lift` above the mattress, falls over both sides by `drop` and fans out in folds towards the hem.
    """
    columns, rows = round(columns * detail), round(rows * detail)
    rng = np.random.default_rng(seed)
    half = _HALF_MATTRESS + 0.01 + lift * 0.5
    radius = 0.07 + lift
    flat, arc = half - radius, radius * np.pi / 2
    reach = flat + arc + drop
    s = np.concatenate(
        [
            np.linspace(-reach, -flat, rows // 3),
            np.linspace(-flat, flat, rows - 2 * (rows // 3) + 2)[1:-1],
            np.linspace(flat, reach, rows // 3),
        ]
    )
    x = np.linspace(x0, x1, columns)
    grid_s, grid_x = np.meshgrid(s, x, indexing="ij")
    excess = np.abs(grid_s) - flat
    bend = np.clip(excess / radius, 0, np.pi / 2)
    fall = np.clip(excess - arc, 0, None)
    side = np.sign(grid_s)
    y = np.where(excess > 0, side * (flat + radius * np.sin(bend)), grid_s)
    z = _MATTRESS_TOP + lift - np.where(excess > 0, radius * (1 - np.cos(bend)), 0) - fall
    share = fall / drop
    phase = rng.uniform(0, 2 * np.pi, (2, 4))
    waves = np.zeros_like(y)
    for sign, offsets in ((-1, phase[0]), (1, phase[1])):
        fold = np.sin(
            2 * np.pi * grid_x / 0.31 + offsets[0] + 0.9 * np.sin(2 * np.pi * grid_x / 0.9 + offsets[1])
        ) + 0.55 * np.sin(2 * np.pi * grid_x / 0.17 + offsets[2])
        waves = np.where(side == sign, fold, waves)
    y = y + side * hem_folds * share**1.3 * (0.45 + 0.55 * waves)
    grid_x = grid_x + 0.25 * hem_folds * share * np.roll(waves, 3, axis=1)
    on_top = np.clip(1 - np.clip(excess, 0, None) / (arc + 0.4 * drop), 0, 1)
    loose = 0.015 * _wrinkles(grid_x, grid_s, seed + 1, 34) + 0.012 * np.sin(3.1 * grid_x + 0.4) * np.sin(2.7 * grid_s)
    z = z + loose * on_top
    y = y + side * loose * (1 - on_top)
    return np.stack([grid_x, y, z], axis=2), np.stack([grid_x, grid_s], axis=2)


def _closed_cloth(points: Floats, uvs: Floats, thickness: float) -> Mesh:
    """A cloth with a lower side and a rounded hem all around."""
    top = grid_surface(points[:, ::-1], uvs[:, ::-1])
    border = np.concatenate([points[0], points[1:, -1], points[-1, -2::-1], points[-2:0:-1, 0]])
    around = np.concatenate([uvs[0], uvs[1:, -1], uvs[-1, -2::-1], uvs[-2:0:-1, 0]])
    middle = points.mean(axis=(0, 1))
    inward = (middle - border) * [1, 1, 0]
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    turns = np.radians([0, 45, 90, 135, 180])
    rings = [
        border - inward * thickness * 0.25 * np.sin(t) - np.array([0, 0, thickness / 2 * (1 - np.cos(t))])
        for t in turns
    ]
    rings.append(border + inward * 0.06 - np.array([0, 0, thickness]))
    rings = [np.concatenate([ring, ring[:1]]) for ring in rings]
    around = np.concatenate([around, around[:1]])
    hem = grid_surface(np.stack(rings)[:, ::-1], np.stack([around] * len(rings))[:, ::-1])
    return merge([top, hem])


def _duvet(detail: float) -> Mesh:
    points, uvs = _draped(-1.085, 0.52, lift=0.055, drop=0.20, seed=11, hem_folds=0.045, detail=detail)
    x = points[..., 0]
    # The duvet is tucked in at the foot: its edge goes down between mattress and foot board.
    tuck = np.clip((-0.98 - x) / 0.105, 0, 1)
    points[..., 2] -= 0.19 * tuck**2
    quilted = (
        0.016 * np.abs(np.cos(np.pi * (x + 0.2) / 0.42)) ** 0.5 * np.abs(np.cos(np.pi * uvs[..., 1] / 0.46)) ** 0.5
    )
    points[..., 2] += quilted * (1 - tuck) * (np.abs(uvs[..., 1]) < 0.9)
    return _closed_cloth(points, uvs, 0.03)


def _turned_back(detail: float) -> Mesh:
    """The sheet folded back over the duvet's upper edge, as a soft roll."""
    points, uvs = _draped(0.36, 0.62, lift=0.088, drop=0.14, seed=23, hem_folds=0.03, columns=18, detail=detail)
    x = points[..., 0]
    share = np.clip((x - 0.36) / 0.26, 0, 1)
    points[..., 2] += 0.02 * np.sin(np.pi * share) ** 0.5 - 0.022 * (2 * share - 1) ** 4
    return _closed_cloth(points, uvs, 0.035)


def _throw(detail: float) -> Mesh:
    points, uvs = _draped(-0.86, -0.40, lift=0.093, drop=0.17, seed=31, hem_folds=0.028, columns=28, detail=detail)
    return _closed_cloth(points, uvs, 0.012)


def _pillow(width: float, depth: float, thickness: float, seed: int, detail: float) -> Mesh:
    """A filled pillow about the origin, its seam in the plane z = 0, corners slightly drawn out."""
    u, v = np.meshgrid(np.linspace(-1, 1, 2 * round(14 * detail) + 1), np.linspace(-1, 1, 2 * round(11 * detail) + 1))
    inflate = ((1 - np.abs(u) ** 2.6) * (1 - np.abs(v) ** 2.6)).clip(0) ** 0.55
    x, y = u * (1 - 0.06 * (1 - v**2)) * width / 2, v * (1 - 0.10 * (1 - u**2)) * depth / 2
    crease = _wrinkles(x, y, seed, 12, 0.6) * 0.006
    top = np.stack([x, y, inflate * thickness / 2 - crease * inflate], axis=2)
    bottom = np.stack([x, y, -inflate * thickness / 2], axis=2)
    uvs = np.stack([x, y], axis=2)
    return merge([grid_surface(top[:, ::-1], uvs[:, ::-1], crease_deg=80), grid_surface(bottom, uvs, crease_deg=80)])


def _leaning(mesh: Mesh, lean_deg: float, yaw_deg: float, position: Sequence[float]) -> Mesh:
    """Stand a pillow that lies in the x-y plane (its width along x) against the headboard."""
    standing = rotation("z", yaw_deg) @ rotation("y", -lean_deg) @ rotation("z", 90.0)
    return affine(mesh, standing, position)


def _pillows(head: float, detail: float) -> list[Mesh]:
    return [
        _leaning(_pillow(0.72, 0.48, 0.16, 5, detail), 24.0, 1.5, (head - 0.325, -0.40, _MATTRESS_TOP + 0.128)),
        _leaning(_pillow(0.72, 0.48, 0.16, 6, detail), 22.0, -2.0, (head - 0.33, 0.40, _MATTRESS_TOP + 0.126)),
    ]


def _cushion(head: float, detail: float) -> Mesh:
    return _leaning(_pillow(0.42, 0.42, 0.14, 7, detail), 27.0, 8.0, (head - 0.52, -0.22, _MATTRESS_TOP + 0.150))
