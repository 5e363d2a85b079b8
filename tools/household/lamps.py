"""Lamps whose shades and bulbs glow; each has fewer than 200 glowing triangles, for each is a source of light.

Radiance 1 is 10,000 cd/m². Ceiling lamps hang from z = 0 downwards, others stand on z = 0.
"""

from __future__ import annotations

import numpy as np

from tools.household import materials, textures
from tools.household.joinery import leg
from tools.household.model import Material, Mesh, Model, Part, merge, moved, rotated
from tools.household.outlines import catmull_rom
from tools.household.planks import board
from tools.household.shapes import bevelled_box, cylinder, ellipsoid, lathe, tube

_WARM = "#ffd9a6"


def glow(name: str, radiance: float, code: str = _WARM) -> Material:
    """A shade or bulb of the given radiance."""
    return materials.glowing(f"{name} {radiance} {code}", textures.linear_color(code), radiance)


def bulb(radius: float, z: float) -> Mesh:
    """A bulb of 80 triangles about (0, 0, z)."""
    return moved(ellipsoid((radius, radius, radius * 1.2), 8, 6), z=z)


def drum(low_radius: float, high_radius: float, low: float, high: float) -> Mesh:
    """A cloth shade, both sides of it, of 96 triangles."""
    outer = [(low_radius, low), (high_radius, high)]
    inner = [(radius - 0.004, z) for radius, z in outer[::-1]]
    return merge([lathe(outer, 24), lathe(inner, 24)])


def floor_lamp(height: float, metal: Material, shade: Material) -> Model:
    """A drum shade on a straight pole."""
    base = lathe([(0, 0), (0.135, 0), (0.14, 0.006), (0.135, 0.016), (0.03, 0.022), (0.012, 0.03), (0.011, 0.05)], 32)
    pole = tube([(0, 0, 0.03), (0, 0, height - 0.05)], 0.0095, 10)
    spider = [
        tube([(0, 0, height - 0.05), (0.16 * np.cos(a), 0.16 * np.sin(a), height - 0.02)], 0.002, 5)
        for a in (0, 2.094, 4.189)
    ]
    return Part(merge([base, pole, *spider]), metal), Part(drum(0.20, 0.165, height - 0.30, height), shade)


def tripod_lamp(height: float, wood: Material, shade: Material) -> Model:
    """A wide shade on three wooden legs."""
    top = height - 0.30
    feet = [(0.30 * np.cos(a), 0.30 * np.sin(a)) for a in np.radians([0, 120, 240])]
    legs = [leg((x, y, 0), (x * 0.06, y * 0.06, top), 0.011, 0.015, sides=12) for x, y in feet]
    hub = moved(cylinder(0.035, 0.05, segments=18), z=top - 0.03)
    return (
        Part(merge(legs), wood),
        Part(merge([hub, tube([(0, 0, top), (0, 0, top + 0.10)], 0.008, 8)]), materials.brass()),
        Part(drum(0.25, 0.22, height - 0.30, height), shade),
    )


def arc_lamp(height: float, reach: float, metal: Material, light: Material) -> Model:
    """A dome at the end of a bow that reaches towards +x from a stone foot."""
    foot = moved(cylinder(0.15, 0.06, 0.006, 28), -reach / 2)
    line = catmull_rom(
        [
            (-reach / 2, 0, 0.05),
            (-reach / 2, 0, height * 0.6),
            (-reach * 0.30, 0, height * 0.93),
            (0, 0, height),
            (reach * 0.40, 0, height * 0.93),
            (reach / 2, 0, height * 0.82),
        ],
        28,
    )
    dome = np.array([(0.16, -0.13), (0.155, -0.08), (0.12, -0.03), (0.06, 0.0), (0.02, 0.012), (0.0, 0.014)])
    shade = moved(merge([lathe(dome, 28), lathe(_inside(dome), 28)]), reach / 2, 0, height * 0.82)
    return (
        Part(foot, materials.ceramic()),
        Part(merge([tube(line, 0.011, 10), shade]), metal),
        Part(moved(bulb(0.045, -0.075), reach / 2, 0, height * 0.82), light),
    )


def _inside(profile: np.ndarray) -> np.ndarray:
    """The inner wall of a dome's profile, listed from its top down."""
    inner = profile[::-1].copy()
    inner[:, 0] = np.maximum(inner[:, 0] - 0.004, 0.0)
    inner[:, 1] = inner[:, 1] - np.where(inner[:, 0] < 0.1, 0.004, 0.0)
    return inner


