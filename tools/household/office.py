"""Clocks for the wall, whiteboards, coat racks and plant stands; walls are at x = 0, rooms at +x."""

from __future__ import annotations

import numpy as np

from tools.household import materials
from tools.household.joinery import leg
from tools.household.model import Material, Model, Part, affine, merge, moved
from tools.household.outlines import catmull_rom
from tools.household.planks import board
from tools.household.shapes import bevelled_box, cylinder, ellipsoid, grid_surface, lathe, tube
from tools.household.textures import labels

_FORWARD = np.array([[0.0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]])


def wall_clock(diameter: float, rim: Material, style: str, hour: int, minute: int) -> Model:
    """A round clock."""
    r = diameter / 2
    case = affine(
        lathe(
            [(0, 0), (r * 0.97, 0), (r, 0.006), (r, 0.030), (r - 0.006, 0.036), (r - 0.014, 0.034), (r - 0.018, 0.024)],
            48,
        ),
        _FORWARD,
    )
    face = labels.clock_face(2 * (r - 0.017), style, hour, minute)
    inner = r - 0.017
    distance, angle = np.meshgrid([0.0, inner], np.linspace(0, 2 * np.pi, 49), indexing="ij")
    y, z = distance * np.cos(angle), distance * np.sin(angle)
    dial = grid_surface(np.stack([np.full_like(y, 0.0245), y, z], axis=2), np.stack([y + inner, z + inner], axis=2))
    return Part(case, rim), Part(dial, Material(f"clock face {style}", base_color_texture=face, roughness=0.35))


def mantel_clock(wood: Material) -> Model:
    """A clock with a rounded wooden case that stands and looks to +x."""
    parts = [bevelled_box((0.075, 0.20, 0.02), (0, 0, 0.01), 0.004, 2, grain="y")]
    arch = [(0.10 * np.cos(a), 0.085 + 0.10 * np.sin(a)) for a in np.radians(np.linspace(0, 180, 25))]
    outline = [(0.085, 0.02), *((0.85 * y, z) for y, z in arch), (-0.085, 0.02)]
    rows = np.stack([np.column_stack([np.full(len(outline), x), np.array(outline)]) for x in (-0.03, 0.03)])
    middle = np.array([0.0, 0.09])
    caps = [np.column_stack([np.full(len(outline), x), np.tile(middle, (len(outline), 1))]) for x in (-0.03, 0.03)]
    parts.append(grid_surface(np.stack([caps[1], rows[1], rows[0], caps[0]]), crease_deg=40.0))
    dial = wall_clock(0.125, materials.brass(), "roman", 4, 37)
    return (Part(merge(parts), wood), *(Part(moved(part.mesh, 0.020, 0, 0.098), part.material) for part in dial))


def whiteboard(width: float, height: float, on_wheels: bool) -> Model:
    """A whiteboard with its tray, on the wall or on a wheeled stand."""
    low = 0.85 if on_wheels else 0.0
    frame = [
        board((0, -width / 2, low), (0.018, width / 2, low + 0.018), 0.003),
        board((0, -width / 2, low + height - 0.018), (0.018, width / 2, low + height), 0.003),
        board((0, -width / 2, low + 0.018), (0.018, -width / 2 + 0.018, low + height - 0.018), 0.003),
        board((0, width / 2 - 0.018, low + 0.018), (0.018, width / 2, low + height - 0.018), 0.003),
        board((0.0, -width * 0.3, low - 0.004), (0.075, width * 0.3, low + 0.006), 0.003),
    ]
    pens = [tube([(0.05, y, low + 0.013), (0.05, y + 0.12, low + 0.013)], 0.007, 8) for y in (-0.2, 0.02)]
    if on_wheels:
        for y in (-width / 2 + 0.06, width / 2 - 0.06):
            frame.append(board((-0.028, y - 0.015, 0.07), (0.0, y + 0.015, low + height * 0.8), 0.003))
            frame.append(board((-0.28, y - 0.018, 0.06), (0.26, y + 0.018, 0.085), 0.003))
            frame += [moved(ellipsoid((0.03, 0.015, 0.03), 14, 8), x, y, 0.03) for x in (-0.25, 0.23)]
        frame.append(board((-0.025, -width / 2 + 0.06, 0.30), (-0.003, width / 2 - 0.06, 0.33), 0.003))
    panel = board((0.002, -width / 2 + 0.012, low + 0.012), (0.010, width / 2 - 0.012, low + height - 0.012), 0.0005)
    rng = np.random.default_rng(4)
    lines = []
    for row in range(5):
        y, z = -width * 0.40, low + height * (0.84 - 0.13 * row)
        count = int(rng.integers(12, 34))
        stroke = np.column_stack(
            [np.full(count, 0.0107), y + 0.022 * np.arange(count), z + 0.012 * rng.normal(0, 1, count)]
        )
        lines.append(tube(catmull_rom(stroke, count * 2), 0.0013, 4, caps=False))
    return (
        Part(merge(frame), Material("aluminium", base_color=(0.68, 0.69, 0.70), roughness=0.4, metallic=1.0)),
        Part(panel, materials.paint("#f7f7f5", 0.12)),
        Part(merge(lines), materials.paint("#24457a", 0.6)),
        Part(merge(pens), materials.paint("#b3342b", 0.4)),
    )


