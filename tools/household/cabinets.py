"""Cupboards, shelves and desks. Fronts face +x, widths run along y, backs are at x = 0, floors at z = 0."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tools.household.joinery import bar_handle, knob, leg
from tools.household.model import Material, Mesh, Model, Part, merge, moved
from tools.household.outlines import rounded_rectangle
from tools.household.planks import board
from tools.household.shapes import extrude, tube

_BOARD = 0.020


def carcass(depth: float, width: float, low: float, high: float, thickness: float = _BOARD) -> list[Mesh]:
    """The sides, top, bottom and back of an open box, from `low` to `high`."""
    half = width / 2
    return [
        board((0, -half, low), (depth, -half + thickness, high), 0.002, grain="z"),
        board((0, half - thickness, low), (depth, half, high), 0.002, grain="z"),
        board((0, -half + thickness, high - thickness), (depth, half - thickness, high), 0.002),
        board((0, -half + thickness, low), (depth, half - thickness, low + thickness), 0.002),
        board(
            (0.002, -half + thickness, low + thickness), (0.010, half - thickness, high - thickness), 0.0005, grain="z"
        ),
    ]


def bookcase(depth: float, width: float, height: float, levels: int, wood: Material) -> Model:
    """An open bookcase with a plinth; `levels` compartments of equal height, see `bookcase_levels`."""
    boards = carcass(depth, width, 0.06, height)
    boards += [
        board((0.01, -width / 2 + _BOARD, z - _BOARD), (depth - 0.008, width / 2 - _BOARD, z), 0.002)
        for z in bookcase_levels(height, levels)[1:]
    ]
    boards.append(board((0.01, -width / 2 + 0.004, 0.0), (depth - 0.02, width / 2 - 0.004, 0.06), 0.001))
    return (Part(merge(boards), wood),)


def bookcase_levels(height: float, levels: int) -> tuple[float, ...]:
    """The heights of a bookcase's boards, lowest first, without its top."""
    low, high = 0.06 + _BOARD, height - _BOARD
    step = (high - low + _BOARD) / levels
    return tuple(round(low + step * index, 4) for index in range(levels))


def ladder_shelf(depth: float, width: float, height: float, levels: int, wood: Material, metal: Material) -> Model:
    """A light shelf of boards between two steel frames."""
    half, bars = width / 2, []
    for y in (-half + 0.01, half - 0.01):
        for x in (0.012, depth - 0.012):
            post = board((x - 0.010, y - 0.010, 0), (x + 0.010, y + 0.010, height), 0.001)
            bars.append(post)
        bars.append(board((0.012, y - 0.008, height - 0.018), (depth - 0.012, y + 0.008, height - 0.002), 0.001))
    brace = [(0.006, -half + 0.01, height * 0.08), (0.006, half - 0.01, height * 0.45)]
    bars += [tube(brace, 0.004, 6), tube([(x, -y, z) for x, y, z in brace], 0.004, 6)]
    shelves = [board((0.004, -half, z - 0.022), (depth - 0.004, half, z), 0.003) for z in ladder_levels(height, levels)]
    return Part(merge(shelves), wood), Part(merge(bars), metal)


def ladder_levels(height: float, levels: int) -> tuple[float, ...]:
    """The heights of a ladder shelf's boards."""
    return tuple(round(float(z), 4) for z in np.linspace(0.16, height - 0.03, levels))


def wall_shelf(depth: float, width: float, wood: Material, metal: Material) -> Model:
    """A board on two steel brackets, on the wall at x = 0."""
    parts = []
    for y in (-width / 2 + 0.14, width / 2 - 0.14):
        parts.append(board((0.0, y - 0.012, 0.0), (0.005, y + 0.012, 0.17), 0.001))
        parts.append(board((0.005, y - 0.012, 0.165), (depth - 0.03, y + 0.012, 0.170), 0.001))
        parts.append(tube([(0.004, y, 0.02), (depth * 0.72, y, 0.165)], 0.005, 8))
    return Part(board((0, -width / 2, 0.170), (depth, width / 2, 0.195), 0.004), wood), Part(merge(parts), metal)


