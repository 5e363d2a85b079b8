"""Screens, keyboards, mice, telephones. Screens and their users face +x; models stand on z = 0."""

from __future__ import annotations

import numpy as np

from tools.household import materials
from tools.household.meshing import build
from tools.household.model import Material, Mesh, Model, Part, Texture, affine, merge, moved, rotation, transformed
from tools.household.outlines import rounded_rectangle
from tools.household.planks import board
from tools.household.shapes import bevelled_box, cylinder, extrude, grid_surface, loft, tube
from tools.household.textures import screens

_SCREEN_RADIANCE = 0.06


def _glass(name: str, picture: Texture, radiance: float = _SCREEN_RADIANCE) -> Material:
    """A glossy screen that glows with its picture."""
    return Material(
        name,
        base_color=(0.18, 0.18, 0.18),
        base_color_texture=picture,
        roughness=0.12,
        emissive=(1.0, 1.0, 1.0),
        emissive_strength=radiance,
        emissive_texture=picture,
    )


def facing(width: float, height: float, x: float = 0.0, z: float = 0.0) -> Mesh:
    """A rectangle in the plane y-z that looks to +x, its picture upright, its lower edge at `z`."""
    y, up = np.meshgrid([-width / 2, width / 2], [height, 0.0])
    points = np.stack([np.full_like(y, x), y, up + z], axis=2)
    return grid_surface(points, np.stack([y + width / 2, up], axis=2))


def flat_screen(width: float, height: float, picture: Texture, foot: str, case: Material) -> Model:
    """A television or monitor; `foot` is legs, column or wall."""
    raised = {"legs": 0.075, "column": 0.13, "wall": 0.0}[foot]
    bezel = 0.011
    body = [
        bevelled_box((0.028, width, height), (0.0, 0, raised + height / 2), 0.004, 2),
        bevelled_box((0.035, width * 0.62, height * 0.55), (-0.028, 0, raised + height * 0.42), 0.010, 2),
    ]
    if foot == "legs":
        for side in (-1, 1):
            y = side * width * 0.36
            body += [tube([(0.0, y, raised + 0.01), (x, y, 0.006)], 0.007, 8) for x in (-0.13, 0.13)]
            body.append(tube([(-0.135, y, 0.006), (0.135, y, 0.006)], 0.006, 8))
    elif foot == "column":
        body.append(board((-0.055, -0.03, 0.01), (-0.040, 0.03, raised + height * 0.35), 0.004))
        body.append(moved(extrude(rounded_rectangle(0.20, min(0.28, width * 0.5), 0.03, 4), 0.010, bevel=0.003), -0.02))
    else:
        body.append(board((-0.060, -width * 0.15, height * 0.25), (-0.03, width * 0.15, height * 0.6), 0.004))
    panel = facing(width - 2 * bezel, height - 2 * bezel - 0.006, 0.0143, raised + bezel + 0.006)
    return Part(merge(body), case), Part(panel, _glass("screen", picture))


def keyboard(width: float, depth: float, case: Material, ground: str, ink: str, has_numbers: bool) -> Model:
    """A keyboard in front of a typist at +x: six rows of keys, rising towards -x; a number block at +y."""
    rise, low = 0.009, 0.012
    main = width * (0.78 if has_numbers else 1.0) - 0.016
    unit, pitch = main / 15.0, (depth - 0.018) / 6.0
    legend = screens.legends(main, pitch * 6, ground, ink)

    def height(x: float) -> float:
        return low + rise * (0.5 - x / depth)

    keys = []
    start = -width / 2 + 0.008
    for row, widths in enumerate(_KEY_ROWS):
        x = -depth / 2 + 0.009 + pitch * (row + 0.5)
        y = 0.0
        for units in widths:
            if units > 0:
                keys.append(_key(x, start + (y + units / 2) * unit, pitch - 0.003, units * unit - 0.003, height(x)))
            y += abs(units)
        if has_numbers:
            left = start + main + unit * 0.5
            step = (width / 2 - 0.008 - left) / 4
            keys += [_key(x, left + step * (k + 0.5), pitch - 0.003, step - 0.003, height(x)) for k in range(4)]
    points = merge(keys)
    uvs = np.column_stack([points.vertices[:, 1] - start, depth / 2 - 0.009 - points.vertices[:, 0]])
    # Where a typist at +x reads, u runs along +y and up is towards -x.
    caps = Mesh(points.vertices, points.triangles, points.normals, uvs)
    corners = [(-depth / 2, 0.0), (depth / 2, 0.0), (depth / 2, low - rise / 2), (-depth / 2, low + rise / 2)]
    shell = moved(
        affine(extrude(corners, width, bevel=0.002), np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])), y=width / 2
    )
    return Part(shell, case), Part(caps, Material("key caps", base_color_texture=legend, roughness=0.5))


