"""Sofas and armchairs with loose cushions; they face +x, their backs at -x, standing on z = 0."""

from __future__ import annotations

import numpy as np

from tools.household.joinery import leg
from tools.household.model import Material, Mesh, Model, Part, affine, merge, moved, rotated, rotation
from tools.household.outlines import rounded_rectangle
from tools.household.shapes import bevelled_box, loft


def pad(depth: float, width: float, thickness: float, plump: float = 0.028) -> Mesh:
    """A stuffed cushion lying on z = 0, its corners rounded and its top domed by `plump`."""
    outline = rounded_rectangle(depth, width, min(depth, width) * 0.13, 5)
    half = thickness / 2
    layers = [
        (0.90, 0.0),
        (0.965, 0.012),
        (0.992, half * 0.6),
        (1.0, half),
        (0.992, half * 1.4),
        (0.965, thickness - 0.014),
        (0.90, thickness - 0.002),
        (0.75, thickness + plump * 0.45),
        (0.45, thickness + plump * 0.85),
        (0.12, thickness + plump),
    ]
    rings = np.stack([np.column_stack([outline * share, np.full(len(outline), z)]) for share, z in layers])
    return loft(rings, crease_deg=70.0)


def sofa(
    seats: int,
    seat_width: float,
    depth: float,
    cloth: Material,
    wood: Material,
    style: str,
    cushion: Material | None = None,
) -> Model:
    """`style` is round (stuffed arms), slim (thin arms) or chaise (a long seat at +y)."""
    arm = {"round": 0.20, "slim": 0.09, "chaise": 0.14}[style]
    inner, seat_z, base = seats * seat_width, 0.42, 0.16
    width, half = inner + 2 * arm, inner / 2 + arm
    back_x = -depth / 2
    arm_top, back_top = (0.62, 0.80) if style != "slim" else (0.60, 0.84)
    body = [
        bevelled_box((depth - 0.03, width - 0.02, 0.13), (0.0, 0, base + 0.065), 0.02, 2),
        bevelled_box(
            (0.20, width - 0.01, back_top - base - 0.10),
            (back_x + 0.10, 0, (back_top - 0.10 + base) / 2),
            0.05,
            2,
            grain="y",
        ),
    ]
    bevel = 0.085 if style == "round" else 0.03
    for side in (-1, 1):
        middle = side * (half - arm / 2)
        body.append(bevelled_box((depth, arm, arm_top - base + 0.005), (0.0, middle, (arm_top + base) / 2), bevel, 3))
    seats_x, seats_depth = back_x + 0.19 + (depth - 0.20) / 2, depth - 0.19
    for index in range(seats):
        y = -inner / 2 + seat_width * (index + 0.5)
        if style == "chaise" and index == seats - 1:
            long = seats_depth + 0.62
            body.append(
                bevelled_box(
                    (long - 0.02, seat_width + arm - 0.02, 0.13),
                    (back_x + 0.19 + long / 2, y + arm / 2, base + 0.065),
                    0.02,
                    2,
                )
            )
            body.append(
                moved(pad(long, seat_width - 0.006, seat_z - base - 0.15), back_x + 0.19 + long / 2, y, base + 0.125)
            )
        else:
            body.append(moved(pad(seats_depth, seat_width - 0.006, seat_z - base - 0.15), seats_x, y, base + 0.125))
        back = pad(back_top - seat_z + 0.03, seat_width - 0.012, 0.13, 0.035)
        upright = affine(
            back, rotation("y", 90.0 - 11.0), (back_x + 0.165, y, seat_z + (back_top - seat_z) / 2 - 0.005)
        )
        body.append(upright)
    far = half - 0.09
    legs = [
        leg((x * 1.02, y, 0), (x, y * 0.99, base + 0.01), 0.016, 0.026)
        for x in (back_x + 0.08, depth / 2 - 0.10)
        for y in (-far, far)
    ]
    if style == "chaise":
        legs.append(leg((depth / 2 + 0.50, far, 0), (depth / 2 + 0.48, far, base + 0.01), 0.016, 0.026))
    parts = [Part(merge(body), cloth), Part(merge(legs), wood)]
    if cushion is not None:
        loose = [rotated(rotated(pad(0.40, 0.42, 0.08, 0.03), "y", 90.0 - 20.0), "z", turn) for turn in (9.0, -12.0)]
        parts.append(
            Part(
                merge(
                    [
                        moved(mesh, back_x + 0.33, side * (inner / 2 - 0.24), seat_z + 0.19)
                        for mesh, side in zip(loose, (-1, 1), strict=True)
                    ]
                ),
                cushion,
            )
        )
    return tuple(parts)
