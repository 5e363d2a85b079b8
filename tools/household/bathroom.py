"""Bathroom fittings of glazed ceramic. Backs are at x = 0, fronts face +x, floors at z = 0."""

from __future__ import annotations

import numpy as np

from tools.household import materials
from tools.household.cabinets import framed_front
from tools.household.joinery import bar_handle
from tools.household.model import Floats, Material, Mesh, Model, Part, affine, merge, moved, placed, rotated, rotation
from tools.household.openings import pane
from tools.household.outlines import rounded_rectangle
from tools.household.planks import board
from tools.household.shapes import bevelled_box, cylinder, extrude, lathe, loft, tube
from tools.household.storage import sink, tap


def oval(length: float, width: float, x: float = 0.0, points: int = 32, square: float = 0.85) -> Floats:
    """A superellipse outline about (x, 0), longer along x."""
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack(
        [x + length / 2 * np.sign(c) * np.abs(c) ** square, width / 2 * np.sign(s) * np.abs(s) ** square]
    )


def _ring(outline: Floats, z: float) -> Floats:
    return np.column_stack([outline, np.full(len(outline), z)])


def toilet(style: str, glaze: Material, seat: Material) -> Model:
    """A toilet, 0.68 m deep; `style` is closed, open (its lid up) or hung (with a panel for the cistern)."""
    hung = style == "hung"
    start = 0.10 if hung else 0.16
    reach = start + 0.50
    middle = (start + reach) / 2
    if hung:
        foot = [(middle - 0.06, 0.36, 0.28, 0.10), (middle - 0.04, 0.42, 0.33, 0.16), (middle, 0.49, 0.36, 0.28)]
    else:
        foot = [
            (middle - 0.07, 0.34, 0.22, 0.0),
            (middle - 0.07, 0.33, 0.21, 0.05),
            (middle - 0.06, 0.33, 0.20, 0.15),
            (middle - 0.03, 0.42, 0.28, 0.27),
        ]
    rings = [_ring(oval(length, width, x), z) for x, length, width, z in foot]
    rings += [_ring(oval(0.50, 0.365, middle), z) for z in (0.36, 0.395)]
    rings.append(_ring(oval(0.49, 0.355, middle), 0.400))
    for x, length, width, z in (
        (middle + 0.01, 0.37, 0.25, 0.400),
        (middle + 0.01, 0.34, 0.22, 0.36),
        (middle, 0.26, 0.17, 0.28),
        (middle - 0.02, 0.16, 0.12, 0.22),
    ):
        rings.append(_ring(oval(length, width, x), z))
    ceramic = [loft(np.stack(rings), crease_deg=45.0)]
    chrome = []
    if hung:
        ceramic.append(board((0.0, -0.30, 0.0), (0.12, 0.30, 1.08), 0.004))
        chrome.append(board((0.118, -0.12, 0.86), (0.128, 0.12, 1.00), 0.006))
        chrome += [board((0.126, y - 0.045, 0.885), (0.131, y + 0.045, 0.975), 0.005) for y in (-0.055, 0.055)]
    else:
        ceramic.append(bevelled_box((0.165, 0.37, 0.34), (0.0875, 0, 0.575), 0.022, 3))
        ceramic.append(bevelled_box((0.180, 0.385, 0.030), (0.0900, 0, 0.758), 0.011, 2))
        ceramic.append(board((0.01, -0.09, 0.0), (0.24, 0.09, 0.40), 0.03))
        chrome.append(moved(cylinder(0.024, 0.010, segments=20), 0.09, 0, 0.770))
    frame = extrude(oval(0.465, 0.365, middle + 0.015), 0.016, bevel=0.005, holes=[oval(0.30, 0.21, middle + 0.02)])
    lid = extrude(oval(0.465, 0.365, middle + 0.015), 0.018, bevel=0.008, segments=3)
    hinge = start + 0.045
    if style == "open":
        turned = affine(moved(lid, -hinge), rotation("y", -87.0), (hinge, 0, 0.418))
        covers = [moved(frame, z=0.402), turned]
    else:
        covers = [moved(frame, z=0.402), moved(lid, z=0.419)]
    chrome += [
        moved(rotated(cylinder(0.011, 0.05, segments=12), "x", 90.0), hinge, y + 0.025, 0.42) for y in (-0.08, 0.08)
    ]
    water = moved(extrude(oval(0.14, 0.105, middle - 0.015, 20), 0.004), z=0.228)
    return (
        Part(merge(ceramic), glaze),
        Part(merge(covers), seat),
        Part(merge(chrome), materials.chrome()),
        Part(water, materials.paint("#9fb6bd", 0.05)),
    )