_KEY_ROWS = (
    (1, -0.5, 1, 1, 1, 1, -0.25, 1, 1, 1, 1, -0.25, 1, 1, 1, 1),
    (1,) * 13 + (2,),
    (1.5,) + (1,) * 12 + (1.5,),
    (1.75,) + (1,) * 11 + (2.25,),
    (2.25,) + (1,) * 10 + (2.75,),
    (1.25, 1.25, 1.25, 6.25, 1.25, 1.25, 1.25, 1.25),
)


def _key(x: float, y: float, depth: float, width: float, z: float) -> Mesh:
    """A key cap: a frustum without a bottom, ten triangles."""
    low = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * [depth, width]
    high = low * [0.80, 1.0 - 0.0034 / width]
    points = np.concatenate(
        [np.column_stack([low, np.full(4, z - 0.003)]), np.column_stack([high, np.full(4, z + 0.004)])]
    )
    sides = [[k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)]
    quads = np.array([*sides, [4, 5, 6, 7]])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    return build(points + np.array([x, y, 0.0]), triangles, np.zeros((8, 2)), crease_deg=20.0)


def mouse(length: float, width: float, height: float, shell: Material, trim: Material, has_cable: bool) -> Model:
    """A computer mouse that points to -x, away from its user at +x, with wheel and button gap."""
    angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    rings = []
    for tilt in np.radians([0, 8, 22, 38, 54, 68, 79, 86]):
        inset = np.cos(tilt) ** 0.55
        waist = 1.0 - 0.06 * np.cos(2 * angle)
        x = length / 2 * inset * np.cos(angle)
        y = width / 2 * inset * waist * np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** 0.85
        dome = height * np.sin(tilt) ** 0.9 * (1.0 - 0.20 * (x / length * 2 - 0.15) ** 2)
        rings.append(np.column_stack([x, y, dome]))
    body = loft(np.stack(rings), crease_deg=60.0)
    wheel = moved(
        affine(cylinder(0.011, 0.006, segments=16), rotation("x", 90.0)), -length * 0.28, 0.003, height * 0.86 - 0.009
    )
    line = [(-length * 0.43, 0, height * 0.60), (-length * 0.36, 0, height * 0.76), (-length * 0.28, 0, height * 0.86)]
    gap = tube([*line, (-length * 0.16, 0, height * 0.945), (-length * 0.04, 0, height * 0.985)], 0.0011, 5)
    parts = [wheel, gap]
    if has_cable:
        parts.append(
            tube(
                [
                    (-length / 2 + 0.004, 0, 0.012),
                    (-length / 2 - 0.03, 0.002, 0.003),
                    (-length / 2 - 0.09, 0.02, 0.002),
                    (-length / 2 - 0.12, 0.055, 0.002),
                ],
                0.0018,
                6,
            )
        )
    return Part(body, shell), Part(merge(parts), trim)


