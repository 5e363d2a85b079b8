"""The shell of a room: floor, walls, ceiling, window and door, as solids that no light passes.

The south wall is at the lowest y. Outlines in a wall's plane are (along the wall, z).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tools.household import materials
from tools.household.joinery import board
from tools.household.model import Floats, Material, Mesh, Model, Part, SceneObject, affine, merge, moved, rotated
from tools.household.outlines import rectangle
from tools.household.shapes import cylinder, extrude, lathe, tube

WALL_M = 0.24


@dataclass(frozen=True)
class Opening:
    """A rectangle in a wall, in metres along the wall and above the floor."""

    low: float
    high: float
    bottom: float
    top: float


@dataclass(frozen=True)
class Shell:
    """The inner faces of a room."""

    west: float
    east: float
    south: float
    north: float
    height: float


def shell(
    room: Shell, window: Opening, door: Opening, paints: dict[str, Material], floor: Material
) -> list[SceneObject]:
    """Floor, ceiling and four walls; the window is a hole in the south wall, the door leaf covers the north wall."""
    low, high = -0.20, room.height + 0.20
    outer = (room.west - WALL_M, room.east + WALL_M)
    south_wall = _wall_with_hole(outer, (low, high), window)
    north_wall = board((outer[0], room.north, low), (outer[1], room.north + WALL_M, high), 0.0005, grain="x")
    solids = {
        "wall_south": moved(south_wall, y=room.south - WALL_M),
        "wall_north": north_wall,
        "wall_west": board((outer[0], room.south, low), (room.west, room.north, high), 0.0005, grain="y"),
        "wall_east": board((room.east, room.south, low), (outer[1], room.north, high), 0.0005, grain="y"),
    }
    objects = [SceneObject(name, (Part(mesh, paints[name]),)) for name, mesh in solids.items()]
    depth = (room.south, room.north)
    slab = board((room.west, depth[0], -0.20), (room.east, depth[1], 0.0), 0.0005, grain="x")
    lid = board((room.west, depth[0], room.height), (room.east, depth[1], high), 0.0005, grain="x")
    objects.append(SceneObject("floor", (Part(slab, floor),)))
    objects.append(SceneObject("ceiling", (Part(lid, paints["ceiling"]),)))
    objects.append(SceneObject("skirting", (Part(_skirting(room, door), materials.paint("#efece5")),)))
    return objects


def _wall_with_hole(along: tuple[float, float], heights: tuple[float, float], hole: Opening) -> Mesh:
    """A wall in the x-z plane from y = 0 (outside) to y = WALL_M."""
    middle = np.array([sum(along) / 2, sum(heights) / 2])
    outline = rectangle(along[1] - along[0], heights[1] - heights[0]) + middle
    opening = np.array([[hole.low, hole.bottom], [hole.high, hole.bottom], [hole.high, hole.top], [hole.low, hole.top]])
    plate = extrude(outline, WALL_M, holes=[opening])
    upright = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    return affine(plate, upright, (0, WALL_M, 0))


def _skirting(room: Shell, door: Opening) -> Mesh:
    height, depth, low = 0.09, 0.014, -0.01
    west, east, south, north = room.west, room.east, room.south, room.north
    return merge(
        [
            board((west, south, low), (east, south + depth, height), 0.004),
            board((west, south, low), (west + depth, north, height), 0.004),
            board((east - depth, south, low), (east, north, height), 0.004),
            board((west, north - depth, low), (door.low - 0.07, north, height), 0.004),
            board((door.high + 0.07, north - depth, low), (east, north, height), 0.004),
        ]
    )


def window(hole: Opening, wall_inner_y: float) -> Model:
    """A white casement window of two leaves with glazing bars, in an opening of the south wall."""
    frame_y, depth, bar = wall_inner_y - 0.14, 0.06, 0.05
    white = materials.paint("#eeece6", 0.35)

    def bars(low: float, high: float, bottom: float, top: float, width: float, y0: float, y1: float) -> list[Mesh]:
        return [
            board((low, y0, bottom), (low + width, y1, top), 0.004),
            board((high - width, y0, bottom), (high, y1, top), 0.004),
            board((low + width, y0, bottom), (high - width, y1, bottom + width), 0.004),
            board((low + width, y0, top - width), (high - width, y1, top), 0.004),
        ]

    middle = (hole.low + hole.high) / 2
    parts = bars(hole.low, hole.high, hole.bottom, hole.top, bar, frame_y, frame_y + depth)
    parts.append(
        board((middle - 0.03, frame_y, hole.bottom + bar), (middle + 0.03, frame_y + depth, hole.top - bar), 0.004)
    )
    glass = []
    for low, high in ((hole.low + bar - 0.008, middle - 0.022), (middle + 0.022, hole.high - bar + 0.008)):
        bottom, top = hole.bottom + bar - 0.008, hole.top - bar + 0.008
        parts += bars(low, high, bottom, top, 0.048, frame_y + 0.018, frame_y + 0.074)
        bar_z = bottom + (top - bottom) * 0.70
        parts.append(
            board((low + 0.04, frame_y + 0.03, bar_z - 0.012), (high - 0.04, frame_y + 0.062, bar_z + 0.012), 0.003)
        )
        glass.append(_pane(low + 0.04, high - 0.04, bottom + 0.04, top - 0.04, frame_y + 0.046))
    sill_out = board(
        (hole.low - 0.04, wall_inner_y - WALL_M - 0.05, hole.bottom - 0.03),
        (hole.high + 0.04, frame_y, hole.bottom + 0.004),
        0.004,
    )
    sill_in = board(
        (hole.low, frame_y + depth, hole.bottom - 0.004), (hole.high, wall_inner_y + 0.028, hole.bottom + 0.018), 0.006
    )
    handles = []
    for x in (middle - 0.046, middle + 0.046):
        z = hole.bottom + (hole.top - hole.bottom) * 0.42
        handles.append(board((x - 0.012, frame_y + 0.074, z - 0.03), (x + 0.012, frame_y + 0.080, z + 0.03), 0.003))
        handles.append(tube([(x, frame_y + 0.08, z), (x, frame_y + 0.115, z)], 0.007, 10))
        handles.append(tube([(x, frame_y + 0.112, z + 0.008), (x, frame_y + 0.112, z - 0.10)], [0.008, 0.006], 10))
    return (
        Part(merge(parts), white),
        Part(merge([sill_out, sill_in]), white),
        Part(merge(handles), materials.brushed_steel()),
        Part(merge(glass), materials.window_glass()),
    )


def _pane(low: float, high: float, bottom: float, top: float, y: float) -> Mesh:
    corners = np.array([[low, y, bottom], [high, y, bottom], [high, y, top], [low, y, top]])
    normals = np.tile([0.0, -1.0, 0.0], (4, 1))
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), normals, corners[:, [0, 2]])


def door(hole: Opening, wall_y: float) -> Model:
    """A closed two-panel door with its architrave and lever handle on the north wall's inner face (facing -y)."""
    white, depth = materials.paint("#f1efe9", 0.32), 0.030
    low, high, top = hole.low, hole.high, hole.top
    face = wall_y - 0.020
    casing = 0.066
    frame = [
        board((low - casing, wall_y - depth, -0.01), (low, wall_y, top + casing), 0.005),
        board((high, wall_y - depth, -0.01), (high + casing, wall_y, top + casing), 0.005),
        board((low - casing, wall_y - depth, top), (high + casing, wall_y, top + casing), 0.005),
    ]
    stile, leaf = 0.115, []
    leaf.append(board((low + 0.003, face, 0.006), (low + stile, wall_y, top - 0.003), 0.004))
    leaf.append(board((high - stile, face, 0.006), (high - 0.003, wall_y, top - 0.003), 0.004))
    for bottom, upper in ((0.006, 0.20), (0.90, 1.03), (top - 0.118, top - 0.003)):
        leaf.append(board((low + stile, face, bottom), (high - stile, wall_y, upper), 0.004))
    for bottom, upper in ((0.20, 0.90), (1.03, top - 0.118)):
        leaf.append(
            board(
                (low + stile - 0.01, wall_y - 0.004, bottom - 0.01), (high - stile + 0.01, wall_y, upper + 0.01), 0.001
            )
        )
        leaf.append(
            board(
                (low + stile + 0.05, wall_y - 0.012, bottom + 0.05), (high - stile - 0.05, wall_y, upper - 0.05), 0.006
            )
        )
    x, z = low + 0.06, 1.0
    rose = moved(rotated(cylinder(0.025, 0.008), "x", 90.0), x, face, z)
    lever = [
        rose,
        tube([(x, face - 0.004, z), (x, face - 0.05, z)], 0.009, 12),
        tube([(x - 0.005, face - 0.048, z), (x + 0.02, face - 0.05, z), (x + 0.115, face - 0.046, z)], 0.008, 12),
        moved(rotated(cylinder(0.025, 0.007), "x", 90.0), x, face, z - 0.08),
    ]
    return Part(merge(frame), white), Part(merge(leaf), white), Part(merge(lever), materials.brass())


def pendant(ceiling_z: float, shade_z: float, glow: Material) -> Model:
    """A ceiling lamp: a paper globe that glows, on a cord; centred on the z axis."""
    radius = 0.19
    angle = np.linspace(-np.pi / 2 + 0.22, np.pi / 2 - 0.22, 19)
    ribs = 0.004 * np.abs(np.sin(angle * 11))
    profile: Floats = np.column_stack([(radius - ribs) * np.cos(angle), shade_z + radius * 0.86 * np.sin(angle)])
    globe = lathe(np.concatenate([[[0.0, profile[0, 1]]], profile, [[0.0, profile[-1, 1]]]]), 26, crease_deg=80.0)
    cord = tube([(0, 0, shade_z + 0.15), (0, 0, ceiling_z - 0.02)], 0.003, 8)
    rose = lathe(
        [
            (0, ceiling_z - 0.035),
            (0.02, ceiling_z - 0.035),
            (0.05, ceiling_z - 0.02),
            (0.055, ceiling_z),
            (0, ceiling_z),
        ],
        24,
    )
    return Part(globe, glow), Part(merge([cord, rose]), materials.black_steel())
