"""Fitted kitchens and their machines. Fronts face +x, widths run along y, backs are at x = 0, floors at z = 0."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tools.household import materials
from tools.household.cabinets import framed_front
from tools.household.joinery import bar_handle
from tools.household.model import Material, Mesh, Model, Part, merge, moved, placed, rotated
from tools.household.outlines import rectangle, rounded_rectangle
from tools.household.planks import board
from tools.household.shapes import bevelled_box, cylinder, extrude, lathe, tube
from tools.household.storage import sink, tap

WORKTOP_M = 0.90
_SLAB, _PLINTH, _DEPTH = 0.038, 0.10, 0.62


def base_unit(width: float, fronts: str, lacquer: Material, top: Material, metal: Material) -> Model:
    """A floor unit with worktop: `fronts` is doors or drawers."""
    half, face, high = width / 2, _DEPTH - 0.045, WORKTOP_M - _SLAB
    parts = [Part(board((0, -half, high), (_DEPTH, half, WORKTOP_M), 0.002, grain="y"), top)]
    return (*parts, *_front_parts(half, face, high, fronts, lacquer, metal))


def _front_parts(half: float, face: float, high: float, fronts: str, lacquer: Material, metal: Material) -> Model:
    body = _box(half, face, high)
    handles = []
    if fronts == "drawers":
        for first, last in pairwise((_PLINTH + 0.004, 0.37, 0.62, high - 0.003)):
            body.append(framed_front(face, -half + 0.002, half - 0.002, first + 0.002, last - 0.002, 0.05))
            handles.append(bar_handle((face + 0.020, 0.0, (first + last) / 2), 0.20))
    else:
        count = 1 if half < 0.28 else 2
        edges = np.linspace(-half + 0.001, half - 0.001, count + 1)
        for index, (left, right) in enumerate(pairwise(edges)):
            body.append(framed_front(face, left + 0.001, right - 0.001, _PLINTH + 0.006, high - 0.004, 0.06))
            y = right - 0.035 if index == 0 and count > 1 else left + 0.035
            handles.append(bar_handle((face + 0.020, y, high - 0.16), 0.16, axis="z"))
    return Part(merge(body), lacquer), Part(merge(handles), metal)


def _box(half: float, face: float, high: float) -> list[Mesh]:
    return [
        board((0, -half, _PLINTH), (face, -half + 0.018, high), 0.001),
        board((0, half - 0.018, _PLINTH), (face, half, high), 0.001),
        board((0, -half + 0.018, _PLINTH), (face, half - 0.018, _PLINTH + 0.018), 0.001),
        board((0, -half + 0.018, _PLINTH + 0.018), (0.010, half - 0.018, high), 0.001),
        board((0.0, -half, 0.0), (face - 0.05, half, _PLINTH), 0.001),
    ]


def wall_unit(width: float, lacquer: Material, metal: Material) -> Model:
    """A cupboard for the wall, 0.70 m high."""
    half, depth, height = width / 2, 0.32, 0.70
    body = [board((0, -half, 0), (depth, half, height), 0.001)]
    handles = []
    for index, (left, right) in enumerate(pairwise(np.linspace(-half, half, 3))):
        body.append(framed_front(depth, left + 0.001, right - 0.001, 0.002, height - 0.002, 0.055))
        handles.append(bar_handle((depth + 0.020, right - 0.035 if index == 0 else left + 0.035, 0.14), 0.14, axis="z"))
    return Part(merge(body), lacquer), Part(merge(handles), metal)


def sink_unit(width: float, lacquer: Material, top: Material, metal: Material, basin: Material) -> Model:
    """A floor unit with a basin sunk into its worktop, and a tap."""
    half, face, high = width / 2, _DEPTH - 0.045, WORKTOP_M - _SLAB
    basin_x, basin_y = 0.42, min(0.50, width - 0.08)
    hole = rounded_rectangle(basin_x - 0.03, basin_y - 0.03, 0.045, 4)
    slab = moved(extrude(rectangle(_DEPTH, width), _SLAB, holes=[hole], grain="y"), _DEPTH / 2, 0, high)
    bowl = placed(sink(basin_x, basin_y, 0.17, 0.012, basin), (_DEPTH / 2 + 0.02, 0, WORKTOP_M - 0.158))
    return (
        Part(slab, top),
        *_front_parts(half, face, high, "doors", lacquer, metal),
        *bowl,
        *placed(tap(0.17, 0.27), (0.075, 0, WORKTOP_M)),
    )


def cooker(width: float, body: Material, hob: str) -> Model:
    """A free-standing cooker with an oven door; `hob` is ceramic or gas."""
    half, depth, face = width / 2, 0.62, 0.58
    high = WORKTOP_M
    black, steel = materials.paint("#151618", 0.12), materials.brushed_steel()
    shell = [
        board((0, -half, 0.06), (face, half, high - 0.012), 0.003),
        board((face, -half + 0.002, 0.07), (face + 0.022, half - 0.002, 0.20), 0.003),
        board((face, -half + 0.002, 0.21), (face + 0.028, half - 0.002, 0.74), 0.005),
        board((face, -half + 0.002, 0.75), (face + 0.026, half - 0.002, high - 0.012), 0.006),
    ]
    feet = [board((0.03, -half + 0.03, 0), (face - 0.04, half - 0.03, 0.06), 0.002)]
    window = board((face + 0.026, -half + 0.07, 0.30), (face + 0.0295, half - 0.07, 0.62), 0.001)
    plate = board((0.0, -half, high - 0.012), (depth, half, high), 0.003)
    handles = [
        tube([(face + 0.062, -half + 0.05, 0.70), (face + 0.062, half - 0.05, 0.70)], 0.009, 10),
        *(tube([(face + 0.02, y, 0.70), (face + 0.062, y, 0.70)], 0.006, 8) for y in (-half + 0.07, half - 0.07)),
    ]
    dial = [
        moved(rotated(cylinder(0.020, 0.024, segments=16), "y", 90.0), face + 0.026, y, 0.815)
        for y in np.linspace(-half + 0.07, half - 0.07, 6)
    ]
    burners = [
        (x, y * half * 0.52, r)
        for x, y, r in ((0.17, -1, 0.075), (0.17, 1, 0.095), (0.44, -1, 0.095), (0.44, 1, 0.075))
    ]
    parts = [
        Part(merge(shell), body),
        Part(merge([*feet, window]), black),
        Part(plate, black if hob == "ceramic" else steel),
        Part(merge([*handles, *dial]), steel),
    ]
    if hob == "ceramic":
        rings = [_ring(x, y, radius, high) for x, y, radius in burners]
        parts.append(Part(merge(rings), materials.paint("#6e6f72", 0.3)))
    else:
        iron = []
        for x, y, radius in burners:
            iron.append(moved(cylinder(radius * 0.45, 0.016, segments=16), x, y, high))
            iron += [
                board((x - radius, y - 0.004, high + 0.012), (x + radius, y + 0.004, high + 0.028), 0.001),
                board((x - 0.004, y - radius, high + 0.012), (x + 0.004, y + radius, high + 0.028), 0.001),
                *(
                    board((x + dx - 0.004, y - 0.004, high), (x + dx + 0.004, y + 0.004, high + 0.02), 0.001)
                    for dx in (-radius + 0.004, radius - 0.004)
                ),
            ]
        parts.append(Part(merge(iron), materials.paint("#1c1c1d", 0.6)))
    return tuple(parts)


def _ring(x: float, y: float, radius: float, z: float) -> Mesh:
    return moved(lathe([(radius, 0.0002), (radius - 0.003, 0.0004)], 28), x, y, z)


def built_in_oven(width: float, lacquer: Material, metal: Material) -> Model:
    """A tall kitchen unit with an oven at chest height, cupboards above and below."""
    half, face, height = width / 2, 0.575, 2.05
    body = [
        board((0, -half, 0.10), (face, half, height), 0.002),
        board((0, -half, 0), (face - 0.05, half, 0.10), 0.001),
    ]
    body.append(framed_front(face, -half + 0.002, half - 0.002, 0.105, 0.69, 0.06))
    body.append(framed_front(face, -half + 0.002, half - 0.002, 1.31, height - 0.004, 0.06))
    oven, window, handles = _oven_front(face, half - 0.003, 0.70, 1.30)
    handles += [bar_handle((face + 0.02, 0.0, 0.62), 0.18), bar_handle((face + 0.02, 0.0, 1.38), 0.18)]
    return (
        Part(merge(body), lacquer),
        Part(oven, materials.brushed_steel()),
        Part(window, materials.paint("#121315", 0.1)),
        Part(merge(handles), metal),
    )


def _oven_front(face: float, half: float, low: float, high: float) -> tuple[Mesh, Mesh, list[Mesh]]:
    door = merge(
        [
            board((face, -half, low), (face + 0.020, half, high - 0.115), 0.003),
            board((face, -half, high - 0.110), (face + 0.020, half, high), 0.003),
        ]
    )
    window = merge(
        [
            board((face + 0.018, -half + 0.06, low + 0.06), (face + 0.0215, half - 0.06, high - 0.20), 0.001),
            board((face + 0.018, -0.07, high - 0.085), (face + 0.0215, 0.07, high - 0.03), 0.001),
        ]
    )
    z = high - 0.155
    handles = [tube([(face + 0.052, -half + 0.05, z), (face + 0.052, half - 0.05, z)], 0.008, 10)]
    handles += [tube([(face + 0.01, y, z), (face + 0.052, y, z)], 0.006, 8) for y in (-half + 0.07, half - 0.07)]
    handles += [
        moved(rotated(cylinder(0.019, 0.022, segments=16), "y", 90.0), face + 0.020, y, high - 0.055)
        for y in (-half * 0.62, half * 0.62)
    ]
    return door, window, handles


def refrigerator(
    width: float, height: float, freezer_share: float, body: Material, metal: Material, bevel: float
) -> Model:
    """A fridge over a freezer (or under it when the share is negative), with bar handles at -y."""
    half, depth, face = width / 2, 0.66, 0.60
    split = height * (freezer_share if freezer_share > 0 else 1.0 + freezer_share)
    shell = [bevelled_box((face, width, height - 0.05), (face / 2, 0, (height + 0.05) / 2), bevel, 3, grain="z")]
    feet = [board((0.03, -half + 0.03, 0.0), (face - 0.02, half - 0.03, 0.055), 0.004)]
    handles = []
    for low, high in ((0.055, split - 0.004), (split + 0.004, height)):
        shell.append(
            bevelled_box(
                (depth - face - 0.008, width, high - low),
                ((depth + face + 0.008) / 2, 0, (low + high) / 2),
                min(bevel, 0.03),
                3,
                grain="z",
            )
        )
        feet.append(board((face - 0.01, -half + 0.015, low + 0.015), (face + 0.01, half - 0.015, high - 0.015), 0.001))
        length = min(0.42, (high - low) * 0.55)
        middle = high - 0.06 - length / 2 if low < 0.06 and high < height * 0.5 else low + 0.08 + length / 2
        handles.append(bar_handle((depth, -half + 0.055, middle), length, axis="z", reach=0.042))
    return Part(merge(shell), body), Part(merge(feet), materials.paint("#303234", 0.6)), Part(merge(handles), metal)


def side_by_side(width: float, height: float, body: Material, metal: Material) -> Model:
    """A wide refrigerator of two tall doors with an ice dispenser."""
    half, depth, face = width / 2, 0.72, 0.65
    shell = [board((0, -half, 0.04), (face, half, height), 0.008)]
    handles = []
    split = -half + width * 0.42
    for first, last, y in ((-half, split - 0.003, split - 0.045), (split + 0.003, half, split + 0.045)):
        shell.append(
            bevelled_box(
                (depth - face, last - first, height - 0.05),
                ((depth + face) / 2, (first + last) / 2, height / 2 + 0.025),
                0.012,
                2,
                grain="z",
            )
        )
        handles.append(bar_handle((depth, y, height * 0.58), 0.75, axis="z", reach=0.05))
    middle = (-half + split) / 2
    recess = [
        board((depth - 0.004, middle - 0.10, 1.02), (depth + 0.003, middle + 0.10, 1.38), 0.003),
        board((0.02, -half + 0.02, 0), (face - 0.02, half - 0.02, 0.05), 0.002),
    ]
    return Part(merge(shell), body), Part(merge(recess), materials.paint("#1b1c1e", 0.25)), Part(merge(handles), metal)


def microwave(width: float, depth: float, height: float, body: Material, side: str) -> Model:
    """A microwave oven with a dark window and its panel at +y or below the handle (`side` is buttons or dials)."""
    half, face, split = width / 2, depth - 0.03, width / 2 - 0.105
    shell = [board((0, -half, 0.012), (face, half, height), 0.006)]
    door = board((face, -half, 0.012), (depth, split - 0.002, height), 0.005)
    panel = board((face, split + 0.002, 0.012), (depth, half, height), 0.005)
    window = [board((depth - 0.002, -half + 0.045, 0.055), (depth + 0.0015, split - 0.06, height - 0.045), 0.001)]
    window.append(
        board((depth - 0.002, split + 0.018, height - 0.075), (depth + 0.001, half - 0.016, height - 0.035), 0.001)
    )
    window += [
        moved(cylinder(0.012, 0.012, segments=12), x, y, 0.0)
        for x in (0.05, face - 0.05)
        for y in (-half + 0.05, half - 0.05)
    ]
    metal = [bar_handle((depth, split - 0.030, height / 2), height * 0.66, axis="z", reach=0.030)]
    middle = (split + half) / 2
    if side == "dials":
        metal += [
            moved(rotated(cylinder(0.024, 0.02, segments=20), "y", 90.0), depth, middle, z)
            for z in (height * 0.25, height * 0.52)
        ]
    else:
        metal += [
            board(
                (depth - 0.002, middle + 0.027 * column - 0.010, z - 0.007),
                (depth + 0.003, middle + 0.027 * column + 0.010, z + 0.007),
                0.002,
            )
            for column in (-1, 0, 1)
            for z in np.linspace(0.06, height - 0.11, 5)
        ]
    return (
        Part(merge([*shell, door, panel]), body),
        Part(merge(window), materials.paint("#101113", 0.08)),
        Part(merge(metal), materials.brushed_steel()),
    )


def toaster(width: float, depth: float, height: float, body: Material, trim: Material, slots: int = 2) -> Model:
    """A toaster whose slots run along y, its lever and dial at +x."""
    outline = rounded_rectangle(depth, height - 0.02, min(depth, height) * 0.28, 6)
    shell = extrude(outline, width - 0.03, bevel=0.008, segments=3, grain="z")
    shell = moved(rotated(shell, "x", 90.0), 0, (width - 0.03) / 2, height / 2 + 0.01)
    cheeks = [
        board(
            (-depth / 2 + 0.008, side * (width / 2) - 0.012, 0.012),
            (depth / 2 - 0.008, side * (width / 2) + 0.012, height * 0.82),
            0.010,
        )
        for side in (-1, 1)
    ]
    cheeks.append(
        board((-depth / 2 + 0.02, -width / 2 + 0.02, 0.0), (depth / 2 - 0.02, width / 2 - 0.02, 0.022), 0.004)
    )
    slits = [
        board((x - 0.013, -width * 0.36, height - 0.012), (x + 0.013, width * 0.36, height + 0.0015), 0.001)
        for x in np.linspace(-0.028, 0.028, slots)
    ]
    knobs = [
        board(
            (depth / 2 + 0.0, -0.022 + width * 0.18, height * 0.62),
            (depth / 2 + 0.024, 0.022 + width * 0.18, height * 0.62 + 0.016),
            0.005,
        )
    ]
    knobs.append(
        moved(rotated(cylinder(0.017, 0.018, segments=18), "y", 90.0), depth / 2 - 0.002, -width * 0.18, height * 0.34)
    )
    slits.append(
        board(
            (depth / 2 - 0.002, width * 0.18 - 0.004, height * 0.25),
            (depth / 2 + 0.001, width * 0.18 + 0.004, height * 0.78),
            0.0005,
        )
    )
    return (
        Part(shell, body),
        Part(merge([*cheeks, *knobs]), trim),
        Part(merge(slits), materials.paint("#141414", 0.5)),
    )
