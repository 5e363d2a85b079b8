"""Small objects for rooms: an alarm clock, an apple, picture frames, cushions, a basket."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tools.household import materials, textures
from tools.household.meshing import build
from tools.household.model import (
    Material,
    Mesh,
    Model,
    Part,
    Texture,
    bounds,
    fit_to_box,
    merge,
    moved,
    rotated,
    rotation,
    transformed,
)
from tools.household.outlines import catmull_rom
from tools.household.shapes import bevelled_box, ellipsoid, extrude, grid_surface, lathe, tube

if TYPE_CHECKING:
    from collections.abc import Sequence


def alarm_clock(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A twin-bell alarm clock on a round wooden stand; its dial looks to (−x, +y)."""
    width, _, height = extent_m
    stand_height = 0.075 * height
    stand = lathe(
        [
            (0.0, 0.0),
            (0.485 * width, 0.0),
            (0.5 * width, 0.002),
            (0.5 * width, stand_height - 0.003),
            (0.49 * width, stand_height - 0.0006),
            (0.482 * width, stand_height),
            (0.0, stand_height),
        ],
        56,
        crease_deg=50.0,
    )
    clock = _twin_bell_clock(0.385 * (height - stand_height))
    low, high = bounds(clock)
    scale = (height - stand_height) / (high[2] - low[2])
    turned = rotation("z", -135.0) * scale
    wood = Part(build(stand.vertices, stand.triangles, crease_deg=40.0), materials.wood("walnut", seed))
    model = (wood, *transformed(clock, turned, (0.0, 0.0, stand_height - low[2] * scale)))
    return fit_to_box(model, extent_m, may_turn=False)


def _twin_bell_clock(radius: float) -> Model:
    """A clock with a case of this radius about the y axis; its dial looks to −y."""
    thickness, bell_radius = 0.92 * radius, 0.41 * radius
    front = -thickness / 2
    case = _facing(
        [
            (0.0, -front),
            (radius * 0.80, -front),
            (radius * 0.95, -front * 0.8),
            (radius, -front * 0.4),
            (radius, front * 0.75),
            (radius * 0.985, front * 0.95),
            (radius * 0.95, front),
        ]
    )
    bezel = _facing(
        [
            (radius * 0.96, front * 0.97),
            (radius * 0.95, front * 1.04),
            (radius * 0.91, front * 1.04),
            (radius * 0.89, front * 0.98),
            (radius * 0.885, front * 0.86),
        ]
    )
    dial = _disc(radius * 0.887, front * 0.87)
    bell_profile = catmull_rom(
        [
            (bell_radius, 0.0),
            (bell_radius * 0.96, bell_radius * 0.20),
            (bell_radius * 0.74, bell_radius * 0.54),
            (bell_radius * 0.38, bell_radius * 0.76),
            (0.0, bell_radius * 0.84),
        ],
        14,
    )
    bell_profile[-1, 0] = 0.0
    bell = moved(lathe(bell_profile, 32, crease_deg=60.0), z=radius * 1.18)
    under = moved(lathe([(0.0, 0.001), (bell_radius, 0.0)], 32), z=radius * 1.18)
    post = moved(_rod(0.0028, 0.3 * radius), z=radius * 0.92)
    knob = moved(ellipsoid((0.0052, 0.0052, 0.0045), 12, 8), z=radius * 1.19 + bell_radius * 0.84)
    leg_line = [(0.0, 0.0, -radius * 0.94), (0.0, 0.0, -radius * 1.10), (0.0, 0.0, -radius * 1.25)]
    leg = tube(leg_line, [0.0065, 0.0055, 0.0042], 12)
    hammer_top = radius * 1.18 + bell_radius * 0.45
    brass = [bezel, tube([(0.0, 0.0, radius * 0.9), (0.0, 0.0, hammer_top)], 0.0022, 8)]
    brass.append(moved(bevelled_box((0.018, 0.010, 0.012), bevel=0.003, segments=2), z=hammer_top))
    for side in (-1.0, 1.0):
        brass += [rotated(mesh, "y", side * 30.0) for mesh in (bell, under, post, knob)]
        brass.append(rotated(leg, "y", side * 35.0))
    for x, z in ((-0.3, 0.15), (0.3, 0.15), (0.0, -0.35)):
        winder = _facing([(0.0, -front + 0.009), (0.007, -front + 0.009), (0.007, -front - 0.002)])
        brass.append(moved(winder, x=x * radius, z=z * radius))
    face = Material("clock_dial", base_color_texture=textures.clock_dial(2 * radius * 0.887), roughness=0.3)
    return (
        Part(case, materials.paint("#5f8077", 0.25)),
        Part(dial, face),
        Part(merge(brass), materials.brass()),
    )


