"""Shoes in pairs, as they stand by a door; their toes at +x."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.household.model import Floats, Material, Model, Part, merge, rotation, transformed
from tools.household.shapes import grid_surface, loft, tube
from tools.household.textures import linear_color


@dataclass(frozen=True)
class Last:
    """The form of a shoe in metres: length, width, and the heights of sole, heel, toe cap and the opening's rim."""

    length: float
    width: float
    sole: float
    heel: float
    toe: float
    rim: float


SNEAKER = Last(0.295, 0.106, 0.024, 0.030, 0.062, 0.098)
BOOT = Last(0.290, 0.100, 0.014, 0.032, 0.058, 0.150)
_AROUND, _LEVELS = 20, 5
# Where laces cross the way from the toe cap to the opening.
_LACES = (0.50, 0.66, 0.82)


def _outline(last: Last, side: float) -> Floats:
    """The outline of a sole (K, 2), the toe at +x, widest at the ball of the foot, bent inwards."""
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    along, across = (np.sign(wave) * np.abs(wave) ** 0.74 for wave in (np.cos(angle), np.sin(angle)))
    half = last.width / 2 * (0.90 + 0.12 * along - 0.05 * np.cos(np.pi * along))
    bend = 0.012 * np.sin(np.pi * (along + 1.0) / 2.0) - 0.008 * np.maximum(along, 0.0) ** 3
    return np.column_stack([along * last.length / 2, across * half - side * bend])


def _shoe(last: Last, upper: Material, sole: Material, lining: Material, laces: Material, side: float) -> Model:
    """A shoe of the foot at `side` (1 left); its toe at +x."""
    outline = _outline(last, side)
    ahead = np.clip(outline[:, 0] / 0.05, 0.0, 1.0)
    rise = last.heel + (last.sole - last.heel) * ahead
    edge = np.column_stack([outline * 0.965, rise])
    # From the sole's edge a curve leads up over the foot to the opening, which lies above the heel.
    slope = last.toe + 0.030 * (1.0 - np.clip(outline[:, 0] / (0.46 * last.length), 0.0, 1.0))
    height = np.where(outline[:, 0] < 0.0, last.rim * 0.72, slope)
    shoulder = np.column_stack([outline * [1.0, 1.02], np.maximum(height, rise + 0.02)])
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    middle, dip = -last.length * 0.235, 0.014 if last.rim < 0.12 else 0.0
    rim = np.column_stack(
        [
            middle + (0.062 + 0.012 * np.cos(angle)) * np.cos(angle),
            0.033 * np.sin(angle),
            last.rim - dip * np.abs(np.sin(angle)),
        ]
    )

    def level(share: float) -> Floats:
        return np.asarray((1 - share) ** 2 * edge + 2 * share * (1 - share) * shoulder + share**2 * rim)

    body = np.stack([level(share) for share in np.linspace(0.0, 1.0, _LEVELS)])
    lip, deep = rim.copy(), rim.copy()
    for ring, width, drop in ((lip, 0.88, 0.002), (deep, 0.72, last.rim - last.heel - 0.012)):
        ring[:, :2] = [middle, 0.0] + (ring[:, :2] - [middle, 0.0]) * width
        ring[:, 2] -= drop
    inside = np.stack([rim, lip, deep, np.broadcast_to(deep.mean(axis=0), deep.shape)])
    ground = np.column_stack([outline * 0.985, 0.007 * (outline[:, 0] > 0.45 * last.length)])
    rubber = loft(np.stack([ground, np.column_stack([outline * 1.01, rise * 0.6]), np.column_stack([outline, rise])]))
    bars = [tube(level(share)[[-1, 0, 1]] + [0.0, 0.0, 0.001], 0.0030, 4) for share in _LACES]
    return (
        Part(grid_surface(body[:, ::-1], close_columns=True, crease_deg=70.0), upper),
        Part(grid_surface(inside[:, ::-1], close_columns=True, crease_deg=80.0), lining),
        Part(rubber, sole),
        Part(merge(bars), laces),
    )


def shoes(last: Last, upper: str, sole: str, lining: str, laces: str, shine: float) -> Model:
    """A pair, put down side by side with the toes to +x, one a little ahead and turned."""
    made = [
        Material(f"shoe {name}", linear_color(code), roughness=roughness)
        for name, code, roughness in (
            ("upper", upper, shine),
            ("sole", sole, 0.6),
            ("lining", lining, 0.95),
            ("laces", laces, 0.85),
        )
    ]
    parts = []
    for side, ahead, turn in ((1.0, 0.0, -4.0), (-1.0, 0.022, 7.0)):
        parts.append(
            transformed(
                _shoe(last, made[0], made[1], made[2], made[3], side), rotation("z", turn), (ahead, side * 0.063, 0.0)
            )
        )
    return tuple(Part(merge([one.mesh, other.mesh]), one.material) for one, other in zip(*parts, strict=True))