def coat_stand(wood: Material, metal: Material) -> Model:
    """A coat stand with eight hooks."""
    pole = tube([(0, 0, 0.02), (0, 0, 0.9), (0, 0, 1.70)], [0.021, 0.019, 0.015], 14)
    feet = [
        tube(
            catmull_rom(
                [(0, 0, 0.16), (0.12 * np.cos(a), 0.12 * np.sin(a), 0.11), (0.26 * np.cos(a), 0.26 * np.sin(a), 0.012)],
                10,
            ),
            0.014,
            10,
        )
        for a in np.radians([45, 135, 225, 315])
    ]
    hooks = []
    for z, turn in ((1.62, 0.0), (1.38, 45.0)):
        for a in np.radians(np.array([0, 90, 180, 270]) + turn):
            out = np.array([np.cos(a), np.sin(a), 0.0])
            hooks.append(
                tube(
                    catmull_rom(
                        [out * 0.01 + [0, 0, z - 0.06], out * 0.07 + [0, 0, z - 0.03], out * 0.13 + [0, 0, z + 0.05]], 8
                    ),
                    0.008,
                    8,
                )
            )
            hooks.append(moved(ellipsoid((0.013, 0.013, 0.013), 10, 6), *(out * 0.13 + [0, 0, z + 0.05])))
    return Part(merge([pole, *feet, moved(ellipsoid((0.025, 0.025, 0.025), 14, 8), z=1.71)]), wood), Part(
        merge(hooks), metal
    )


def coat_rail(width: float, wood: Material, metal: Material) -> Model:
    """A board with hooks for the wall."""
    hooks = []
    for y in np.linspace(-width / 2 + 0.09, width / 2 - 0.09, 5):
        hooks.append(
            tube(catmull_rom([(0.02, y, 0.055), (0.05, y, 0.03), (0.075, y, 0.055), (0.078, y, 0.085)], 10), 0.006, 8)
        )
        hooks.append(moved(ellipsoid((0.010, 0.010, 0.010), 10, 6), 0.078, y, 0.088))
        hooks.append(board((0.019, y - 0.012, 0.02), (0.025, y + 0.012, 0.09), 0.002))
    return Part(board((0, -width / 2, 0), (0.021, width / 2, 0.11), 0.004), wood), Part(merge(hooks), metal)


def plant_stand(height: float, width: float, wood: Material) -> Model:
    """A small stand: a round top on four legs."""
    r = width / 2
    top = moved(cylinder(r, 0.022, 0.005, 36), z=height - 0.022)
    legs = [
        leg(
            (r * 0.92 * np.cos(a), r * 0.92 * np.sin(a), 0),
            (r * 0.6 * np.cos(a), r * 0.6 * np.sin(a), height - 0.02),
            0.010,
            0.015,
        )
        for a in np.radians([45, 135, 225, 315])
    ]
    ring = tube(
        [(r * 0.74 * np.cos(a), r * 0.74 * np.sin(a), height * 0.45) for a in np.radians(np.arange(0, 360, 12))],
        0.006,
        8,
        closed=True,
    )
    return (Part(merge([top, *legs, ring]), wood),)