def apple(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A red apple with dimples, stalk and leaf."""
    width, depth, height = extent_m
    rng = np.random.default_rng(seed)
    body = 0.90 * height / max(width, depth)
    outline = catmull_rom(
        [
            (0.0, 0.13),
            (0.09, 0.045),
            (0.20, 0.0),
            (0.345, 0.09),
            (0.455, 0.30),
            (0.50, 0.56),
            (0.475, 0.78),
            (0.37, 0.93),
            (0.24, 0.985),
            (0.12, 0.93),
            (0.045, 0.86),
            (0.0, 0.82),
        ],
        40,
    )
    outline[[0, -1], 0] = 0.0
    outline[:, 0] = np.maximum(outline[:, 0], 0.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 49)
    lobes = (
        1.0
        + 0.018 * np.cos(5.0 * angle) * (1.0 - outline[:, 1:]) ** 1.5
        + 0.012 * np.cos(2.0 * angle + rng.uniform(0.0, 6.0))
    )
    points = np.stack(
        [
            outline[:, :1] * lobes * np.cos(angle),
            outline[:, :1] * lobes * np.sin(angle),
            outline[:, 1:] * body + 0.0 * angle,
        ],
        axis=2,
    )
    u, v = np.meshgrid(angle / (2.0 * np.pi), np.linspace(0.0, 1.0, len(outline)))
    skin = grid_surface(points[:, ::-1], np.stack([u, v], axis=2)[:, ::-1], crease_deg=80.0)
    stalk = tube(
        catmull_rom([(0.0, 0.0, 0.80 * body), (0.012, 0.004, 0.96 * body), (0.055, 0.015, body * 1.10)], 10),
        np.array([0.017, 0.016, 0.015, 0.0145, 0.014, 0.014, 0.0145, 0.016, 0.019, 0.021]),
        8,
    )
    peel = Material("apple_skin", base_color_texture=textures.apple_skin(seed), roughness=0.3)
    brown = Material("apple_stalk", textures.linear_color("#4a3420"), roughness=0.8)
    return fit_to_box((Part(skin, peel), Part(stalk, brown)), extent_m, may_turn=False)


def picture(extent_m: Sequence[float], seed: int = 0, art: Texture | None = None) -> Model:
    """A framed picture with a mat, hanging in the xz plane and looking to −y; `art` is drawn when none is given."""
    width, thickness, height = extent_m
    frame_width = 0.055 * min(width, height) + 0.006
    back, front = thickness / 2, -thickness / 2
    rails = [_mitred_bar(width, frame_width, thickness, height / 2, turn_deg) for turn_deg in (0.0, 180.0)]
    stiles = [_mitred_bar(height, frame_width, thickness, width / 2, turn_deg) for turn_deg in (90.0, 270.0)]
    frame = moved(rotated(merge([*rails, *stiles]), "x", 90.0), y=back)
    mat_width, mat_height = width - 2 * frame_width, height - 2 * frame_width
    margin = 0.13 * min(mat_width, mat_height)
    art_width, art_height = mat_width - 2 * margin, mat_height - 2 * margin
    image = art or _drawn(art_width, art_height, seed)
    mat = _sheet(mat_width, mat_height, front + 0.45 * thickness)
    print_ = _sheet(art_width, art_height, front + 0.45 * thickness - 0.0008, image)
    wood = materials.wood("walnut" if seed % 2 else "oak")
    card = Material("picture_mat", base_color_texture=textures.paper(seed=seed), roughness=0.9)
    paint = Material("picture_print", base_color_texture=image, roughness=0.55)
    return fit_to_box((Part(frame, wood), Part(mat, card), Part(print_, paint)), extent_m, may_turn=False)


def _mitred_bar(length: float, width: float, thickness: float, reach: float, turn_deg: float) -> Mesh:
    """One side of a frame in the xy plane: its outer edge `reach` from the middle, its grain along it."""
    outline = [
        (-length / 2, -reach),
        (length / 2, -reach),
        (length / 2 - width, -reach + width),
        (width - length / 2, -reach + width),
    ]
    return rotated(extrude(outline, thickness, bevel=0.0012), "z", turn_deg)


def _drawn(width: float, height: float, seed: int) -> Texture:
    """A landscape for a wide frame, a herbarium print or cut paper for a tall one."""
    if width > height:
        return textures.landscape(width, height, seed)
    return (textures.botanical, textures.abstract)[seed % 2](width, height, seed)


def cushion(extent_m: Sequence[float], seed: int = 0, cover: Texture | None = None, count: int = 25) -> Model:
    """A filled cushion lying flat, with pulled-in sides, dented top and a piped seam."""
    rng = np.random.default_rng(seed)
    width, depth, height = extent_m
    a, b = np.meshgrid(np.linspace(-1.0, 1.0, count), np.linspace(-1.0, 1.0, count))
    pull_a, pull_b = 1.0 - 0.07 * (1.0 - b**2) ** 1.0 * np.abs(a) ** 3, 1.0 - 0.07 * (1.0 - a**2) * np.abs(b) ** 3
    x, y = a * pull_a * width / 2, b * pull_b * depth / 2
    puff = ((1.0 - a**4) * (1.0 - b**4)) ** 0.5
    phase = rng.uniform(0.0, 6.0, 4)
    wrinkle = 0.035 * np.sin(5.0 * a + 2.0 * b + phase[0]) + 0.03 * np.sin(3.0 * b - 4.0 * a + phase[1])
    dent = 0.16 * np.exp(-((a - 0.1) ** 2 + (b + 0.1) ** 2) * 3.0)
    upper = height / 2 * puff * (1.0 + wrinkle - dent)
    lower = -height / 2 * puff
    uvs = np.stack([x + width / 2, y + depth / 2], axis=2)
    top = grid_surface(np.stack([x, y, upper], axis=2)[::-1], uvs[::-1])
    bottom = grid_surface(np.stack([x, y, lower], axis=2), uvs)
    edge = [(x[0, k], y[0, k]) for k in range(count - 1)] + [(x[k, -1], y[k, -1]) for k in range(count - 1)]
    edge += [(x[-1, k], y[-1, k]) for k in range(count - 1, 0, -1)] + [
        (x[k, 0], y[k, 0]) for k in range(count - 1, 0, -1)
    ]
    piping = tube(np.column_stack([np.array(edge), np.zeros(len(edge))]), 0.0035, 6, closed=True)
    cloth = Material(
        "cushion_cover", base_color_texture=cover or textures.boucle((0.62, 0.40, 0.28), seed), roughness=0.95
    )
    return fit_to_box((Part(merge([top, bottom, piping]), cloth),), extent_m, may_turn=False)


def basket(extent_m: Sequence[float], seed: int = 0) -> Model:
    """A round basket of woven seagrass."""
    rng = np.random.default_rng(seed)
    width, _, height = extent_m
    radius, rope = width / 2, height / 11.0
    coils = []
    for k in range(11):
        t = k / 10.0
        r = radius * (0.80 + 0.17 * np.sin(np.pi * (0.12 + 0.62 * t))) - rope * 0.5
        angle = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
        wobble = 1.0 + 0.004 * rng.standard_normal(36)
        ring = np.column_stack([r * wobble * np.cos(angle), r * wobble * np.sin(angle), np.full(36, rope * (k + 0.5))])
        coils.append(tube(ring, rope * 0.56, 7, closed=True))
    floor = lathe([(radius * 0.8, rope * 0.5), (0.0, rope * 0.5)], 32)
    straw = Material("seagrass", base_color_texture=textures.boucle((0.70, 0.58, 0.40), seed), roughness=0.9)
    return fit_to_box((Part(merge([*coils, floor]), straw),), extent_m, may_turn=False)


def _facing(profile: Sequence[Sequence[float]]) -> Mesh:
    """A lathe about the y axis: profile of (radius, y), from the back (+y) to the front (−y)."""
    return rotated(lathe([(radius, -y) for radius, y in profile], 56, crease_deg=35.0), "x", 90.0)


def _disc(radius: float, y: float) -> Mesh:
    """A disc that looks to −y, its texture upright."""
    ring = np.linspace(0.0, 2.0 * np.pi, 49)
    distance, angle = np.meshgrid([0.0, radius], ring, indexing="ij")
    x, z = distance * np.cos(angle), distance * np.sin(angle)
    points = np.stack([x, np.full_like(x, y), z], axis=2)
    return grid_surface(points, np.stack([x + radius, z + radius], axis=2))


def _sheet(width: float, height: float, y: float, image: Texture | None = None) -> Mesh:
    """A rectangle that looks to −y; with an image, it shows it once."""
    x, z = np.meshgrid([-width / 2, width / 2], [height / 2, -height / 2])
    scale = (image.width_m / width, image.height_m / height) if image else (1.0, 1.0)
    uvs = np.stack([(x + width / 2) * scale[0], (z + height / 2) * scale[1]], axis=2)
    return grid_surface(np.stack([x, np.full_like(x, y), z], axis=2), uvs)


def _rod(radius: float, length: float) -> Mesh:
    return lathe([(0.0, 0.0), (radius, 0.0), (radius, length), (0.0, length)], 16)
