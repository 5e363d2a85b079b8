"""Doors and windows: the wall's plane is y-z, the width along y, the room at +x, the bottom at z = 0.

Each fills its opening from edge to edge, so that it may be stretched a little to fit another.
"""

from __future__ import annotations

import numpy as np

from tools.household import materials
from tools.household.model import Material, Mesh, Model, Part, merge, moved, rotated
from tools.household.planks import board
from tools.household.shapes import cylinder, tube

_LINING_M = 0.030
_LEAF_FRONT, _LEAF_BACK = 0.020, -0.020


def door(
    width: float, height: float, leaf: Material, lining: Material, metal: Material, style: str
) -> dict[str, Model]:
    """A door hung at -y in its lining, as the nodes `frame` and `leaf`; `style` is panels, plain or glazed."""
    half, inner = width / 2, width / 2 - _LINING_M
    frame = [
        board((-0.05, -half, 0.0), (0.05, -inner, height), 0.003),
        board((-0.05, inner, 0.0), (0.05, half, height), 0.003),
        board((-0.05, -inner, height - _LINING_M), (0.05, inner, height), 0.003),
        # The stops that the leaf closes against.
        board((-0.05, -inner, 0.0), (_LEAF_BACK, -inner + 0.012, height - _LINING_M), 0.002),
        board((-0.05, inner - 0.012, 0.0), (_LEAF_BACK, inner, height - _LINING_M), 0.002),
        board((-0.05, -inner, height - _LINING_M - 0.012), (_LEAF_BACK, inner, height - _LINING_M), 0.002),
    ]
    low, high, bottom, top = -inner + 0.003, inner - 0.003, 0.006, height - _LINING_M - 0.003
    blade, glass = _leaf(low, high, bottom, top, style)
    hinges = [tube([(0.022, low, z - 0.04), (0.022, low, z + 0.04)], 0.006, 8) for z in (0.25, height - 0.30)]
    parts = [Part(blade, leaf), Part(merge([*_levers(high - 0.06, 1.02), *hinges]), metal)]
    if glass is not None:
        parts.append(Part(glass, materials.window_glass()))
    return {"frame": (Part(merge(frame), lining),), "leaf": tuple(parts)}


def _leaf(low: float, high: float, bottom: float, top: float, style: str) -> tuple[Mesh, Mesh | None]:
    """The leaf's woodwork and its glass."""
    if style == "plain":
        return board((_LEAF_BACK, low, bottom), (_LEAF_FRONT, high, top), 0.003, grain="z"), None
    stile = 0.115
    pieces = [
        board((_LEAF_BACK, low, bottom), (_LEAF_FRONT, low + stile, top), 0.003),
        board((_LEAF_BACK, high - stile, bottom), (_LEAF_FRONT, high, top), 0.003),
    ]
    rails = (
        ((bottom, 0.22), (0.92, 1.05), (top - stile, top))
        if style == "panels"
        else ((bottom, 0.26), (top - stile, top))
    )
    pieces += [board((_LEAF_BACK, low + stile, z0), (_LEAF_FRONT, high - stile, z1), 0.003) for z0, z1 in rails]
    if style == "panels":
        for z0, z1 in ((0.22, 0.92), (1.05, top - stile)):
            pieces.append(
                board((-0.008, low + stile - 0.008, z0 - 0.008), (0.008, high - stile + 0.008, z1 + 0.008), 0.001)
            )
            pieces.append(
                board((-0.014, low + stile + 0.05, z0 + 0.05), (0.014, high - stile - 0.05, z1 - 0.05), 0.006)
            )
        return merge(pieces), None
    middle = (low + high) / 2
    pieces += [board((-0.012, low + stile, z - 0.012), (0.012, high - stile, z + 0.012), 0.003) for z in (0.83, 1.40)]
    pieces.append(board((-0.012, middle - 0.012, 0.26), (0.012, middle + 0.012, top - stile), 0.003))
    return merge(pieces), pane(low + stile - 0.005, high - stile + 0.005, 0.255, top - stile + 0.005, 0.0)


def _levers(y: float, z: float) -> list[Mesh]:
    """Lever handles with roses on both faces of a leaf."""
    levers = []
    for face, out in ((_LEAF_FRONT, 1.0), (_LEAF_BACK, -1.0)):
        rose = rotated(cylinder(0.025, 0.007, segments=18), "y", 90.0 * out)
        levers.append(moved(rose, face, y, z))
        levers.append(tube([(face, y, z), (face + out * 0.048, y, z)], 0.009, 10))
        levers.append(tube([(face + out * 0.046, y + 0.005, z), (face + out * 0.046, y - 0.115, z)], 0.0085, 10))
    return levers


def window(width: float, height: float, casements: int, frame: Material, bars: tuple[float, ...] = ()) -> Model:
    """A window of side-hung casements; `bars` are the heights of glazing bars as shares of the pane."""
    half, border = width / 2, 0.050
    pieces = _border(-half, half, 0.0, height, border, -0.035, 0.035)
    inner = half - border
    edges = np.linspace(-inner, inner, casements + 1)
    for mullion in edges[1:-1]:
        pieces.append(board((-0.035, mullion - 0.025, border), (0.035, mullion + 0.025, height - border), 0.004))
    glass, handles = [], []
    for index in range(casements):
        low = edges[index] + (0.017 if index else -0.008)
        high = edges[index + 1] - (0.017 if index + 1 < casements else -0.008)
        bottom, top = border - 0.008, height - border + 0.008
        pieces += _border(low, high, bottom, top, 0.048, -0.012, 0.050)
        for share in bars:
            z = bottom + (top - bottom) * share
            pieces.append(board((0.004, low + 0.04, z - 0.012), (0.036, high - 0.04, z + 0.012), 0.003))
        glass.append(pane(low + 0.04, high - 0.04, bottom + 0.04, top - 0.04, 0.020))
        y = high - 0.024 if index + 1 < casements or casements == 1 else low + 0.024
        z = height * 0.45
        handles.append(board((0.050, y - 0.012, z - 0.03), (0.056, y + 0.012, z + 0.03), 0.002))
        handles.append(tube([(0.056, y, z), (0.085, y, z)], 0.007, 8))
        handles.append(tube([(0.083, y, z + 0.008), (0.083, y, z - 0.10)], [0.008, 0.006], 8))
    return (
        Part(merge(pieces), frame),
        Part(merge(handles), materials.brushed_steel()),
        Part(merge(glass), materials.window_glass()),
    )


def _border(low: float, high: float, bottom: float, top: float, width: float, x0: float, x1: float) -> list[Mesh]:
    return [
        board((x0, low, bottom), (x1, low + width, top), 0.004),
        board((x0, high - width, bottom), (x1, high, top), 0.004),
        board((x0, low + width, bottom), (x1, high - width, bottom + width), 0.004),
        board((x0, low + width, top - width), (x1, high - width, top), 0.004),
    ]


def pane(low: float, high: float, bottom: float, top: float, x: float) -> Mesh:
    """A rectangle in the plane y-z that looks to +x."""
    corners = np.array([[x, low, bottom], [x, high, bottom], [x, high, top], [x, low, top]])
    normals = np.tile([1.0, 0.0, 0.0], (4, 1))
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), normals, corners[:, [1, 2]])
