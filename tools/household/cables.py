"""Cables: power strips at walls, what leads from them, a telephone's charger; the room is at +x."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tools.household import materials
from tools.household.model import Floats, Material, Mesh, Model, Part, merge, moved, rotated
from tools.household.outlines import catmull_rom
from tools.household.planks import board
from tools.household.shapes import bevelled_box, cylinder, lathe, tube
from tools.household.textures import linear_color

_CABLE_M, _THIN_CABLE_M = 0.0036, 0.0022
# How far the middle of the floor's cables is from the wall: a skirting board is in between.
_OFF_WALL_M = 0.055
# How far a cable's middle may be from the straight line that is drawn for it.
_STRAIGHT_M = 0.001


def _cable(points: Sequence[Sequence[float]], radius_m: float = _CABLE_M) -> Mesh:
    """A round cable that runs in curves through points."""
    fine = catmull_rom(points, 24 * len(points))
    return tube(fine[_corners(fine)], radius_m, 6)


def _corners(line: Floats) -> list[int]:
    """The points of a line that it cannot do without: all others are within `_STRAIGHT_M` of it (Douglas, Peucker)."""
    along = line[-1] - line[0]
    along /= max(float(np.linalg.norm(along)), 1e-9)
    off = line - line[0]
    away = np.linalg.norm(off - (off @ along)[:, None] * along, axis=1)
    furthest = int(np.argmax(away))
    if away[furthest] < _STRAIGHT_M:
        return [0, len(line) - 1]
    return [*_corners(line[: furthest + 1]), *(furthest + later for later in _corners(line[furthest:])[1:])]


def _plug(y: float) -> Mesh:
    """A round plug that stands in the strip's socket, its cable's sleeve on top."""
    body = lathe([(0.017, 0.0), (0.0185, 0.004), (0.0165, 0.022), (0.007, 0.032), (0.005, 0.042), (0.0, 0.042)], 10)
    return moved(body, _OFF_WALL_M, y, 0.036)


def _strip() -> tuple[list[Mesh], list[Mesh], list[Mesh]]:
    """A strip of four sockets along y on the floor: its white, its dark and its red parts."""
    white = [bevelled_box((0.056, 0.30, 0.038), (_OFF_WALL_M, 0.0, 0.019), 0.006)]
    dark = [moved(lathe([(0.019, 0.0), (0.0, 0.0)], 12), _OFF_WALL_M, y, 0.0385) for y in (-0.11, 0.04)]
    red = [board((_OFF_WALL_M - 0.007, 0.114, 0.036), (_OFF_WALL_M + 0.007, 0.136, 0.042), 0.002)]
    return white, dark, red


def _outlet(y: float, z: float) -> Mesh:
    """A socket in the wall with the plug in it."""
    plate = board((-0.039, -0.039, 0.0), (0.039, 0.039, 0.009), 0.003)
    plug = moved(cylinder(0.018, 0.030, 0.004, 10), 0.0, 0.0, 0.008)
    return moved(rotated(merge([plate, plug]), "y", 90.0), 0.0, y, z)


def _supply(y: float, z: float) -> Mesh:
    """The strip's own cable: off its end, in a bend along the wall, and up to the outlet at `y`, `z`."""
    x, low = _OFF_WALL_M, _CABLE_M
    return _cable(
        [
            (x, 0.145, 0.016),
            (x, 0.185, low),
            (x + 0.03, 0.25, low),
            (x - 0.012, 0.33, low),
            (x - 0.018, y - 0.02, low + 0.02),
            (x - 0.020, y, 0.12),
            (x - 0.006, y, z - 0.05),
            (x - 0.004, y, z - 0.012),
            (0.036, y, z),
        ],
    )


