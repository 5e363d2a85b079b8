"""Potted plants."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tools.household import textures
from tools.household.model import Floats, Material, Mesh, Model, Part, fit_to_box, merge, placed
from tools.household.outlines import catmull_rom
from tools.household.shapes import grid_surface, lathe, tube

if TYPE_CHECKING:
    from collections.abc import Sequence

_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def potted_plant(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A bushy pot plant with broad pointed leaves in a glazed pot."""
    rng = np.random.default_rng(seed)
    width, depth, height = extent_m
    radius, pot_height = 0.27 * min(width, depth), height * 0.36
    soil_z = -height / 2 + pot_height * 0.89
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    for stem in range(6):
        azimuth = stem * 2.0 * np.pi / 5 + rng.uniform(-0.3, 0.3)
        outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        reach, top = (0.0, height * 0.52) if stem == 0 else (rng.uniform(0.03, 0.06), height * rng.uniform(0.26, 0.42))
        foot = outward * radius * (0.0 if stem == 0 else 0.35) + (0.0, 0.0, soil_z - 0.004)
        middle = foot + outward * reach * 0.3 + (0.0, 0.0, top * 0.5)
        tip = foot + outward * reach + (0.0, 0.0, top)
        line = catmull_rom(np.stack([foot, middle, tip]), 14)
        stems.append(tube(line, np.linspace(0.0034, 0.0016, 14), 7))
        count = 9 if stem == 0 else 7
        for k in range(count):
            t = 0.28 + 0.72 * k / (count - 1)
            rise_deg = 12.0 + 58.0 * t**3 + rng.uniform(-8.0, 8.0)
            length = 0.118 * (1.0 - 0.30 * t) * rng.uniform(0.88, 1.1)
            angle = azimuth + k * _GOLDEN_ANGLE + rng.uniform(-0.2, 0.2)
            leaves.append(_broad_leaf(line[round(t * 13)], angle, rise_deg, length, rng))
            stems.append(_petiole(line[round(t * 13)], angle, rise_deg, length))
    foliage = (
        Part(
            merge(leaves),
            Material("leaf", base_color_texture=textures.leaf(seed=seed), roughness=0.4, double_sided=True),
        ),
        Part(merge(stems), Material("stem", textures.linear_color("#5b6b33"), roughness=0.6)),
    )
    glaze = Material("pot_glaze", base_color_texture=textures.stoneware((0.84, 0.81, 0.75), seed=seed), roughness=0.4)
    return _within(foliage, _pot(radius, pot_height, -height / 2, glaze, seed), soil_z, extent_m)


def dracaena(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A dracaena: three bare canes of different height, each with a crown of arching strap leaves."""
    rng = np.random.default_rng(seed)
    _, depth, height = extent_m
    radius, pot_height = 0.37 * depth, height * 0.20
    soil_z = -height / 2 + pot_height * 0.89
    canes: list[Mesh] = []
    leaves: list[Mesh] = []
    for (x, y), (lean_x, lean_y), top, count in (
        ((0.030, 0.010), (0.03, 0.00), 0.70, 52),
        ((-0.050, -0.015), (-0.08, 0.01), 0.50, 44),
        ((0.010, 0.045), (0.12, -0.02), 0.36, 38),
    ):
        foot = np.array([x, y, soil_z - 0.01])
        tip = np.array([x + lean_x, y + lean_y, height * (top - 0.5)])
        bend = (foot + tip) / 2 + (rng.uniform(-0.015, 0.015), rng.uniform(-0.015, 0.015), 0.0)
        line = catmull_rom(np.stack([foot, bend, tip]), 18)
        canes.append(tube(line, np.linspace(0.019, 0.014, 18), 12))
        for k in range(count):
            t = k / (count - 1)
            base = tip + np.array([0.0, 0.0, -0.09 + 0.13 * t])
            rise_deg = -6.0 + 88.0 * t**0.9 + rng.uniform(-6.0, 6.0)
            length = height * (0.31 - 0.10 * t) * rng.uniform(0.85, 1.08)
            leaves.append(_strap(base, k * _GOLDEN_ANGLE + rng.uniform(-0.2, 0.2), rise_deg, length, rng))
    strap = Material("strap_leaf", base_color_texture=textures.strap_leaf(seed=seed), roughness=0.36, double_sided=True)
    foliage = (
        Part(merge(leaves), strap),
        Part(merge(canes), Material("cane", base_color_texture=textures.bark(seed), roughness=0.9)),
    )
    clay = Material("pot_terracotta", base_color_texture=textures.terracotta(seed), roughness=0.85)
    return _within(foliage, _pot(radius, pot_height, -height / 2, clay, seed), soil_z, extent_m)


def snake_plant(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A sansevieria: stiff upright leaves that taper to a point, in a pale pot."""
    rng = np.random.default_rng(seed)
    width, depth, height = extent_m
    radius, pot_height = 0.36 * min(width, depth), height * 0.30
    soil_z = -height / 2 + pot_height * 0.89
    share = np.linspace(0.0, 1.0, 9)
    leaves = []
    for index in range(17):
        azimuth = index * _GOLDEN_ANGLE
        base = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) * radius * 0.62 * np.sqrt(index / 17) + [
            0,
            0,
            soil_z - 0.01,
        ]
        rise = 86.0 - 15.0 * index / 17 + rng.uniform(-3, 3) - 6.0 * share**2
        length = height * rng.uniform(0.48, 0.72) * (1.0 - 0.25 * index / 17)
        half_width = 0.026 * (1.0 - share**3) * (0.75 + 0.5 * np.sin(np.pi * share)) + 0.0008
        leaves.append(_blade(base, azimuth + rng.uniform(-0.5, 0.5), rise, length, half_width, 0.35, 5))
    skin = textures.strap_leaf((0.25, 0.36, 0.22), (0.72, 0.70, 0.36), seed)
    leaf = Material("snake leaf", base_color_texture=skin, roughness=0.42, double_sided=True)
    glaze = Material(
        "pot_pale", base_color_texture=textures.stoneware((0.86, 0.84, 0.80), seed=seed + 2), roughness=0.4
    )
    return _within((Part(merge(leaves), leaf),), _pot(radius, pot_height, -height / 2, glaze, seed), soil_z, extent_m)