def wardrobe(
    depth: float, width: float, height: float, doors: int, body: Material, front: Material, metal: Material
) -> Model:
    """A wardrobe of framed doors on a plinth, with a cornice."""
    half, plinth = width / 2, 0.08
    boards = [*carcass(depth - 0.022, width, plinth, height - 0.03)]
    boards.append(board((0.012, -half + 0.004, 0.0), (depth - 0.05, half - 0.004, plinth), 0.002))
    boards.append(board((-0.0, -half - 0.012, height - 0.03), (depth + 0.012, half + 0.012, height), 0.008))
    fronts, handles = [], []
    edges = np.linspace(-half + 0.002, half - 0.002, doors + 1)
    for index, (first, last) in enumerate(pairwise(edges)):
        fronts.append(framed_front(depth - 0.022, first + 0.0015, last - 0.0015, plinth + 0.004, height - 0.034, 0.075))
        y = last - 0.04 if index % 2 == 0 else first + 0.04
        handles.append(bar_handle((depth - 0.002, y, 1.02), 0.22, axis="z"))
    return Part(merge(boards), body), Part(merge(fronts), front), Part(merge(handles), metal)


def framed_front(x: float, first: float, last: float, bottom: float, top: float, rail: float) -> Mesh:
    """A door or drawer front of rails around a sunk panel, 20 mm thick, its back at `x`."""
    return merge(
        [
            board(
                (x, first + rail - 0.01, bottom + rail - 0.01),
                (x + 0.011, last - rail + 0.01, top - rail + 0.01),
                0.001,
                grain="z",
            ),
            board((x, first, bottom), (x + 0.020, first + rail, top), 0.002, grain="z"),
            board((x, last - rail, bottom), (x + 0.020, last, top), 0.002, grain="z"),
            board((x, first + rail, bottom), (x + 0.020, last - rail, bottom + rail), 0.002, grain="y"),
            board((x, first + rail, top - rail), (x + 0.020, last - rail, top), 0.002, grain="y"),
        ]
    )


def sideboard(depth: float, width: float, height: float, wood: Material, front: Material, metal: Material) -> Model:
    """A low cupboard on tapered legs: two doors outside, three drawers between."""
    low, half = 0.17, width / 2
    boards = carcass(depth - 0.006, width, low, height, 0.022)
    third = width / 6
    for y in (-third, third):
        boards.append(
            board((0.01, y - 0.010, low + 0.022), (depth - 0.03, y + 0.010, height - 0.022), 0.001, grain="z")
        )
    boards += [
        leg((x * 1.0, y * 1.03, 0), (x, y, low + 0.002), 0.010, 0.018)
        for x in (0.06, depth - 0.07)
        for y in (-half + 0.10, half - 0.10)
    ]
    fronts, knobs = [], []
    bottom, top = low + 0.025, height - 0.025
    for first, last, y in ((-half + 0.025, -third - 0.012, -third - 0.05), (third + 0.012, half - 0.025, third + 0.05)):
        fronts.append(board((depth - 0.026, first, bottom), (depth - 0.008, last, top), 0.002, grain="z"))
        knobs.append(knob((depth - 0.008, y, (bottom + top) / 2), 0.012, 0.022))
    for first, last in pairwise(np.linspace(bottom, top, 4)):
        fronts.append(
            board((depth - 0.026, -third + 0.012, first + 0.002), (depth - 0.008, third - 0.012, last - 0.002), 0.002)
        )
        knobs.append(knob((depth - 0.008, 0.0, (first + last) / 2), 0.012, 0.022))
    return Part(merge(boards), wood), Part(merge(fronts), front), Part(merge(knobs), metal)


def bedside_table(depth: float, width: float, height: float, wood: Material, front: Material, metal: Material) -> Model:
    """A drawer over an open shelf, on legs."""
    low, half, split = 0.15, width / 2, height - 0.19
    boards = carcass(depth, width, low, height, 0.018)
    boards.append(board((0.01, -half + 0.018, split - 0.016), (depth - 0.004, half - 0.018, split), 0.001))
    boards += [
        leg((x, y * 1.04, 0), (x, y, low + 0.002), 0.009, 0.015)
        for x in (0.04, depth - 0.04)
        for y in (-half + 0.05, half - 0.05)
    ]
    drawer = board((depth - 0.020, -half + 0.021, split + 0.003), (depth - 0.002, half - 0.021, height - 0.021), 0.002)
    return (
        Part(merge(boards), wood),
        Part(drawer, front),
        Part(knob((depth - 0.002, 0, (split + height - 0.018) / 2), 0.012, 0.02), metal),
    )


