"""Rug, curtains, radiator and floor lamp."""

from __future__ import annotations

import numpy as np

from tools.household import materials
from tools.household.joinery import board, grain_upright
from tools.household.model import Material, Mesh, Model, Part, merge, moved, rotated
from tools.household.outlines import rectangle
from tools.household.shapes import cylinder, ellipsoid, extrude, grid_surface, lathe, tube


def rug(width: float, depth: float, pile: Material, strand_gap_m: float = 0.022) -> Model:
    """A flat rug, 8 mm thick, centred, with fringes at both short ends; lies on z = 0."""
    plate = extrude(rectangle(width, depth), 0.008, bevel=0.003)
    plate = Mesh(plate.vertices, plate.triangles, plate.normals, plate.vertices[:, :2] + [width / 2, depth / 2])
    rng = np.random.default_rng(3)
    strands = []
    for side in (-1, 1):
        for y in np.arange(-depth / 2 + 0.012, depth / 2 - 0.008, strand_gap_m):
            x, bend = side * width / 2, rng.normal(0, 0.006)
            line = [
                (x - side * 0.004, y, 0.005),
                (x + side * 0.02, y + bend, 0.004),
                (x + side * 0.055, y + 2 * bend, 0.0035),
            ]
            strands.append(tube(line, [0.0024, 0.0028, 0.0034], 4))
    return Part(plate, pile), Part(merge(strands), materials.paint("#d8cdb8", 0.95))


