"""Objects for the table and the kitchen: a cup, a crock of spoons, a bottle, bowls, a tray, a vase."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tools.household import materials, textures
from tools.household.model import Floats, Material, Mesh, Model, Part, fit_to_box, merge, moved, rotated
from tools.household.outlines import catmull_rom, circle, rounded_rectangle, smooth_profile
from tools.household.shapes import extrude, grid_surface, lathe, sweep, tube

if TYPE_CHECKING:
    from collections.abc import Sequence


def cup(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A small mug of coffee, its handle towards (+x, −y)."""
    width, depth, height = extent_m
    radius = 0.395 * min(width, depth)
    wall = 0.0028
    outer = catmull_rom(
        [
            (radius * 0.80, 0.0),
            (radius * 0.90, 0.004),
            (radius * 0.985, height * 0.2),
            (radius, height * 0.55),
            (radius, height - 0.002),
        ],
        18,
    )
    inner = catmull_rom(
        [
            (radius - wall, height - 0.002),
            (radius - wall, height * 0.5),
            (radius * 0.90 - wall, 0.012),
            (radius * 0.5, 0.007),
            (0.0, 0.006),
        ],
        14,
    )
    rim = [
        (radius - wall * 0.2, height - 0.0004),
        (radius - wall * 0.5, height),
        (radius - wall * 0.8, height - 0.0004),
    ]
    foot = [(0.0, 0.0015), (radius * 0.68, 0.0015), (radius * 0.72, 0.0)]
    body = lathe(np.concatenate([foot, outer, rim[:2]]), 40, crease_deg=60.0)
    lining = lathe(np.concatenate([rim[1:], inner]), 40, crease_deg=60.0)
    reach = radius * 2.16
    loop = catmull_rom(
        [
            (radius * 0.94, 0.0, height * 0.82),
            (radius * 1.45, 0.0, height * 0.86),
            (reach - 0.004, 0.0, height * 0.70),
            (reach - 0.003, 0.0, height * 0.50),
            (radius * 1.55, 0.0, height * 0.27),
            (radius * 0.93, 0.0, height * 0.22),
        ],
        26,
    )
    taper = 1.0 + 0.35 * np.abs(np.linspace(-1.0, 1.0, 26)) ** 6
    handle = rotated(sweep(loop, circle(1.0, 10) * (0.0046, 0.0030), taper, up=(0, 1, 0)), "z", -45.0)
    coffee = lathe([(radius - wall, height * 0.80), (0.0, height * 0.80)], 32)
    blue = textures.reactive_glaze((0.16, 0.27, 0.38), (0.32, 0.45, 0.52), seed)
    glaze = Material("cup_glaze", base_color_texture=blue, roughness=0.2)
    cream = Material("cup_lining", textures.linear_color("#ece5d6"), roughness=0.2)
    drink = Material("coffee", textures.linear_color("#2a140a"), roughness=0.08)
    parts = (Part(merge([body, handle]), glaze), Part(lining, cream), Part(coffee, drink))
    return fit_to_box(parts, extent_m, may_turn=False)