def filing_cabinet(depth: float, width: float, height: float, drawers: int, paint: Material, metal: Material) -> Model:
    """A steel cabinet of drawers with recessed handles and label holders."""
    half = width / 2
    body = board((0, -half, 0.02), (depth - 0.016, half, height), 0.006)
    feet = board((0.03, -half + 0.02, 0.0), (depth - 0.06, half - 0.02, 0.02), 0.002)
    fronts, handles = [body, feet], []
    for first, last in pairwise(np.linspace(0.035, height - 0.012, drawers + 1)):
        fronts.append(board((depth - 0.018, -half + 0.010, first + 0.004), (depth, half - 0.010, last - 0.004), 0.004))
        z = last - (last - first) * 0.28
        handles.append(bar_handle((depth, 0.0, z), 0.13, reach=0.018))
        handles.append(board((depth, -0.035, z - 0.075), (depth + 0.003, 0.035, z - 0.045), 0.001))
    return Part(merge(fronts), paint), Part(merge(handles), metal)


def tall_cabinet(depth: float, width: float, height: float, paint: Material, metal: Material) -> Model:
    """A steel cupboard of two flat doors with a lever handle."""
    half = width / 2
    body = [board((0, -half, 0.05), (depth - 0.016, half, height), 0.004)]
    body.append(board((0.02, -half + 0.02, 0.0), (depth - 0.05, half - 0.02, 0.05), 0.002))
    for first, last in ((-half + 0.006, -0.002), (0.002, half - 0.006)):
        body.append(board((depth - 0.016, first, 0.06), (depth, last, height - 0.010), 0.003))
    handle = [board((depth, 0.03, height * 0.52), (depth + 0.012, 0.055, height * 0.52 + 0.12), 0.004)]
    handle.append(
        tube(
            [
                (depth + 0.012, 0.042, height * 0.52 + 0.09),
                (depth + 0.035, 0.042, height * 0.52 + 0.09),
                (depth + 0.035, 0.042, height * 0.52),
            ],
            0.006,
            8,
        )
    )
    return Part(merge(body), paint), Part(merge(handle), metal)


def desk(
    depth: float, width: float, height: float, wood: Material, metal: Material, pedestal: Material | None = None
) -> Model:
    """A desk whose sitter looks to -x from +x: a board on a steel frame, with a drawer pedestal at +y on request."""
    half = width / 2
    plate = moved(extrude(rounded_rectangle(depth, width, 0.012, 3), 0.026, bevel=0.003), depth / 2, 0, height - 0.026)
    bars = [board((0.06, -half + 0.07, height - 0.066), (0.10, half - 0.07, height - 0.026), 0.002)]
    for y in (-half + 0.07, half - 0.07):
        bars.append(board((0.04, y - 0.022, 0.0), (depth - 0.04, y + 0.022, 0.024), 0.003))
        bars.append(board((0.04, y - 0.022, height - 0.050), (depth - 0.04, y + 0.022, height - 0.026), 0.003))
        bars += [
            board((x - 0.022, y - 0.022, 0.02), (x + 0.022, y + 0.022, height - 0.03), 0.003)
            for x in (0.07, depth - 0.07)
        ]
    parts = [Part(plate, wood), Part(merge(bars), metal)]
    if pedestal is not None:
        side = filing_cabinet(depth - 0.16, 0.40, 0.56, 3, pedestal, metal)
        parts += [Part(moved(part.mesh, 0.06, half - 0.32, 0.02), part.material) for part in side]
    return tuple(parts)


def dining_table(depth: float, width: float, height: float, wood: Material, slant: float = 0.0) -> Model:
    """A rectangular table along y with aprons and tapered legs that spread by `slant` metres."""
    x, y = depth / 2 - 0.06, width / 2 - 0.06
    plate = moved(extrude(rounded_rectangle(depth, width, 0.02, 4), 0.030, bevel=0.005), z=height - 0.030)
    parts = [plate]
    for sx in (-1, 1):
        for sy in (-1, 1):
            inside = (sx * (x - slant), sy * (y - slant), height - 0.028)
            parts.append(leg((sx * x, sy * y, 0), inside, 0.018, 0.032, sides=12))
    reach_x, reach_y = x - slant, y - slant
    parts += [
        board((sx * reach_x - 0.010, -reach_y, height - 0.11), (sx * reach_x + 0.010, reach_y, height - 0.03))
        for sx in (-1, 1)
    ]
    parts += [
        board((-reach_x, sy * reach_y - 0.010, height - 0.11), (reach_x, sy * reach_y + 0.010, height - 0.03))
        for sy in (-1, 1)
    ]
    return (Part(merge(parts), wood),)
