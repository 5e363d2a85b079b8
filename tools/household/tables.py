"""Tables, centred on their middle, standing on z = 0; the assembly fits them to their boxes."""

from __future__ import annotations

import numpy as np

from tools.household.joinery import board, grain_upright, leg
from tools.household.model import Material, Mesh, Model, Part, merge, moved, rotated
from tools.household.outlines import catmull_rom, circle, rounded_rectangle, smooth_profile
from tools.household.shapes import extrude, lathe, sweep


def low_table(wood: Material) -> Model:
    """A low side table with a slatted shelf and splayed legs; 0.605 x 0.405 x 0.3455 m."""
    width, depth, height = 0.6047, 0.4048, 0.3455
    top = moved(extrude(rounded_rectangle(width, depth, 0.035, 6), 0.022, bevel=0.006, segments=3), z=height - 0.022)
    corners = [(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    legs = [leg((x * 0.272, y * 0.172, 0), (x * 0.235, y * 0.138, height - 0.02), 0.0105, 0.0175) for x, y in corners]
    rails = [
        *(board((-0.235, y - 0.009, height - 0.072), (0.235, y + 0.009, height - 0.02)) for y in (-0.138, 0.138)),
        *(board((x - 0.009, -0.138, height - 0.072), (x + 0.009, 0.138, height - 0.02)) for x in (-0.235, 0.235)),
        *(board((x - 0.012, -0.150, 0.100), (x + 0.012, 0.150, 0.118), 0.003) for x in (-0.25, 0.25)),
    ]
    slats = [board((-0.262, y - 0.019, 0.118), (0.262, y + 0.019, 0.130), 0.003) for y in np.linspace(-0.118, 0.118, 5)]
    return (Part(merge([top, *legs, *rails, *slats]), wood),)


def round_table(wood: Material) -> Model:
    """A round pedestal table: turned column on four swept feet; diameter 0.94 m, height 0.666 m."""
    radius, height = 0.4775, 0.6659
    rim = [
        (radius - 0.05, height - 0.034),
        (radius - 0.018, height - 0.030),
        (radius - 0.006, height - 0.022),
        (radius, height - 0.011),
        (radius - 0.004, height - 0.003),
        (radius - 0.011, height),
    ]
    edge = lathe(rim, 72, crease_deg=40.0)
    lid = moved(extrude(circle(radius - 0.011, 72), 0.0005), z=height - 0.0005)
    under = moved(extrude(circle(radius - 0.05, 72), 0.0005), z=height - 0.034)
    spread = lathe([(0.05, height - 0.062), (0.17, height - 0.056), (0.175, height - 0.034)], 32)
    column = lathe(
        smooth_profile(
            [
                (0.052, 0.10),
                (0.062, 0.13),
                (0.066, 0.18),
                (0.052, 0.225),
                (0.040, 0.25),
                (0.047, 0.262),
                (0.040, 0.275),
                (0.036, 0.36),
                (0.043, 0.47),
                (0.056, 0.545),
                (0.050, 0.57),
                (0.062, 0.585),
                (0.062, 0.612),
            ],
            60,
        ),
        28,
    )
    parts = [edge, lid, under, *(grain_upright(turned) for turned in (spread, column, _foot_ring()))]
    parts += [rotated(_swept_foot(), "z", 45.0 + 90.0 * quarter) for quarter in range(4)]
    return (Part(merge(parts), wood),)


def _foot_ring() -> Mesh:
    return lathe([(0.0, 0.085), (0.045, 0.085), (0.054, 0.095), (0.054, 0.11)], 28)


def _swept_foot() -> Mesh:
    line = catmull_rom([(0.03, 0, 0.165), (0.10, 0, 0.168), (0.19, 0, 0.115), (0.28, 0, 0.045), (0.345, 0, 0.020)], 22)
    taper = np.linspace(1.0, 0.62, 22)
    taper[-1] *= 0.75
    thickness = np.column_stack([taper, np.interp(np.linspace(0, 1, 22), [0, 0.5, 1], [1.3, 1.0, 0.62])])
    foot = sweep(line, rounded_rectangle(0.044, 0.058, 0.012, 3), thickness)
    pad = lathe([(0.0, 0.0), (0.018, 0.0), (0.018, 0.012), (0.0, 0.012)], 14)
    return merge([foot, moved(pad, x=0.325)])