def washbasin(style: str, glaze: Material, lacquer: Material) -> Model:
    """A bathroom basin 0.60 m wide with its tap; `style` is pedestal, wall (no stand) or vanity (on a cabinet)."""
    width, depth, height = 0.60, 0.46, 0.86
    basin = placed(sink(depth, width, 0.17, 0.05, glaze), (depth / 2, 0, height - 0.17))
    ledge = board((0.0, -width * 0.40, height - 0.05), (0.10, width * 0.40, height + 0.004), 0.012)
    parts = [*basin, Part(ledge, glaze), *placed(tap(0.12, 0.16), (0.05, 0, height + 0.002))]
    if style == "pedestal":
        rings = [
            _ring(oval(length, wide, 0.17, 24), z)
            for length, wide, z in (
                (0.24, 0.22, 0.0),
                (0.22, 0.20, 0.04),
                (0.15, 0.15, 0.30),
                (0.16, 0.17, 0.58),
                (0.24, 0.30, 0.715),
            )
        ]
        parts.append(Part(loft(np.stack(rings), crease_deg=50.0), glaze))
    elif style == "vanity":
        box = [board((0, -width / 2 + 0.01, 0.22), (depth - 0.03, width / 2 - 0.01, height - 0.10), 0.002)]
        for low, high in ((0.225, 0.485), (0.490, height - 0.10)):
            box.append(framed_front(depth - 0.03, -width / 2 + 0.012, width / 2 - 0.012, low, high, 0.05))
        legs = [
            board((x, y - 0.015, 0), (x + 0.03, y + 0.015, 0.22), 0.002)
            for x in (0.03, depth - 0.08)
            for y in (-0.26, 0.26)
        ]
        handles = [bar_handle((depth - 0.01, 0, z), 0.16) for z in (0.41, 0.69)]
        parts += [Part(merge([*box, *legs]), lacquer), Part(merge(handles), materials.black_steel())]
    else:
        pipe = tube([(0.18, 0, height - 0.17), (0.18, 0, 0.58), (0.10, 0, 0.56), (0.0, 0, 0.56)], 0.016, 12)
        parts.append(Part(pipe, materials.chrome()))
    return tuple(parts)


def bathtub(style: str, glaze: Material, panel: Material) -> Model:
    """A bathtub along y; `style` is panelled (built in) or free (an oval on the floor)."""
    if style == "free":
        outer = [(1.30, 0.56, 0.0), (1.38, 0.62, 0.06), (1.58, 0.72, 0.36), (1.70, 0.80, 0.57), (1.70, 0.80, 0.585)]
        inner = [(1.66, 0.76, 0.585), (1.60, 0.71, 0.55), (1.42, 0.58, 0.25), (1.24, 0.46, 0.14), (0.9, 0.3, 0.125)]
        rings = [_turned(oval(length, width, 0.0, 40, 0.8), z) for length, width, z in (*outer, *inner)]
        tub = moved(loft(np.stack(rings), crease_deg=45.0), x=0.40)
        spout = placed(_standing_tap(), (0.10, -0.98, 0.0), 60.0)
        return (Part(tub, glaze), *spout)
    depth, width, height = 0.75, 1.70, 0.57
    rim = rounded_rectangle(depth, width, 0.03, 4)
    hollows = (
        (0.60, 1.52, 0.16, height),
        (0.585, 1.50, 0.16, height - 0.02),
        (0.52, 1.34, 0.15, 0.22),
        (0.44, 1.20, 0.13, 0.15),
        (0.2, 0.8, 0.09, 0.14),
    )
    outline = rounded_rectangle(0.60, 1.52, 0.16, 8)
    plate = moved(extrude(rim, 0.03, bevel=0.008, holes=[outline]), z=height - 0.03)
    rings = [_ring(rounded_rectangle(x, y, radius, 8), z) for x, y, radius, z in hollows]
    bowl = loft(np.stack(rings), crease_deg=45.0)
    skirt = [
        board(
            (depth / 2 - 0.02, -width / 2 + 0.004, 0.0), (depth / 2 - 0.006, width / 2 - 0.004, height - 0.03), 0.002
        ),
        board(
            (-depth / 2 + 0.004, -width / 2 + 0.004, 0.0), (depth / 2 - 0.02, -width / 2 + 0.02, height - 0.03), 0.002
        ),
        board((-depth / 2 + 0.004, width / 2 - 0.02, 0.0), (depth / 2 - 0.02, width / 2 - 0.004, height - 0.03), 0.002),
        board((-depth / 2, -width / 2 + 0.02, 0.0), (-depth / 2 + 0.01, width / 2 - 0.02, height - 0.03), 0.002),
    ]
    mixer = [
        tube([(-depth / 2 + 0.05, y, height), (-depth / 2 + 0.05, y, height + 0.07)], 0.013, 10) for y in (-0.08, 0.08)
    ]
    mixer.append(tube([(-depth / 2 + 0.05, -0.12, height + 0.07), (-depth / 2 + 0.05, 0.12, height + 0.07)], 0.019, 12))
    mixer.append(
        tube(
            [
                (-depth / 2 + 0.05, 0, height + 0.07),
                (-depth / 2 + 0.12, 0, height + 0.09),
                (-depth / 2 + 0.17, 0, height + 0.06),
            ],
            0.012,
            10,
        )
    )
    return Part(merge([plate, _inward(bowl)]), glaze), Part(merge(skirt), panel), Part(merge(mixer), materials.chrome())


def _turned(outline: Floats, z: float) -> Floats:
    """A ring whose long side lies along y, still counter-clockwise."""
    return np.column_stack([-outline[:, 1], outline[:, 0], np.full(len(outline), z)])