def cactus(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A ribbed column cactus with a side shoot, in a clay pot."""
    width, depth, height = extent_m
    radius, pot_height = 0.46 * min(width, depth), height * 0.36
    soil_z = -height / 2 + pot_height * 0.89

    def column(foot: Floats, tall: float, thick: float) -> Mesh:
        share = np.linspace(0.0, 1.0, 13)
        angle = np.linspace(0.0, 2.0 * np.pi, 61)
        girth = (
            thick
            * np.sqrt(np.clip(1.0 - (2.0 * share - 1.0).clip(0.0) ** 2.6, 0.0, 1.0))
            * (0.86 + 0.14 * np.sin(np.pi * share))
        )
        ribs = 1.0 + 0.10 * np.abs(np.cos(5.0 * angle)) ** 0.7
        ring = girth[:, None] * ribs
        points = (
            np.stack([ring * np.cos(angle), ring * np.sin(angle), tall * share[:, None] + 0 * angle], axis=2) + foot
        )
        uvs = np.stack(np.broadcast_arrays(angle / (2.0 * np.pi), share[:, None]), axis=2)
        return grid_surface(points[:, ::-1], uvs[:, ::-1], crease_deg=70.0)

    green = Material("cactus", base_color_texture=textures.cactus_skin(seed), roughness=0.65)
    body = [
        column(np.array([0.0, 0.0, soil_z - 0.01]), height / 2 - soil_z + 0.01, radius * 0.44),
        column(np.array([radius * 0.46, radius * 0.2, soil_z - 0.01]), height * 0.34, radius * 0.26),
    ]
    clay = Material("pot_terracotta", base_color_texture=textures.terracotta(seed), roughness=0.85)
    parts = (Part(merge(body), green), *_pot(radius, pot_height, -height / 2, clay, seed))
    return fit_to_box(parts, extent_m, may_turn=False)


def _pot(radius: float, height: float, base_z: float, material: Material, seed: int) -> Model:
    """A tapered pot with a rolled rim, filled with soil to 0.89 of its height."""
    wall = 0.006
    outer = catmull_rom(
        [
            (radius * 0.70, 0.004),
            (radius * 0.78, height * 0.25),
            (radius * 0.90, height * 0.72),
            (radius * 0.93, height * 0.80),
        ],
        12,
    )
    rim = [
        (radius * 0.985, height * 0.81),
        (radius, height * 0.83),
        (radius, height * 0.97),
        (radius - 0.003, height),
        (radius - wall + 0.001, height),
        (radius - wall - 0.001, height * 0.97),
        (radius - wall - 0.002, height * 0.80),
    ]
    shell = lathe(np.concatenate([[(0.0, 0.0), (radius * 0.67, 0.0)], outer, rim]), 48, crease_deg=45.0)
    rng = np.random.default_rng(seed)
    distance, angle = np.meshgrid(
        np.linspace(0.0, radius - wall - 0.0015, 9), np.linspace(0.0, 2.0 * np.pi, 33), indexing="ij"
    )
    x, y = distance * np.cos(angle), distance * np.sin(angle)
    lumps = sum(np.sin(rng.uniform(60, 160) * x + rng.uniform(60, 160) * y + rng.uniform(0, 6)) for _ in range(6))
    earth = np.stack([x, y, 0.89 * height + 0.0010 * lumps], axis=2)
    surface = grid_surface(earth, np.stack([x, y], axis=2))
    soil = Material("soil", base_color_texture=textures.soil(seed), roughness=1.0)
    return placed((Part(shell, material), Part(surface, soil)), (0.0, 0.0, base_z))


def _blade(
    base: Floats,
    azimuth: float,
    rise_deg: Floats,
    length: float,
    half_width: Floats,
    fold: float,
    columns: int,
    ruffle: Floats | float = 0.0,
) -> Mesh:
    """A leaf along a spine that leaves `base` towards `azimuth`.

    `rise_deg` and `half_width` (K,) go from stalk to tip; `fold` lifts the margins; u runs across, v along, both 0–1.
    """
    rows = len(half_width)
    rise = np.radians(rise_deg)
    outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    side = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    direction = np.cos(rise)[:, None] * outward + np.sin(rise)[:, None] * np.array([0.0, 0.0, 1.0])
    steps = (direction[1:] + direction[:-1]) / 2 * (length / (rows - 1))
    spine = base + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    up = np.cross(direction, side)
    across = np.linspace(-1.0, 1.0, columns)
    lift = half_width[:, None] * fold * np.abs(across) + ruffle * np.abs(across)
    points = spine[:, None] + (half_width[:, None] * across)[..., None] * side + lift[..., None] * up[:, None]
    v, u = np.meshgrid(np.linspace(0.0, 1.0, rows), (across + 1.0) / 2.0, indexing="ij")
    return grid_surface(points, np.stack([u, v], axis=2), crease_deg=80.0)


def _broad_leaf(node: Floats, azimuth: float, rise_deg: float, length: float, rng: np.random.Generator) -> Mesh:
    t = np.linspace(0.0, 1.0, 10)
    half_width = 0.30 * length * np.maximum(np.sin(np.pi * t**0.78), 0.0) ** 0.85 * (1.0 - 0.25 * t) + 0.0006
    droop = rise_deg + 14.0 - (62.0 + rng.uniform(-10.0, 14.0)) * t**1.3
    ruffle = 0.0018 * np.sin(t * 13.0 + rng.uniform(0.0, 6.0))[:, None]
    base = node + _along(azimuth, rise_deg + 20.0) * 0.22 * length
    return _blade(base, azimuth, droop, length, half_width, 0.30, 5, ruffle)


def _petiole(node: Floats, azimuth: float, rise_deg: float, length: float) -> Mesh:
    direction = _along(azimuth, rise_deg + 20.0)
    return tube(
        np.stack([node, node + direction * 0.13 * length, node + direction * 0.24 * length]), 0.0011, 5, caps=False
    )


def _strap(base: Floats, azimuth: float, rise_deg: float, length: float, rng: np.random.Generator) -> Mesh:
    t = np.linspace(0.0, 1.0, 11)
    half_width = (
        0.0215 * (0.55 + 0.45 * np.sin(np.pi * np.clip(t * 1.15 + 0.08, 0.0, 1.0))) * (1.0 - t**5) ** 0.8 + 0.0004
    )
    droop = rise_deg - (70.0 + rng.uniform(-14.0, 20.0)) * np.cos(np.radians(max(rise_deg, 0.0))) ** 0.5 * t**1.5
    return _blade(base, azimuth, droop, length, half_width, 0.35, 3)


def _along(azimuth: float, rise_deg: float) -> Floats:
    rise = np.radians(rise_deg)
    return np.array([np.cos(azimuth) * np.cos(rise), np.sin(azimuth) * np.cos(rise), np.sin(rise)])


def _within(foliage: Model, pot: Model, soil_z: float, extent_m: Sequence[float]) -> Model:
    """Foliage and pot in exactly this box.

    Each of the foliage's six sides is scaled on its own about the middle of the soil, so that the stems stay in a
    round pot.
    """
    half = np.asarray(extent_m, float) / 2
    origin = np.array([0.0, 0.0, soil_z])
    vertices = np.concatenate([part.mesh.vertices for part in foliage]) - origin
    upper = (half - origin) / vertices.max(axis=0)
    lower = (half + origin) / -np.minimum(vertices.min(axis=0), -1e-9)
    lower[2] = 1.0

    def scaled(mesh: Mesh) -> Mesh:
        local = mesh.vertices - origin
        scale = np.where(local >= 0.0, upper, lower)
        normals = mesh.normals / scale
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return replace(mesh, vertices=local * scale + origin, normals=normals)

    grown = tuple(Part(scaled(part.mesh), part.material) for part in foliage)
    return fit_to_box((*grown, *pot), extent_m, may_turn=False)