def curtain(
    width: float, low: float, high: float, folds: int, cloth: Material, seed: int = 0, is_lined: bool = True
) -> Model:
    """A gathered curtain along x, centred, hanging from `high` to `low`, in soft pencil pleats."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0, 1, folds * 10 + 1)
    rows = np.linspace(0, 1, 14)
    wander = np.cumsum(rng.normal(0, 0.05, len(s)))
    wander -= np.linspace(wander[0], wander[-1], len(s))
    phase = 2 * np.pi * folds * s + wander
    spread = 1 - 0.05 * np.sin(np.pi * rows)[:, None]
    amplitude = (0.020 + 0.016 * rows)[:, None]
    x = (s - 0.5) * width * spread + 0.010 * np.sin(2 * phase) * rows[:, None]
    y = amplitude * np.sin(phase + 0.4 * np.sin(3 * rows)[:, None]) + 0.004 * np.sin(0.5 * phase)
    z = np.broadcast_to((high + (low - high) * rows)[:, None], x.shape)
    length = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x[-1]), np.diff(y[-1])))])
    uvs = np.stack(np.broadcast_arrays(length[None, :], z), axis=2)
    points = np.stack([x, y, z], axis=2)
    back = points - [0, 0.0025, 0]
    sheet = grid_surface(points[::-1], uvs[::-1], crease_deg=80.0)
    if not is_lined:
        return (Part(sheet, cloth),)
    lining = grid_surface(back, uvs, crease_deg=80.0)
    return (Part(merge([sheet, lining]), cloth),)


def curtain_rod(length: float, reach: float, metal: Material) -> Model:
    """A rod along x in front of the wall at y = 0 (room at +y), centred, at z = 0, with end knobs and brackets."""
    parts: list[Mesh] = [tube([(-length / 2, reach, 0), (length / 2, reach, 0)], 0.010, 12)]
    for side in (-1, 1):
        parts.append(moved(ellipsoid((0.024, 0.024, 0.024), 16, 10), side * (length / 2 + 0.015), reach, 0))
        x = side * (length / 2 - 0.10)
        parts.append(tube([(x, 0.0, 0), (x, reach, 0)], 0.007, 10))
        parts.append(moved(rotated(cylinder(0.022, 0.008), "x", -90.0), x, 0, 0))
    return (Part(merge(parts), metal),)


def radiator(length: float, height: float, white: Material, metal: Material, samples: int = 10) -> Model:
    """A panel radiator along x, centred; its back at y = 0.03 before the wall at y = 0, feet of pipe to the floor."""
    bottom, ribs = 0.13, round(length / 0.062)
    u = np.linspace(-length / 2, length / 2, ribs * samples + 1)
    wave = 0.007 * np.clip(0.9 - 1.9 * np.cos(2 * np.pi * np.arange(len(u)) / samples), 0, 1)
    rows = np.array([0.0, 0.05, 0.075, 0.925, 0.95, 1.0]) * height + bottom
    relief = np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])[:, None] * wave[None, :]
    front = np.stack(np.broadcast_arrays(u[None, :], 0.0925 + relief, rows[:, None]), axis=2)
    panel = grid_surface(front[:, ::-1], crease_deg=50.0)
    shell = board((-length / 2, 0.03, bottom), (length / 2, 0.0925, bottom + height), 0.004)
    grille = [
        board((x - 0.003, 0.038, bottom + height), (x + 0.003, 0.088, bottom + height + 0.004), 0.001)
        for x in np.arange(-length / 2 + 0.02, length / 2 - 0.01, 0.022)
    ]
    pipes = [
        tube([(x, 0.06, 0.0), (x, 0.06, bottom + 0.02)], 0.008, 10) for x in (-length / 2 + 0.04, length / 2 - 0.04)
    ]
    pipes += [
        board((x - 0.02, 0.0, bottom + height * 0.6), (x + 0.02, 0.032, bottom + height * 0.8), 0.002)
        for x in (-length / 3, length / 3)
    ]
    valve = moved(
        rotated(lathe([(0, 0), (0.016, 0), (0.018, 0.02), (0.017, 0.05), (0.013, 0.06), (0, 0.06)], 18), "y", 90.0),
        length / 2 - 0.002,
        0.06,
        bottom + 0.04,
    )
    return Part(merge([panel, shell, *grille, valve]), white), Part(merge(pipes), metal)


def floor_lamp(height: float, metal: Material, shade: Material) -> Model:
    """A floor lamp with a linen drum shade, centred, standing on z = 0."""
    base = lathe([(0, 0), (0.135, 0), (0.14, 0.006), (0.135, 0.016), (0.03, 0.022), (0.012, 0.03), (0.011, 0.05)], 36)
    pole = tube([(0, 0, 0.03), (0, 0, height - 0.12)], 0.0095, 12)
    low, high = height - 0.30, height
    outer = [(0.20, low), (0.165, high)]
    drum = merge(
        [
            lathe(outer, 40),
            lathe([(r - 0.004, z) for r, z in outer[::-1]], 40),
            lathe([(0.196, low), (0.20, low)][::1], 40),
            lathe([(0.165, high), (0.161, high)], 40),
        ]
    )
    spider = [
        tube([(0, 0, high - 0.03), (0.162 * np.cos(a), 0.162 * np.sin(a), high - 0.012)], 0.002, 6)
        for a in (0, 2.094, 4.189)
    ]
    hub = tube([(0, 0, height - 0.14), (0, 0, high - 0.02)], 0.004, 8)
    bulb = moved(ellipsoid((0.03, 0.03, 0.042), 16, 10), z=height - 0.16)
    return (
        Part(merge([base, pole, hub, *spider]), metal),
        Part(drum, shade),
        Part(bulb, materials.paint("#f4f0e6", 0.3)),
    )


def towel(x: float, rail_z: float, rail_y: float, width: float, drop: float) -> Mesh:
    """A towel folded over a rail along x, its longer side in front (towards -y)."""
    radius, across = 0.009, np.linspace(-width / 2, width / 2, 25)
    over = np.linspace(0, np.pi, 9)
    front = np.linspace(-drop, 0.0, 10)[:-1]
    back = np.linspace(0.0, -drop * 0.8, 8)[1:]
    y = np.concatenate([np.full(9, -radius), -radius * np.cos(over), np.full(7, radius)])
    z = np.concatenate([front, radius * np.sin(over), back])
    hang = np.clip(-z / drop, 0, 1)[:, None]
    wave = 0.010 * hang * (np.sin(across * 31.0 + 0.7) + 0.5 * np.sin(across * 67.0))[None, :]
    narrow = 1 - 0.05 * hang
    outer = np.sign(y)[:, None]
    points = np.stack(
        np.broadcast_arrays(
            x + across[None, :] * narrow, rail_y + y[:, None] + outer * (0.004 * hang) + wave, rail_z + z[:, None]
        ),
        axis=2,
    )
    inner = points.copy()
    inner[..., 1] -= outer * 0.003
    inner[..., 2] -= 0.003 * (np.abs(y)[:, None] < radius * 0.99)
    along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))])
    uvs = np.stack(np.meshgrid(across, along), axis=2)
    return merge([grid_surface(points[:, ::-1], uvs[:, ::-1], crease_deg=80), grid_surface(inner, uvs, crease_deg=80)])


def canister(radius: float, height: float, glaze: Material, lid: Material) -> Model:
    """A storage jar with a turned wooden lid, standing on z = 0."""
    body, rim = height * 0.82, radius * 0.97
    wall = [(0, 0), (radius * 0.93, 0), (radius, 0.008), (radius, body - 0.006), (rim, body), (0, body)]
    cover = [
        (0, body),
        (radius * 0.99, body),
        (radius, body + 0.004),
        (radius * 0.98, body + 0.012),
        (0.012, body + 0.014),
    ]
    grip = [(0.009, height - 0.016), (0.014, height - 0.006), (0.010, height), (0, height)]
    return Part(lathe(wall, 32), glaze), Part(grain_upright(lathe(cover + grip, 32)), lid)