def spoons(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A wooden and a steel cooking spoon standing bowl-up in a small crock, fronts to −y."""
    width, depth, height = extent_m
    radius, rim = width * 0.47, height * 0.37
    base = -height / 2
    profile = [
        (0.0, 0.0),
        (radius * 0.88, 0.0),
        (radius * 0.94, 0.004),
        (radius, rim * 0.45),
        (radius * 0.97, rim * 0.94),
        (radius, rim * 0.985),
        (radius - 0.0015, rim),
        (radius - 0.0045, rim * 0.98),
        (radius - 0.0055, rim * 0.5),
        (radius - 0.006, 0.010),
        (0.0, 0.008),
    ]
    crock = moved(lathe(profile, 40, crease_deg=50.0), z=base)
    foot = np.array([0.0, 0.0, base + 0.012])
    wooden = _spoon(
        [
            foot + np.array([0.010, -0.012, 0.0]),
            (-width * 0.10, depth * 0.17, base + rim),
            (-width * 0.215, depth * 0.33, height / 2 - 0.076),
        ],
        bowl_length=0.078,
        bowl_width=0.051,
        handle_radius=0.0050,
    )
    steel = _spoon(
        [
            foot + np.array([-0.012, 0.010, 0.0]),
            (width * 0.10, -depth * 0.17, base + rim),
            (width * 0.20, -depth * 0.30, height / 2 - 0.104),
        ],
        bowl_length=0.070,
        bowl_width=0.047,
        handle_radius=0.0034,
    )
    glaze = Material(
        "crock_glaze",
        base_color_texture=textures.reactive_glaze((0.17, 0.22, 0.25), (0.28, 0.36, 0.38), seed),
        roughness=0.3,
    )
    metal = Material("spoon_steel", textures.linear_color("#d0cfcb"), roughness=0.18, metallic=1.0)
    return fit_to_box(
        (Part(crock, glaze), Part(wooden, materials.wood("beech")), Part(steel, metal)), extent_m, may_turn=False
    )


def washing_liquid(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A pump bottle of washing-up liquid with a label, spout and label to −y."""
    width, depth, height = extent_m
    radius = 0.5 * min(width, depth)
    base = -height / 2
    shoulder, neck = height * 0.60, height * 0.70
    curve = catmull_rom(
        [
            (radius, shoulder),
            (radius * 0.95, shoulder + 0.005),
            (radius * 0.78, shoulder + 0.009),
            (radius * 0.42, neck - 0.002),
            (radius * 0.36, neck),
        ],
        20,
    )
    body = moved(
        lathe(
            np.concatenate(
                [[(0.0, 0.0), (radius * 0.90, 0.0), (radius * 0.97, 0.002), (radius, 0.007)], curve, [(0.0, neck)]]
            ),
            48,
            crease_deg=60.0,
        ),
        z=base,
    )
    label = _label(radius + 0.00025, base + 0.012, base + shoulder - 0.004)
    collar = lathe(
        [
            (0.0, neck - 0.003),
            (radius * 0.46, neck - 0.003),
            (radius * 0.48, neck - 0.001),
            (radius * 0.48, neck + 0.009),
            (radius * 0.44, neck + 0.011),
            (radius * 0.17, neck + 0.012),
            (radius * 0.17, height * 0.90),
            (0.0, height * 0.90),
        ],
        32,
    )
    head = lathe(
        [
            (0.0, height * 0.885),
            (radius * 0.36, height * 0.885),
            (radius * 0.40, height * 0.90),
            (radius * 0.40, height * 0.975),
            (radius * 0.34, height),
            (0.0, height),
        ],
        32,
    )
    spout = tube(
        catmull_rom(
            [
                (0.0, 0.0, height * 0.945),
                (0.0, -radius * 0.6, height * 0.95),
                (0.0, -radius * 0.92, height * 0.93),
                (0.0, -radius * 0.93, height * 0.885),
            ],
            14,
        ),
        np.linspace(0.0048, 0.0026, 14),
        12,
    )
    pump = moved(merge([collar, head, spout]), z=base)
    plastic = Material("bottle_amber", textures.linear_color("#6b3410"), roughness=0.12)
    paper = Material("bottle_label", base_color_texture=textures.bottle_label(label[1], label[2]), roughness=0.5)
    black = Material("bottle_pump", textures.linear_color("#1d1c1b"), roughness=0.35)
    return fit_to_box((Part(body, plastic), Part(label[0], paper), Part(pump, black)), extent_m, may_turn=False)


def bowl(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A shallow glazed bowl."""
    width, _, height = extent_m
    radius = width / 2
    outer = catmull_rom(
        [
            (radius * 0.42, height * 0.06),
            (radius * 0.70, height * 0.28),
            (radius * 0.92, height * 0.68),
            (radius, height * 0.985),
        ],
        16,
    )
    inner = catmull_rom(
        [
            (radius - 0.005, height * 0.98),
            (radius * 0.88, height * 0.66),
            (radius * 0.62, height * 0.30),
            (radius * 0.30, height * 0.16),
            (0.0, height * 0.13),
        ],
        16,
    )
    foot = [(0.0, height * 0.03), (radius * 0.34, height * 0.03), (radius * 0.36, 0.0), (radius * 0.41, 0.0)]
    mesh = lathe(np.concatenate([foot, outer, [(radius - 0.0025, height)], inner]), 48, crease_deg=60.0)
    glaze = Material("bowl_glaze", base_color_texture=textures.reactive_glaze(seed=seed), roughness=0.25)
    return fit_to_box((Part(mesh, glaze),), extent_m, may_turn=False)


def vase(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A matt bottle vase."""
    width, _, height = extent_m
    radius = width / 2
    outer = smooth_profile(
        [
            (radius * 0.55, 0.0),
            (radius * 0.83, height * 0.10),
            (radius, height * 0.32),
            (radius * 0.74, height * 0.58),
            (radius * 0.32, height * 0.76),
            (radius * 0.26, height * 0.88),
            (radius * 0.36, height),
        ],
        40,
    )
    inner = [
        (radius * 0.36 - 0.004, height),
        (radius * 0.27 - 0.004, height * 0.90),
        (radius * 0.27 - 0.004, height * 0.76),
        (0.0, height * 0.70),
    ]
    mesh = lathe(np.concatenate([[(0.0, 0.0)], outer, inner]), 44, crease_deg=60.0)
    clay = Material("vase_clay", base_color_texture=textures.stoneware((0.72, 0.55, 0.44), seed=seed), roughness=0.7)
    return fit_to_box((Part(mesh, clay),), extent_m, may_turn=False)


def tray(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A rectangular wooden tray with raised edges."""
    width, depth, height = extent_m
    outline = rounded_rectangle(width, depth, 0.02)
    floor = extrude(outline, height * 0.3, bevel=0.002)
    edge = extrude(outline, height, bevel=0.002, holes=[rounded_rectangle(width - 0.016, depth - 0.016, 0.013)])
    return fit_to_box((Part(merge([floor, edge]), materials.wood("walnut", seed)),), extent_m, may_turn=False)


def _spoon(path: Sequence[Sequence[float]], bowl_length: float, bowl_width: float, handle_radius: float) -> Mesh:
    """A spoon along a path from the end of its handle to the neck; the bowl goes on from there, hollow to −y."""
    line = catmull_rom(path, 16)
    direction = line[-1] - line[-2]
    direction /= np.linalg.norm(direction)
    handle = tube(line, handle_radius * np.linspace(1.15, 0.80, 16), 10)
    side = np.cross(direction, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    back = np.cross(side, direction)
    if back[1] < 0.0:
        side, back = -side, -back
    around, rings = 24, 7
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    center = line[-1] + direction * (bowl_length / 2 - 0.004)

    def shell(offset: float, shrink: float) -> Floats:
        radius = np.linspace(1.0, 0.0, rings)[:, None] * shrink
        # An egg: broad towards the tip, drawn out towards the neck.
        along = radius * np.cos(angle) * bowl_length / 2
        across = radius * np.sin(angle) * bowl_width / 2 * (1.0 + 0.14 * np.cos(angle))
        depth = 0.24 * bowl_width * (1.0 - radius**2) + offset + 0 * angle
        offsets = np.stack([along, across, depth], axis=2)
        return np.asarray(center + offsets @ np.stack([direction, side, back]), dtype=np.float64)

    thickness = 0.0022
    outside, inside = shell(thickness, 1.0), shell(0.0, 0.985)
    surface = np.concatenate([inside[::-1], outside])
    return merge([handle, grid_surface(surface, close_columns=True, crease_deg=70.0)])


def _label(radius: float, low: float, high: float) -> tuple[Mesh, float, float]:
    """A curved label of 150° facing −y: mesh, width and height in metres."""
    angle = np.radians(np.linspace(-165.0, -15.0, 25))
    width, height = radius * float(np.ptp(angle)), high - low
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = np.stack([np.column_stack([ring, np.full(25, z)]) for z in (high, low)])
    u = (angle - angle[0]) * radius
    uvs = np.stack([np.stack([u, np.full(25, v)], axis=1) for v in (height, 0.0)])
    return grid_surface(points, uvs), width, height