def power_strip() -> Model:
    """A strip on the floor before a wall, plugged into it, with a cable that leads off along the wall to -y."""
    white, dark, red = _strip()
    low = _CABLE_M
    leads = _cable(
        [
            (_OFF_WALL_M, -0.04, 0.076),
            (_OFF_WALL_M + 0.01, -0.06, 0.085),
            (_OFF_WALL_M + 0.045, -0.12, 0.03),
            (_OFF_WALL_M + 0.05, -0.18, low),
            (_OFF_WALL_M - 0.01, -0.27, low),
            (_OFF_WALL_M + 0.015, -0.36, low),
            (_OFF_WALL_M - 0.030, -0.46, low),
        ],
    )
    return (
        Part(merge([*white, _supply(0.42, 0.28), _outlet(0.42, 0.28)]), materials.paint("#e9e8e4", 0.35)),
        Part(merge([*dark, _plug(-0.04), leads]), materials.paint("#26272a", 0.45)),
        Part(merge(red), materials.paint("#a8332b", 0.3)),
    )


def desk_cables(height_m: float) -> Model:
    """A strip below a desk against a wall, and two cables from it up behind the desk and onto its top.

    The desk's rear edge is 25 mm from the wall at x = 0, its top at `height_m`.
    """
    white, dark, red = _strip()
    behind, top = 0.013, height_m + _CABLE_M

    def up(socket: float, y: float, ends: Sequence[Sequence[float]]) -> Mesh:
        start = [
            (_OFF_WALL_M, socket, 0.076),
            (_OFF_WALL_M + 0.002, socket, 0.10),
            (_OFF_WALL_M - 0.004, socket + (y - socket) * 0.3, 0.14),
            (behind + 0.004, y, 0.27),
            (behind, y + 0.012, 0.48),
            (behind, y, height_m - 0.06),
            (behind, y, height_m - 0.005),
            (behind + 0.007, y, height_m + 0.008),
            (behind + 0.024, y, top),
        ]
        return _cable([*start, *ends])

    first = up(-0.11, -0.06, [(0.060, -0.062, top), (0.105, -0.045, top), (0.150, -0.055, top), (0.19, -0.025, top)])
    second = up(0.04, 0.07, [(0.058, 0.075, top), (0.095, 0.100, top), (0.135, 0.098, top), (0.18, 0.075, top)])
    return (
        Part(merge([*white, _supply(0.36, 0.28), _outlet(0.36, 0.28)]), materials.paint("#e9e8e4", 0.35)),
        Part(merge([*dark, _plug(-0.11), _plug(0.04), first, second]), materials.paint("#26272a", 0.45)),
        Part(merge(red), materials.paint("#a8332b", 0.3)),
    )


def charger() -> Model:
    """A telephone's thin cable that lies in loops, with its two plugs."""
    low = _THIN_CABLE_M
    angle = np.linspace(0.0, 3.2 * np.pi, 15)
    loops = np.column_stack(
        [
            (0.052 + 0.004 * angle / np.pi) * np.cos(angle),
            (0.040 + 0.003 * angle / np.pi) * np.sin(angle),
            low + 0.0042 * np.clip((angle - 1.6 * np.pi) / 0.4, 0.0, 1.0),
        ]
    )
    start = [(0.050, -0.115, low + 0.001), (0.060, -0.075, low)]
    end = [(-0.075, -0.050, 0.005), (-0.105, -0.085, low), (-0.120, -0.120, low + 0.001)]
    cable = _cable([*start, *loops, *end], _THIN_CABLE_M)
    plugs = [
        bevelled_box((0.010, 0.026, 0.006), (0.048, -0.124, 0.0035), 0.002),
        bevelled_box((0.015, 0.034, 0.008), (-0.125, -0.133, 0.0045), 0.002),
    ]
    metal = bevelled_box((0.012, 0.013, 0.0045), (-0.128, -0.156, 0.0045), 0.0006)
    return Part(merge([cable, *plugs]), materials.paint("#ecebe7", 0.4)), Part(
        metal, Material("plug steel", linear_color("#b9bbbd"), roughness=0.3, metallic=1.0)
    )