def _inward(mesh: Mesh) -> Mesh:
    """A hollow listed from its rim down is wound inside out by `loft`; its top cap is dropped."""
    corners = mesh.vertices[mesh.triangles]
    is_lid = corners[:, :, 2].min(axis=1) > mesh.vertices[:, 2].max() - 1e-6
    return Mesh(mesh.vertices, mesh.triangles[~is_lid], mesh.normals, mesh.uvs)


def _standing_tap() -> Model:
    pipe = tube(
        [(0, 0, 0.0), (0, 0, 0.78), (0.03, 0, 0.85), (0.10, 0, 0.88), (0.17, 0, 0.85), (0.18, 0, 0.80)], 0.014, 12
    )
    foot = lathe([(0, 0), (0.05, 0), (0.05, 0.012), (0.016, 0.016)], 20)
    lever = tube([(0.0, 0.014, 0.70), (0.0, 0.07, 0.73)], 0.007, 8)
    return (Part(merge([pipe, foot, lever]), materials.chrome()),)


def shower(width: float, depth: float, glaze: Material) -> Model:
    """A corner shower: tray, two glass panels in a chrome frame, rail and head; the walls are at -x and -y."""
    half, height = width / 2, 2.0
    tray = [moved(extrude(rounded_rectangle(depth, width, 0.03, 4), 0.05, bevel=0.01), depth / 2)]
    frame = [
        board((depth - 0.03, y - 0.012, 0.045), (depth - 0.006, y + 0.012, height), 0.002)
        for y in (-half + 0.014, half - 0.014)
    ]
    frame += [
        board((depth - 0.03, -half, height - 0.02), (depth - 0.006, half, height), 0.002),
        board((0.0, half - 0.026, height - 0.02), (depth, half - 0.004, height), 0.002),
        board((0.0, half - 0.026, 0.045), (0.02, half - 0.004, height), 0.002),
        tube(
            [
                (depth - 0.0, -half * 0.4, 0.9),
                (depth + 0.02, -half * 0.4, 0.9),
                (depth + 0.02, -half * 0.4, 1.15),
                (depth, -half * 0.4, 1.15),
            ],
            0.007,
            8,
        ),
        tube(
            [
                (0.03, -half * 0.2, 0.95),
                (0.03, -half * 0.2, 1.95),
                (0.10, -half * 0.2, 2.05),
                (0.32, -half * 0.2, 2.05),
                (0.34, -half * 0.2, 2.02),
            ],
            0.010,
            12,
        ),
        moved(lathe([(0, 0.0), (0.11, 0.0), (0.11, 0.010), (0.02, 0.025), (0, 0.025)], 28), 0.34, -half * 0.2, 1.995),
        moved(rotated(cylinder(0.035, 0.05, segments=20), "y", 90.0), 0.0, -half * 0.2, 1.05),
        tube(
            [
                (0.03, -half * 0.2, 1.05),
                (0.05, -half * 0.2 + 0.05, 0.7),
                (0.05, -half * 0.2 + 0.02, 0.75),
                (0.05, -half * 0.2, 1.35),
            ],
            0.006,
            8,
        ),
    ]
    front = pane(-half + 0.02, half - 0.02, 0.05, height - 0.01, depth - 0.018)
    side = affine(pane(-depth + 0.02, 0.0, 0.05, height - 0.01, 0.0), rotation("z", 90.0), (0.0, half - 0.015, 0.0))
    drain = moved(lathe([(0, 0.0012), (0.045, 0.0012), (0.05, 0.0)], 20), depth / 2, 0, 0.05)
    return (
        Part(merge(tray), glaze),
        Part(merge([*frame, drain]), materials.chrome()),
        Part(merge([front, side]), materials.window_glass()),
    )


def mirror(width: float, height: float, frame: Material, is_round: bool = False) -> Model:
    """A mirror on the wall at x = 0."""
    silver = Material("mirror", base_color=(0.92, 0.92, 0.92), roughness=0.0, metallic=1.0)
    upright = np.array([[0.0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]])
    if is_round:
        rim = affine(
            lathe(
                [(0, 0), (width / 2, 0), (width / 2, 0.022), (width / 2 - 0.012, 0.022), (width / 2 - 0.014, 0.016)], 56
            ),
            upright,
        )
        glass = affine(moved(lathe([(width / 2 - 0.013, 0.0), (0, 0)], 56), z=0.0165), upright)
        return Part(rim, frame), Part(glass, silver)
    y, z, border = width / 2, height / 2, 0.022
    rim_parts = [
        board((0, -y, -z), (0.024, -y + border, z), 0.003, grain="z"),
        board((0, y - border, -z), (0.024, y, z), 0.003, grain="z"),
        board((0, -y + border, -z), (0.024, y - border, -z + border), 0.003),
        board((0, -y + border, z - border), (0.024, y - border, z), 0.003),
        board((0, -y + border, -z + border), (0.010, y - border, z - border), 0.0005),
    ]
    return Part(merge(rim_parts), frame), Part(pane(-y + border, y - border, -z + border, z - border, 0.0115), silver)