def laptop(
    width: float, depth: float, angle_deg: float, picture: Texture, case: Material, ground: str, ink: str
) -> Model:
    """An open laptop for a user at +x."""
    thickness, lid = 0.015, 0.007
    base = moved(extrude(rounded_rectangle(depth, width, 0.012, 3), thickness - 0.002, bevel=0.003), z=0.002)
    keys = keyboard(width - 0.03, depth * 0.46, case, ground, ink, has_numbers=False)[1]
    deck = moved(keys.mesh, -depth * 0.18, 0, thickness - 0.0125)
    flat = Mesh(deck.vertices * [1, 1, 0.35] + [0, 0, thickness * 0.65], deck.triangles, deck.normals, deck.uvs)
    pad = board((depth * 0.14, -0.055, thickness - 0.001), (depth * 0.44, 0.055, thickness + 0.0004), 0.0004)
    feet = [
        board((x - 0.008, y - 0.02, 0.0), (x + 0.008, y + 0.02, 0.004), 0.001)
        for x in (-depth * 0.4, depth * 0.4)
        for y in (-width * 0.35, width * 0.35)
    ]
    height = depth * 0.98
    cover = bevelled_box((lid, width, height), (-lid / 2, 0, height / 2), 0.003, 2)
    rim = facing(width - 0.008, height - 0.008, 0.0003, 0.004)
    shown = facing(width - 0.022, height - 0.036, 0.0006, 0.024)
    lean = rotation("y", 90.0 - angle_deg)
    hinge = (-depth / 2 + 0.006, 0.0, thickness - 0.002)
    return (
        Part(merge([base, affine(cover, lean, hinge)]), case),
        Part(merge([affine(rim, lean, hinge), *feet]), materials.paint("#0c0c0e", 0.2)),
        Part(affine(shown, lean, hinge), _glass("laptop screen", picture)),
        Part(flat, keys.material),
        Part(pad, materials.paint("#8d9094", 0.35)),
    )


def phone(length: float, width: float, picture: Texture, case: Material, is_face_up: bool = True) -> Model:
    """A telephone lying on its back or on its face, its top at -x."""
    thickness = 0.0082
    body = extrude(rounded_rectangle(length, width, 0.010, 5), thickness, bevel=0.0025, segments=3)
    front = moved(extrude(rounded_rectangle(length - 0.004, width - 0.004, 0.0085, 5), 0.0003), z=thickness)
    x, y = np.meshgrid(
        [-length / 2 + 0.005, length / 2 - 0.005], [-width / 2 + 0.0035, width / 2 - 0.0035], indexing="ij"
    )
    points = np.stack([x, y, np.full_like(x, thickness + 0.0005)], axis=2)
    shown = grid_surface(points, np.stack([y - y.min(), x.max() - x], axis=2))
    camera = [
        moved(
            extrude(rounded_rectangle(0.028, 0.028, 0.006, 4), 0.0018, bevel=0.0006),
            -length / 2 + 0.022,
            -width / 2 + 0.022,
            -0.0017,
        )
    ]
    lenses = [
        moved(cylinder(0.005, 0.0012, 0.0003, 14), -length / 2 + 0.022 + dx, -width / 2 + 0.022 + dy, -0.0028)
        for dx, dy in ((-0.006, -0.006), (0.006, 0.006))
    ]
    model = (
        Part(merge([body, *camera]), case),
        Part(merge([front, *lenses]), materials.paint("#08080a", 0.08)),
        Part(shown, _glass("phone screen", picture, 0.02)),
    )
    if is_face_up:
        return model
    return transformed(model, rotation("x", 180.0))


def clock_radio(width: float, depth: float, height: float, case: Material) -> Model:
    """A bedside clock with red digits."""
    outline = [(-depth / 2, 0.0), (depth / 2, 0.0), (depth / 2 - 0.012, height), (-depth / 2 + 0.004, height)]
    shell = moved(
        affine(extrude(outline, width, bevel=0.004), np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])), y=width / 2
    )
    lean = rotation("y", -float(np.degrees(np.arctan2(0.012, height))))
    shown = affine(facing(width * 0.86, height * 0.66, 0.0004, height * 0.17), lean, (depth / 2, 0, 0))
    button = board((-0.02, -width * 0.2, height - 0.002), (0.01, width * 0.2, height + 0.004), 0.002)
    digits = screens.led_digits(width * 0.86, height * 0.66)
    return Part(merge([shell, button]), case), Part(shown, _glass("led clock", digits, 0.03))
