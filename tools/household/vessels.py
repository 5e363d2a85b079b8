"""Bottles, glasses, cups and bowls: turned shapes standing on z = 0, labels to +x."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tools.household import materials
from tools.household.model import Material, Mesh, Model, Part, Texture, merge, moved
from tools.household.outlines import catmull_rom
from tools.household.shapes import grid_surface, lathe, sweep
from tools.household.textures import labels, linear_color

Profile = Sequence[tuple[float, float]]


def label(radius: float, low: float, high: float, span_deg: float, picture: Texture) -> Mesh:
    """A curved sheet about the z axis that looks to +x; the picture covers it once."""
    angle = np.radians(np.linspace(-span_deg / 2, span_deg / 2, 17))
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = np.stack([np.column_stack([ring, np.full(17, z)]) for z in (high, low)])
    u = np.linspace(0, picture.width_m, 17)
    uvs = np.stack([np.stack([u, np.full(17, v)], axis=1) for v in (picture.height_m, 0.0)])
    return grid_surface(points, uvs)


def bottle(
    outline: Profile, glass: Material, sleeve: tuple[float, float, str, str, str, str], cap: tuple[Profile, Material]
) -> Model:
    """A bottle: its outline from foot to lip, its sleeve (low, high, title, note, ground, ink), its cap."""
    foot = [(0.0, 0.004), (outline[0][0] * 0.75, 0.004), (outline[0][0] * 0.92, 0.0)]
    curve = catmull_rom(outline, 26)
    body = lathe(np.concatenate([foot, curve, [(0.0, outline[-1][1])]]), 32, crease_deg=55.0)
    low, high, title, note, ground, ink = sleeve
    middle = (low + high) / 2
    rising = curve[np.argsort(curve[:, 1])]
    radius = float(np.interp(middle, rising[:, 1], rising[:, 0])) + 0.0005
    span = 150.0
    picture = labels.bottle_sleeve(radius * np.radians(span), high - low, title, note, ground, ink)
    paper = Material(f"label {title}", base_color_texture=picture, roughness=0.6)
    return Part(body, glass), Part(label(radius, low, high, span, picture), paper), Part(lathe(cap[0], 24), cap[1])


def wine_bottle(glass: str, title: str, ground: str, ink: str, foil: str) -> Model:
    """A bottle of wine, 0.30 m, with a foil over its cork."""
    outline = [
        (0.0365, 0.003),
        (0.0375, 0.010),
        (0.0375, 0.10),
        (0.0375, 0.185),
        (0.034, 0.205),
        (0.020, 0.228),
        (0.0148, 0.245),
        (0.0140, 0.292),
    ]
    cap = [
        (0.0150, 0.243),
        (0.0146, 0.255),
        (0.0146, 0.283),
        (0.0157, 0.285),
        (0.0157, 0.295),
        (0.0145, 0.300),
        (0.0, 0.300),
    ]
    return bottle(
        outline,
        materials.paint(glass, 0.06),
        (0.055, 0.135, title, "2019", ground, ink),
        (cap, materials.paint(foil, 0.3)),
    )


def water_bottle() -> Model:
    """A clear bottle of water with a blue cap."""
    clear = Material("clear plastic", base_color=(0.93, 0.97, 1.0), roughness=0.02, transmission=1.0, double_sided=True)
    outline = [
        (0.030, 0.003),
        (0.0325, 0.012),
        (0.0325, 0.06),
        (0.030, 0.085),
        (0.0325, 0.11),
        (0.0325, 0.150),
        (0.027, 0.178),
        (0.0145, 0.196),
        (0.0130, 0.205),
    ]
    cap = [(0.0155, 0.198), (0.0155, 0.215), (0.0145, 0.218), (0.0, 0.218)]
    return bottle(
        outline,
        clear,
        (0.100, 0.145, "FONTE", "still water", "#2a6f9f", "#f4f8fa"),
        (cap, materials.paint("#2a6f9f", 0.35)),
    )


def milk_bottle() -> Model:
    """A white bottle of milk with a green cap."""
    outline = [
        (0.036, 0.003),
        (0.039, 0.012),
        (0.039, 0.10),
        (0.039, 0.150),
        (0.030, 0.178),
        (0.0185, 0.200),
        (0.0175, 0.218),
    ]
    cap = [(0.0200, 0.212), (0.0200, 0.230), (0.0188, 0.233), (0.0, 0.233)]
    return bottle(
        outline,
        materials.paint("#f2f0e9", 0.25),
        (0.050, 0.125, "ALM", "whole milk", "#3f7d57", "#f5f3ea"),
        (cap, materials.paint("#3f7d57", 0.4)),
    )


def wine_glass(radius: float, bowl_m: float, stem_m: float, lip: float, filled: float, wine: str) -> Model:
    """A stemmed glass; `lip` is the rim's radius by the bowl's, `filled` the share of the bowl that holds wine."""
    clear = Material("glass", base_color=(1.0, 1.0, 1.0), roughness=0.0, transmission=1.0, double_sided=True)
    foot = [(0.0, 0.0), (radius * 0.92, 0.0), (radius * 0.92, 0.0015), (radius * 0.3, 0.005), (0.0042, 0.012)]
    neck = [(0.0036, 0.012 + stem_m * 0.4), (0.0042, stem_m)]
    shape = catmull_rom(
        [
            (0.0042, stem_m),
            (radius * 0.62, stem_m + bowl_m * 0.12),
            (radius, stem_m + bowl_m * 0.42),
            (radius * 0.95, stem_m + bowl_m * 0.75),
            (radius * lip, stem_m + bowl_m),
        ],
        18,
    )
    vessel = lathe(np.concatenate([foot, neck, shape[1:]]), 28, crease_deg=60.0)
    parts = [Part(vessel, clear)]
    if filled > 0:
        level = stem_m + bowl_m * filled
        inside = np.array([(max(r - 0.0012, 0.001), z) for r, z in shape if z < level])
        surface_radius = float(np.interp(level, shape[:, 1], shape[:, 0])) - 0.0012
        liquid = lathe(
            np.concatenate([[(0.0, stem_m + 0.002)], inside[1:], [(surface_radius, level), (0.0, level)]]),
            28,
            crease_deg=50.0,
        )
        parts.append(Part(liquid, Material(f"wine {wine}", linear_color(wine), roughness=0.05)))
    return tuple(parts)


def mug(
    radius: float,
    height: float,
    foot: float,
    glaze: Material,
    lining: Material,
    drink: str | None,
    thick: float = 0.004,
) -> Model:
    """A cup with a handle at +y; `foot` is its lower radius by its upper one."""
    outer = catmull_rom(
        [
            (radius * foot, 0.0),
            (radius * (0.65 * foot + 0.35), height * 0.18),
            (radius * 0.98, height * 0.62),
            (radius, height - 0.001),
        ],
        14,
    )
    rim = [(radius - thick * 0.3, height), (radius - thick * 0.7, height)]
    body = lathe(np.concatenate([[(0.0, 0.002), (radius * foot * 0.85, 0.002)], outer, rim]), 32, crease_deg=60.0)
    level = height * 0.84
    inner_radius = radius - thick
    lower = radius * foot - thick if drink is None else inner_radius
    bottom = 0.006 if drink is None else level - 0.002
    lining_mesh = lathe(
        [
            rim[1],
            (inner_radius, height - 0.002),
            (inner_radius * 0.98, level),
            *([(lower, height * 0.2), (lower * 0.6, bottom), (0.0, bottom)] if drink is None else []),
        ],
        32,
        crease_deg=60.0,
    )
    reach = radius * 0.62
    loop = catmull_rom(
        [
            (0, radius * 0.93, height * 0.80),
            (0, radius + reach * 0.7, height * 0.84),
            (0, radius + reach, height * 0.60),
            (0, radius + reach * 0.8, height * 0.36),
            (0, radius * (0.75 * foot + 0.22), height * 0.24),
        ],
        18,
    )
    ear = sweep(
        loop,
        [(np.cos(a) * thick * 1.3, np.sin(a) * thick * 0.8) for a in np.linspace(0, 2 * np.pi, 8, endpoint=False)],
        up=(1, 0, 0),
    )
    parts = [Part(merge([body, ear]), glaze), Part(lining_mesh, lining)]
    if drink is not None:
        parts.append(
            Part(
                lathe([(inner_radius * 0.985, level), (0.0, level)], 28),
                Material(f"drink {drink}", linear_color(drink), roughness=0.06),
            )
        )
    return tuple(parts)


def saucer(radius: float, glaze: Material) -> Part:
    """A saucer under a teacup."""
    profile = [
        (0, 0.003),
        (radius * 0.5, 0.003),
        (radius * 0.54, 0.0),
        (radius * 0.60, 0.002),
        (radius, 0.016),
        (radius * 0.99, 0.0175),
        (radius * 0.58, 0.006),
        (0, 0.0055),
    ]
    return Part(lathe(profile, 32, crease_deg=45.0), glaze)


def teacup(glaze: Material) -> Model:
    """A teacup on its saucer."""
    cup = mug(0.045, 0.062, 0.50, glaze, glaze, "#7a3b14", 0.0028)
    return (saucer(0.075, glaze), *(Part(moved(part.mesh, z=0.006), part.material) for part in cup))


def bowl(radius: float, height: float, glaze: Material, lining: Material, steep: float = 0.5) -> Model:
    """An open bowl with a foot; `steep` from flat (0) to upright (1) walls."""
    outer = catmull_rom(
        [
            (radius * 0.45, height * 0.05),
            (radius * (0.66 + 0.12 * steep), height * 0.30),
            (radius * (0.90 + 0.04 * steep), height * 0.68),
            (radius, height),
        ],
        14,
    )
    inner = [
        (radius * 0.975, height),
        *((r * 0.955, z + height * 0.05) for r, z in outer[-2:0:-2]),
        (radius * 0.3, height * 0.13),
        (0.0, height * 0.12),
    ]
    foot = [(0.0, height * 0.03), (radius * 0.36, height * 0.03), (radius * 0.38, 0.0), (radius * 0.44, 0.0)]
    outside = lathe(np.concatenate([foot, outer, [inner[0]]]), 36, crease_deg=60.0)
    return Part(outside, glaze), Part(lathe(inner, 36, crease_deg=60.0), lining)
