"""Chairs. Each faces +x, stands on z = 0 and is centred on its seat; the assembly fits it to its box."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tools.household.joinery import leg, turned_leg
from tools.household.model import Floats, Material, Mesh, Model, Part, merge, moved
from tools.household.outlines import catmull_rom
from tools.household.shapes import loft, sweep, tube

if TYPE_CHECKING:
    from collections.abc import Sequence


def _saddle(outline: Floats, thickness: float, dip: float) -> Mesh:
    """A seat board whose top is hollowed by `dip` in the middle."""
    layers = [(0.94, 0.0), (1.0, thickness * 0.5), (1.0, thickness - 0.006), (0.97, thickness - 0.001)]
    layers += [(share, thickness - dip * (1 - share**2) ** 1.5) for share in np.linspace(0.93, 0.1, 7)]
    return loft(_layers(outline, layers))


def _layers(outline: Floats, layers: Sequence[tuple[float, float]]) -> Floats:
    """Rings (R, K, 3): the outline scaled by each layer's share, at its height."""
    return np.stack([np.column_stack([outline * share, np.full(len(outline), z)]) for share, z in layers])


def spindle_chair(wood: Material) -> Model:
    """A Windsor-like chair: saddled seat, bow back with seven spindles, splayed turned legs; 0.48 x 0.46 x 0.83 m."""
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    outline = np.column_stack(
        [
            0.205 * np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.75,
            (0.212 + 0.014 * np.cos(angle)) * np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** 0.72,
        ]
    )
    seat_z = 0.425
    seat = moved(_saddle(outline, 0.036, 0.011), z=seat_z)
    profile = [
        (0.0, 0.010),
        (0.02, 0.0125),
        (0.30, 0.0165),
        (0.46, 0.0125),
        (0.49, 0.0175),
        (0.52, 0.0125),
        (0.70, 0.0215),
        (0.82, 0.0185),
        (0.86, 0.0135),
        (1.0, 0.0125),
    ]
    feet = {(sx, sy): np.array([sx * 0.215, sy * 0.198, 0.0]) for sx in (-1, 1) for sy in (-1, 1)}
    tops = {(sx, sy): np.array([sx * 0.135, sy * 0.135, seat_z + 0.012]) for sx in (-1, 1) for sy in (-1, 1)}
    parts = [turned_leg(feet[key], tops[key], profile) for key in feet]
    stretcher = [(0.0, 0.008), (0.5, 0.0125), (1.0, 0.008)]

    def on_leg(key: tuple[int, int], share: float) -> Floats:
        return np.asarray(feet[key] + (tops[key] - feet[key]) * share)

    middles = []
    for sy in (-1, 1):
        front, back = on_leg((1, sy), 0.38), on_leg((-1, sy), 0.38)
        parts.append(turned_leg(back, front, stretcher, 10))
        middles.append((front + back) / 2)
    parts.append(turned_leg(middles[0], middles[1], stretcher, 10))

    lean = np.tan(np.radians(13.0))

    def back_point(y: float, z: float) -> Floats:
        curve = 0.040 * (1 - (y / 0.2) ** 2)
        return np.array([-0.135 - lean * z - curve, y, seat_z + 0.03 + z])

    def half_width(z: float) -> float:
        return 0.152 + 0.042 * float(np.sin(np.pi / 2 * np.clip((z + 0.012) / 0.22, 0, 1)))

    top, sink = 0.372, 0.016
    turn = np.linspace(np.pi, 0, 37)
    heights = (top + sink) * np.abs(np.sin(turn)) ** 0.6 - sink
    widths = np.array([half_width(z) for z in heights])
    bow = np.array(
        [
            back_point(float(np.sign(np.cos(a)) * abs(np.cos(a)) ** 0.62 * w), float(z))
            for a, w, z in zip(turn, widths, heights, strict=True)
        ]
    )
    parts.append(tube(bow, 0.0105, 10))
    rising = bow[len(bow) // 2 :]
    for y in np.linspace(-0.130, 0.130, 7):
        reach = float(np.interp(abs(y), rising[:, 1], rising[:, 2])) - seat_z - 0.03
        line = np.array(
            [
                back_point(y * spread, z)
                for spread, z in ((0.80, -sink), (0.90, reach * 0.33), (0.97, reach * 0.7), (1.0, reach))
            ]
        )
        parts.append(tube(line, np.array([0.0055, 0.0085, 0.0065, 0.005]), 8))
    return (Part(merge([seat, *parts]), wood),)


def upholstered_chair(wood: Material, cloth: Material) -> Model:
    """A mid-century dining chair: padded seat, bent backrest, tapered splayed legs; 0.52 x 0.47 x 0.83 m."""
    seat_z, half_width, half_depth = 0.40, 0.225, 0.215
    frame = []
    for sy in (-1, 1):
        frame.append(leg((0.205, sy * 0.208, 0), (0.165, sy * 0.188, seat_z + 0.012), 0.0115, 0.019))
        rear = catmull_rom(
            [
                (-0.275, sy * 0.198, 0.0),
                (-0.215, sy * 0.190, 0.22),
                (-0.185, sy * 0.186, 0.41),
                (-0.205, sy * 0.190, 0.60),
                (-0.262, sy * 0.190, 0.80),
            ],
            22,
        )
        frame.append(tube(rear, np.interp(np.linspace(0, 1, 22), [0, 0.45, 1], [0.0115, 0.0195, 0.011]), 14))
        frame.append(tube([(0.165, sy * 0.188, seat_z - 0.018), (-0.186, sy * 0.186, seat_z - 0.018)], 0.0135, 10))
    for x, y in ((0.165, 0.188), (-0.187, 0.186)):
        frame.append(tube([(x, -y, seat_z - 0.018), (x, y, seat_z - 0.018)], 0.0135, 10))

    across = np.linspace(-1, 1, 25)
    rail = np.column_stack([-0.235 - 0.052 * (1 - across**2), across * 0.222, np.full(25, 0.742)])
    crest = np.array(
        [
            (-0.011, -0.075),
            (0.011, -0.075),
            (0.014, -0.03),
            (0.011, 0.07),
            (0.004, 0.082),
            (-0.006, 0.08),
            (-0.012, 0.06),
        ]
    )
    frame.append(sweep(rail, _rounded(crest), caps=True, crease_deg=60.0))

    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    outline = np.column_stack(
        [
            half_depth * np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.42 - 0.008,
            (half_width + 0.014 * np.cos(angle)) * np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** 0.42,
        ]
    )
    layers = [
        (0.9, 0.0),
        (0.97, 0.004),
        (1.0, 0.018),
        (0.99, 0.034),
        (0.955, 0.046),
        (0.85, 0.055),
        (0.6, 0.061),
        (0.3, 0.063),
    ]
    pad = moved(loft(_layers(outline, layers), crease_deg=70.0), z=seat_z)
    return Part(merge(frame), wood), Part(pad, cloth)


def _rounded(outline: Floats) -> Floats:
    return catmull_rom(outline, 3 * len(outline), closed=True)
