"""Furniture for storage: chest of drawers, deep sill, kitchen counter with its cabinets, sink and tap.

Fronts face +x; the assembly turns them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tools.household import materials
from tools.household.joinery import bar_handle, board, knob, leg
from tools.household.model import Floats, Material, Mesh, Model, Part, merge, moved
from tools.household.outlines import catmull_rom, rectangle, rounded_rectangle
from tools.household.shapes import cylinder, extrude, lathe, loft, tube


def chest_of_drawers(depth: float, width: float, height: float, wood: Material, metal: Material) -> Model:
    """A chest with three rows of two drawers on tapered legs; its back at x = 0, its front at x = depth."""
    half, leg_height, side = width / 2, 0.14, 0.020
    top = height - 0.024
    carcass = [
        board((0, -half, height - 0.024), (depth, half, height), 0.005),
        board((0.004, -half + 0.008, leg_height), (depth - 0.012, -half + 0.008 + side, top), 0.002),
        board((0.004, half - 0.008 - side, leg_height), (depth - 0.012, half - 0.008, top), 0.002),
        board((0.004, -half + 0.01, leg_height), (depth - 0.012, half - 0.01, leg_height + 0.02), 0.002),
        board((0.004, -half + 0.02, leg_height), (0.012, half - 0.02, top), 0.001, grain="y"),
        board((0.02, -0.010, leg_height), (depth - 0.016, 0.010, top), 0.002),
    ]
    carcass += [
        leg((x, y * 1.02, 0), (x, y, leg_height + 0.002), 0.011, 0.020)
        for x in (0.05, depth - 0.06)
        for y in (-half + 0.06, half - 0.06)
    ]
    fronts, knobs = [], []
    inner_low, inner_high = leg_height + 0.024, top - 0.004
    rows = np.linspace(inner_low, inner_high, 4)
    for low, high in pairwise(rows):
        for first, last in ((-half + 0.032, -0.013), (0.013, half - 0.032)):
            fronts.append(board((depth - 0.034, first, low + 0.003), (depth - 0.010, last, high - 0.003), 0.003))
            middle = (first + last) / 2
            knobs += [knob((depth - 0.010, middle + shift, (low + high) / 2)) for shift in (-0.12, 0.12)]
    return Part(merge(carcass), wood), Part(merge(fronts), wood), Part(merge(knobs), metal)


def deep_sill(
    length: float,
    depth: float,
    top_z: float,
    wood: Material,
    metal: Material,
    thickness: float = 0.036,
    brackets: int = 4,
) -> Model:
    """A wall-mounted board on steel brackets; along y, its back (the wall) at x = 0."""
    shelf = board((0, -length / 2, top_z - thickness), (depth, length / 2, top_z), 0.006)
    irons = []
    for y in np.linspace(-length / 2 + 0.12, length / 2 - 0.12, brackets):
        irons.append(
            board((0.002, y - 0.016, top_z - thickness - 0.006), (depth - 0.06, y + 0.016, top_z - thickness), 0.001)
        )
        irons.append(board((0.0, y - 0.016, top_z - thickness - 0.26), (0.006, y + 0.016, top_z - thickness), 0.001))
        brace = catmull_rom(
            [
                (0.006, y, top_z - thickness - 0.23),
                (0.13, y, top_z - thickness - 0.17),
                (0.27, y, top_z - thickness - 0.06),
                (0.31, y, top_z - thickness - 0.004),
            ],
            14,
        )
        irons.append(tube(brace, 0.008, 8))
    return Part(merge([shelf]), wood), Part(merge(irons), metal)


def counter(
    length: float,
    depth: float,
    top_z: float,
    sink_center: tuple[float, float],
    sink_size: tuple[float, float],
    lacquer: Material,
    top: Material,
    metal: Material,
) -> Model:
    """A kitchen counter along y, its back at x = 0: a sink cabinet with two doors, then three wide drawers.

    `sink_center` and `sink_size` (x, y) are those of the hole in the worktop.
    """
    half, slab, low, face = length / 2, 0.036, 0.10, depth - 0.045
    high = top_z - slab
    split = 2 * sink_center[1] + half
    hole = rounded_rectangle(*sink_size, 0.045, 5) + np.array(sink_center) - [depth / 2, 0]
    plate = extrude(rectangle(depth, length), slab, bevel=0.003, holes=[hole])
    carcass = [
        board((0, -half + 0.004, low), (face, -half + 0.022, high), 0.001),
        board((0, half - 0.022, low), (face, half - 0.004, high), 0.001),
        board((0, split - 0.009, low), (face, split + 0.009, high), 0.001),
        board((0, -half + 0.02, low), (face, half - 0.02, low + 0.018), 0.001),
        board((0, -half + 0.02, low), (0.012, half - 0.02, high), 0.001),
        board((0.05, -half + 0.02, 0.0), (face - 0.05, half - 0.02, low), 0.001),
    ]
    fronts, handles = [], []
    for first, last, knob_y in (
        (-half + 0.006, sink_center[1] - 0.002, sink_center[1] - 0.045),
        (sink_center[1] + 0.002, split - 0.002, sink_center[1] + 0.045),
    ):
        fronts.append(_shaker_front(face, first, last, low + 0.004, high - 0.004))
        handles.append(bar_handle((face + 0.020, knob_y, high - 0.16), 0.16, axis="z"))
    levels = (low + 0.002, 0.40, 0.66, high - 0.002)
    for bottom, upper in pairwise(levels):
        fronts.append(_shaker_front(face, split + 0.002, half - 0.006, bottom + 0.002, upper - 0.002))
        handles.append(bar_handle((face + 0.020, (split + half) / 2, (bottom + upper) / 2), 0.20))
    return (
        Part(moved(plate, x=depth / 2, z=high), top),
        Part(merge([*carcass, *fronts]), lacquer),
        Part(merge(handles), metal),
    )


def _shaker_front(x: float, first: float, last: float, bottom: float, top: float) -> Mesh:
    rail = 0.055
    return merge(
        [
            board((x, first + 0.02, bottom + 0.02), (x + 0.010, last - 0.02, top - 0.02), 0.001),
            board((x, first, bottom), (x + 0.020, first + rail, top), 0.002),
            board((x, last - rail, bottom), (x + 0.020, last, top), 0.002),
            board((x, first + rail, bottom), (x + 0.020, last - rail, bottom + rail), 0.002),
            board((x, first + rail, top - rail), (x + 0.020, last - rail, top), 0.002),
        ]
    )


def sink(width: float, depth: float, height: float, rim_height: float, glaze: Material) -> Model:
    """A drop-in ceramic basin with a raised rim, centred, standing on z = 0, with its chrome drain."""

    def ring(inset: float, z: float, radius: float) -> Floats:
        outline = rounded_rectangle(width - 2 * inset, depth - 2 * inset, max(radius - inset * 0.5, 0.012), 7)
        return np.column_stack([outline, np.full(len(outline), z)])

    body, rim = 0.016, height
    rings = [
        ring(0.055, 0.0, 0.08),
        ring(0.030, 0.010, 0.075),
        ring(body, 0.045, 0.06),
        ring(body, height - rim_height, 0.05),
        ring(0.0, height - rim_height, 0.045),
        ring(0.0, rim - 0.006, 0.045),
        ring(0.0018, rim - 0.0018, 0.045),
        ring(0.006, rim, 0.045),
        ring(0.016, rim, 0.045),
        ring(0.021, rim - 0.003, 0.045),
        ring(0.025, rim - 0.012, 0.045),
        ring(0.030, height * 0.35, 0.05),
        ring(0.038, 0.024, 0.06),
        ring(0.055, 0.014, 0.07),
        ring(0.085, 0.010, 0.09),
        ring(0.120, 0.008, 0.10),
    ]
    basin = loft(np.stack(rings), crease_deg=50.0)
    drain = lathe(
        [(0.0, 0.0085), (0.021, 0.0085), (0.023, 0.0115), (0.016, 0.0118), (0.012, 0.0095), (0.0, 0.0098)], 24
    )
    return Part(basin, glaze), Part(moved(drain), materials.chrome())


def tap(reach: float, height: float) -> Model:
    """A swan-neck mixer tap that stands at the origin and reaches towards +x."""
    neck = catmull_rom(
        [
            (0, 0, 0.03),
            (0, 0, height * 0.7),
            (reach * 0.18, 0, height * 0.94),
            (reach * 0.55, 0, height),
            (reach * 0.9, 0, height * 0.90),
            (reach, 0, height * 0.70),
        ],
        30,
    )
    lever = tube([(0, 0.022, 0.055), (0.004, 0.045, 0.075), (0.01, 0.085, 0.10)], [0.006, 0.0055, 0.004], 10)
    base = lathe([(0, 0), (0.026, 0), (0.027, 0.006), (0.021, 0.012), (0.019, 0.075), (0.0125, 0.085), (0, 0.086)], 24)
    spout = moved(cylinder(0.0125, 0.02), reach, 0, height * 0.70 - 0.012)
    return (Part(merge([tube(neck, 0.011, 12), lever, base, spout]), materials.chrome()),)


def splashback(length: float, low: float, high: float, tiles: Material) -> Model:
    """Tiles 8 mm thick along y, on the wall at x = 0."""
    panel = board((0, -length / 2, low), (0.008, length / 2, high), 0.001, grain="y")
    return (Part(panel, tiles),)