def desk_lamp(metal: Material, light: Material) -> Model:
    """A jointed lamp that leans towards +x."""
    base = lathe([(0, 0), (0.085, 0), (0.085, 0.012), (0.012, 0.020)], 28)
    arms = [
        tube([(0, 0, 0.015), (-0.09, 0, 0.22)], 0.006, 8),
        tube([(-0.09, 0, 0.22), (0.09, 0, 0.42)], 0.006, 8),
        moved(rotated(cylinder(0.013, 0.03, segments=14), "x", 90.0), -0.09, 0.015, 0.22),
        moved(rotated(cylinder(0.013, 0.03, segments=14), "x", 90.0), 0.09, 0.015, 0.42),
    ]
    cone = np.array([(0.075, -0.085), (0.058, -0.05), (0.030, -0.015), (0.022, 0.03), (0.0, 0.034)])
    head = merge([lathe(cone, 24), lathe(_inside(cone), 24)])
    place = (0.115, 0.0, 0.415)
    return (
        Part(merge([base, *arms, moved(rotated(head, "y", -28.0), *place)]), metal),
        Part(moved(rotated(bulb(0.028, -0.045), "y", -28.0), *place), light),
    )


def table_lamp(width: float, height: float, body: Material, shade: Material, is_round: bool) -> Model:
    """A cloth shade on a turned or cylindrical body."""
    radius, neck = width / 2, height * 0.50
    if is_round:
        profile = [
            (0, 0),
            (radius * 0.34, 0),
            (radius * 0.36, neck * 0.05),
            (radius * 0.62, neck * 0.38),
            (radius * 0.50, neck * 0.70),
            (radius * 0.16, neck * 0.95),
            (radius * 0.10, neck),
        ]
    else:
        profile = [
            (0, 0),
            (radius * 0.45, 0),
            (radius * 0.45, neck * 0.06),
            (radius * 0.14, neck * 0.09),
            (radius * 0.12, neck),
        ]
    foot = lathe(catmull_rom(profile[1:], 22), 28, crease_deg=55.0)
    stem = tube([(0, 0, neck - 0.01), (0, 0, height * 0.78)], 0.006, 8)
    spider = [
        tube([(0, 0, height * 0.78), (radius * 0.8 * np.cos(a), radius * 0.8 * np.sin(a), height * 0.96)], 0.0018, 5)
        for a in (0, 2.094, 4.189)
    ]
    return (
        Part(merge([foot, lathe([(radius * 0.45, 0.0005), (0, 0)][::-1], 20)]), body),
        Part(merge([stem, *spider]), materials.brass()),
        Part(drum(radius, radius * 0.80, height * 0.52, height), shade),
    )


def globe_lamp(radius: float, base: Material, light: Material) -> Model:
    """A glowing ball on a ring."""
    ring = lathe(
        [(0, 0), (radius * 0.62, 0), (radius * 0.66, 0.008), (radius * 0.60, radius * 0.30), (0, radius * 0.30)], 28
    )
    return Part(ring, base), Part(moved(ellipsoid((radius, radius, radius), 14, 7), z=radius * 1.18), light)


def pendant(length: float, style: str, metal: Material, light: Material) -> Model:
    """A lamp on a cord; `style` is dome, globe or drum."""
    rose = lathe([(0, -0.03), (0.045, -0.03), (0.055, -0.012), (0.055, 0), (0, 0)], 24)
    cord = tube([(0, 0, -0.02), (0, 0, -length + 0.02)], 0.003, 6)
    if style == "globe":
        cap = moved(cylinder(0.03, 0.05, segments=16), z=-length - 0.01)
        return Part(merge([rose, cord, cap]), metal), Part(
            moved(ellipsoid((0.15, 0.15, 0.15), 14, 7), z=-length - 0.14), light
        )
    if style == "drum":
        spider = [
            tube([(0, 0, -length), (0.235 * np.cos(a), 0.235 * np.sin(a), -length)], 0.003, 5)
            for a in (0, 2.094, 4.189)
        ]
        return Part(merge([rose, cord, *spider]), metal), Part(drum(0.24, 0.24, -length - 0.24, -length + 0.01), light)
    dome = np.array(
        [(0.21, -0.17), (0.205, -0.12), (0.16, -0.05), (0.08, -0.008), (0.03, 0.0), (0.028, 0.05), (0.0, 0.052)]
    )
    shade = moved(merge([lathe(dome, 32), lathe(_inside(dome), 32)]), z=-length)
    return Part(merge([rose, cord, shade]), metal), Part(bulb(0.055, -length - 0.10), light)


def ceiling_lamp(style: str, metal: Material, light: Material) -> Model:
    """A flat lamp on the ceiling: disc, or panel (0.6 m square, for offices)."""
    if style == "panel":
        frame = [board((-0.30, y - 0.012, -0.035), (0.30, y + 0.012, 0.0), 0.002) for y in (-0.288, 0.288)] + [
            board((x - 0.012, -0.276, -0.035), (x + 0.012, 0.276, 0.0), 0.002) for x in (-0.288, 0.288)
        ]
        return Part(merge(frame), metal), Part(bevelled_box((0.55, 0.55, 0.02), (0, 0, -0.020), 0.001), light)
    rim = lathe([(0.19, -0.04), (0.20, -0.04), (0.20, 0.0), (0, 0.0)], 40)
    return Part(rim, metal), Part(
        lathe([(0, -0.075), (0.10, -0.070), (0.16, -0.058), (0.19, -0.038)], 24, crease_deg=60.0), light
    )
