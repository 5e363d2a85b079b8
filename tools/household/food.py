"""Fruit and cakes, standing on z = 0."""

from __future__ import annotations

import numpy as np

from tools.household import textures
from tools.household.model import (
    Floats,
    Material,
    Mesh,
    Model,
    Part,
    Texture,
    affine,
    merge,
    moved,
    rotation,
    transformed,
)
from tools.household.outlines import catmull_rom
from tools.household.shapes import ellipsoid, grid_surface, lathe, tube
from tools.household.textures import linear_color


def apple(skin: Texture, width: float, height: float, seed: int = 0) -> Model:
    """An apple with a stalk: two dimples, five lobes."""
    rng = np.random.default_rng(seed)
    profile = catmull_rom(
        [
            (0.0, 0.13),
            (0.20, 0.0),
            (0.345, 0.09),
            (0.455, 0.30),
            (0.50, 0.56),
            (0.475, 0.78),
            (0.37, 0.93),
            (0.24, 0.985),
            (0.12, 0.93),
            (0.0, 0.80),
        ],
        24,
    )
    profile[[0, -1], 0] = 0.0
    angle = np.linspace(0.0, 2.0 * np.pi, 33)
    lobes = (
        1.0
        + 0.02 * np.cos(5.0 * angle) * (1.0 - profile[:, 1:]) ** 1.5
        + 0.015 * np.cos(2.0 * angle + rng.uniform(0, 6))
    )
    radius = np.maximum(profile[:, :1], 0.0) * lobes * width
    points = np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), profile[:, 1:] * height * 0.94 + 0 * angle], axis=2
    )
    u, v = np.meshgrid(angle / (2.0 * np.pi), np.linspace(0.0, 1.0, len(profile)))
    body = grid_surface(points[:, ::-1], np.stack([u, v], axis=2)[:, ::-1], crease_deg=80.0)
    lean = rng.uniform(-0.008, 0.008)
    stalk = tube(
        [(0, 0, height * 0.74), (lean * 0.5, 0.001, height * 0.90), (lean, 0.004, height)], [0.0014, 0.0013, 0.002], 6
    )
    return (
        Part(body, Material("apple peel", base_color_texture=skin, roughness=0.32)),
        Part(stalk, Material("apple stalk", linear_color("#4a3420"), roughness=0.8)),
    )


def _banana(length: float, bend_deg: float, radius: float) -> tuple[Mesh, Mesh]:
    """A banana in the plane x-z, bent upwards, its stalk at -x; and its dark tip."""
    share = np.linspace(0, 1, 22)
    turn = np.radians(bend_deg) * (share - 0.5)
    arc = length / np.radians(bend_deg)
    line = np.column_stack([arc * np.sin(turn), np.zeros(22), arc * (1 - np.cos(turn))])
    swell = np.interp(
        share, [0, 0.10, 0.17, 0.30, 0.55, 0.80, 0.93, 0.98, 1.0], [0.36, 0.34, 0.55, 0.92, 1.0, 0.90, 0.52, 0.28, 0.22]
    )
    tangent = np.gradient(line, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.array([0.0, 1.0, 0.0])
    up = np.cross(tangent, side)
    faceted = 1.0 + 0.045 * np.cos(5.0 * np.linspace(0, 2 * np.pi, 17))
    angle = np.linspace(0, 2 * np.pi, 17)
    ring = np.stack([np.cos(angle) * faceted, np.sin(angle) * faceted], axis=1)
    points = line[:, None] + radius * swell[:, None, None] * (
        ring[None, :, :1] * side + ring[None, :, 1:] * up[:, None]
    )
    uvs = np.stack(np.broadcast_arrays(share[:, None], (angle / (2 * np.pi))[None, :]), axis=2)
    peel = grid_surface(points[::-1], uvs[::-1], crease_deg=60.0)
    ends = merge(
        [
            moved(ellipsoid((radius * 0.20,) * 3, 8, 5), *line[-1]),
            moved(ellipsoid((radius * 0.37,) * 3, 8, 5), *line[0]),
        ]
    )
    return peel, ends


def banana(length: float, bend_deg: float, ripeness: float, seed: int = 0) -> Model:
    """A banana lying on its side."""
    peel, ends = _banana(length, bend_deg, length * 0.092)
    model = (
        Part(peel, Material("banana peel", base_color_texture=textures.banana_skin(seed, ripeness), roughness=0.5)),
        Part(ends, Material("banana ends", linear_color("#4a3b22"), roughness=0.8)),
    )
    return transformed(model, rotation("z", 90.0) @ rotation("x", 84.0))


def banana_bunch(count: int, ripeness: float, seed: int = 0) -> Model:
    """Bananas joined at their stalks, standing on their backs' ends in a fan."""
    rng = np.random.default_rng(seed)
    skin = Material("banana peel", base_color_texture=textures.banana_skin(seed, ripeness), roughness=0.5)
    dark = Material("banana ends", linear_color("#4a3b22"), roughness=0.8)
    parts: list[Part] = []
    for index in range(count):
        length = 0.19 * rng.uniform(0.95, 1.05)
        peel, ends = _banana(length, 78.0, 0.0175)
        start = peel.vertices[: len(peel.vertices)].min(axis=0)
        spread = (index - (count - 1) / 2) * 17.0
        # The stalks meet at the origin; each banana arches over and fans out sideways.
        flip = rotation("z", spread) @ rotation("y", 22.0) @ rotation("x", 180.0)
        shift = np.array([-start[0], 0.0, -peel.vertices[peel.vertices[:, 0].argmin(), 2]])
        parts += [
            Part(affine(moved(mesh, *shift), flip, (0.0, 0.006 * (index - count / 2), 0.0)), material)
            for mesh, material in ((peel, skin), (ends, dark))
        ]
    knot = affine(ellipsoid((0.016, 0.022 + 0.004 * count, 0.013), 12, 8), np.eye(3), (0.006, 0.0, 0.0))
    return (*parts, Part(knot, dark))


def orange(diameter: float, flatness: float, code: str, seed: int = 0) -> Model:
    """An orange or mandarin with its calyx."""
    radius = diameter / 2
    height = diameter * flatness
    angle = np.linspace(-np.pi / 2, np.pi / 2, 22)
    profile = np.column_stack([radius * np.cos(angle) ** 0.95, height / 2 * (1 + np.sin(angle))])
    profile[[0, -1], 0] = 0.0
    profile[-1, 1] -= height * 0.03
    body = lathe(profile, 32, crease_deg=80.0)
    star = [
        tube([(0, 0, height * 0.975), (0.005 * np.cos(a), 0.005 * np.sin(a), height * 0.982)], [0.0016, 0.0007], 5)
        for a in np.radians(np.arange(0, 360, 72))
    ]
    peel = Material(
        "orange peel",
        base_color_texture=textures.orange_peel(seed, code),
        normal_texture=textures.orange_peel_normal(seed),
        roughness=0.38,
    )
    return Part(body, peel), Part(merge(star), Material("calyx", linear_color("#5b6b33"), roughness=0.7))


def orange_half(diameter: float, seed: int = 0) -> Model:
    """Half an orange lying on its peel, its face tilted towards +x."""
    radius = diameter / 2
    angle = np.linspace(-np.pi / 2, 0.0, 14)
    profile = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    profile[0, 0] = 0.0
    bowl = lathe(profile, 32, crease_deg=80.0)
    distance, around = np.meshgrid([0.0, radius], np.linspace(0, 2 * np.pi, 33), indexing="ij")
    x, y = distance * np.cos(around), distance * np.sin(around)
    face = grid_surface(np.stack([x, y, 0 * x], axis=2), np.stack([x / diameter + 0.5, y / diameter + 0.5], axis=2))
    peel = Material(
        "orange peel",
        base_color_texture=textures.orange_peel(seed),
        normal_texture=textures.orange_peel_normal(seed),
        roughness=0.38,
    )
    pulp = Material("orange face", base_color_texture=textures.citrus_slice(seed), roughness=0.25)
    return transformed((Part(bowl, peel), Part(face, pulp)), rotation("y", 28.0))


def plate(diameter: float, glaze: Material) -> Part:
    """A dinner plate."""
    r = diameter / 2
    profile = [
        (0, 0.002),
        (r * 0.55, 0.002),
        (r * 0.57, 0.0),
        (r * 0.61, 0.001),
        (r * 0.70, 0.007),
        (r * 0.985, 0.019),
        (r, 0.021),
        (r * 0.985, 0.0225),
        (r * 0.70, 0.0105),
        (r * 0.60, 0.006),
        (0, 0.0055),
    ]
    return Part(lathe(profile, 40, crease_deg=40.0), glaze)


def layer_cake(diameter: float, height: float, icing: str, filling: str, topping: str, glaze: Material) -> Model:
    """A round cake on a plate: iced top that runs down the side, a ring of berries."""
    r, base = diameter / 2, 0.006
    layers = [
        (0, base),
        (r, base),
        (r, base + height * 0.30),
        (r * 1.008, base + height * 0.31),
        (r * 1.008, base + height * 0.37),
        (r, base + height * 0.38),
        (r, base + height * 0.64),
        (r * 1.008, base + height * 0.65),
        (r * 1.008, base + height * 0.71),
        (r, base + height * 0.72),
        (r, base + height * 0.96),
    ]
    sponge = lathe(layers, 40, crease_deg=30.0)
    angle = np.linspace(0, 2 * np.pi, 65)
    drip = height * (0.16 + 0.10 * np.sin(9 * angle) * np.sin(4 * angle + 1.0) + 0.06 * np.cos(13 * angle))
    rows = []
    for radius, z in ((0.0, 1.0), (0.8, 1.004), (0.97, 1.0), (1.02, 0.96)):
        rows.append(
            np.column_stack([r * radius * np.cos(angle), r * radius * np.sin(angle), np.full(65, base + height * z)])
        )
    edge = base + height * 0.96 - np.clip(drip, height * 0.05, None)
    rows.append(np.column_stack([r * 1.028 * np.cos(angle), r * 1.028 * np.sin(angle), edge + height * 0.03]))
    rows.append(np.column_stack([r * 1.002 * np.cos(angle), r * 1.002 * np.sin(angle), edge]))
    frosting = grid_surface(np.stack(rows), crease_deg=60.0)
    berries = [
        moved(
            ellipsoid((0.0105, 0.0105, 0.0095), 12, 8),
            r * 0.78 * np.cos(a),
            r * 0.78 * np.sin(a),
            base + height + 0.008,
        )
        for a in np.linspace(0, 2 * np.pi, 11)[:-1]
    ]
    return (
        plate(diameter * 1.32, glaze),
        Part(sponge, Material("sponge", base_color_texture=textures.crumb(filling), roughness=0.95)),
        Part(frosting, Material("icing", linear_color(icing), roughness=0.35)),
        Part(merge(berries), Material("berries", linear_color(topping), roughness=0.15)),
    )


def cake_slice(length: float, height: float, icing: str, crumb_code: str, cream: str, glaze: Material) -> Model:
    """A slice on a dessert plate, its tip towards +x."""
    half = np.radians(19.0)
    base = 0.006
    angle = np.linspace(-half, half, 9) + np.pi
    arc = length * np.column_stack([np.cos(angle), np.sin(angle)])
    outline = np.concatenate([[[0.0, 0.0]], arc]) + np.array([length * 0.55, 0.0])

    def slab(low: float, high: float, grow: float) -> Mesh:
        middle = outline.mean(axis=0)
        ring = np.concatenate([outline, outline[:1]])
        ring = middle + (ring - middle) * grow
        rows = [
            np.column_stack([0 * ring + middle, np.full(len(ring), low)]),
            np.column_stack([ring, np.full(len(ring), low)]),
        ]
        rows += [
            np.column_stack([ring, np.full(len(ring), high)]),
            np.column_stack([0 * ring + middle, np.full(len(ring), high)]),
        ]
        return grid_surface(np.stack(rows)[:, ::-1], crease_deg=35.0)

    sponge = [slab(base + height * a, base + height * b, 1.0) for a, b in ((0.0, 0.29), (0.36, 0.62), (0.69, 0.92))]
    filling = [slab(base + height * a, base + height * b, 0.985) for a, b in ((0.28, 0.37), (0.61, 0.70))]
    top = slab(base + height * 0.91, base + height, 1.012)
    cherry = moved(ellipsoid((0.010, 0.010, 0.009), 12, 8), -length * 0.22, 0.0, base + height + 0.008)
    return (
        plate(0.19, glaze),
        Part(merge(sponge), Material("sponge", base_color_texture=textures.crumb(crumb_code), roughness=0.95)),
        Part(merge(filling), Material("cream", linear_color(cream), roughness=0.5)),
        Part(top, Material("icing", linear_color(icing), roughness=0.35)),
        Part(cherry, Material("cherry", linear_color("#8f1420"), roughness=0.12)),
    )


def bundt_cake(diameter: float, height: float, glaze: Material) -> Model:
    """A fluted ring cake with sugar icing, on a plate."""
    r, hole, base = diameter / 2, diameter * 0.10, 0.006
    share = np.linspace(0, 2 * np.pi, 25)
    angle = np.linspace(0, 2 * np.pi, 73)
    middle, across = (r + hole) / 2, (r - hole) / 2
    x = middle + across * np.cos(share)
    z = height / 2 * (1 + np.sin(share))
    fluted = 1.0 + 0.055 * np.cos(12 * angle)[None, :] * np.clip((x - hole) / (r - hole), 0, 1)[:, None]
    radius = x[:, None] * fluted

    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), z[:, None] + base + 0 * angle], axis=2)
    body = grid_surface(ring[:, ::-1], crease_deg=60.0)
    icing = _drips(radius, z, angle, base)
    return (
        plate(diameter * 1.30, glaze),
        Part(body, Material("crust", base_color_texture=textures.crumb("#8a5426"), roughness=0.8)),
        Part(icing, Material("sugar icing", linear_color("#f3ede2"), roughness=0.3)),
    )


def _drips(radius: Floats, z: Floats, angle: Floats, base: float) -> Mesh:
    """Icing over the ring's crest that runs down its outside unevenly."""
    share = np.linspace(0, 2 * np.pi, len(z))
    reach = 0.55 + 0.35 * np.sin(7 * angle + 0.7) * np.cos(3 * angle)
    rows = []
    for step in np.linspace(0.0, 1.0, 9):
        at = np.pi / 2 + 0.9 - step * (0.9 + np.clip(reach, 0.15, None))
        ring = np.array([np.interp(a, share, radius[:, k]) for k, a in enumerate(at)])
        level = np.array([np.interp(a, share, z) for a in at])
        puff = 0.004 * np.sin(np.pi * np.clip(step * 1.02, 0.02, 1)) + 0.0012
        rows.append(
            np.column_stack([(ring + puff) * np.cos(angle), (ring + puff) * np.sin(angle), level + base + puff])
        )
    return grid_surface(np.stack(rows), crease_deg=70.0)


def cupcake(icing: str, crumb_code: str) -> Model:
    """A cupcake in its paper case, with a swirl of cream and a cherry."""
    angle = np.linspace(0, 2 * np.pi, 61)
    fluted = 1.0 + 0.035 * np.cos(20 * angle)
    rows = [
        np.column_stack([r * fluted * np.cos(angle), r * fluted * np.sin(angle), np.full(61, h)])
        for r, h in ((0.024, 0.0), (0.0335, 0.042))
    ]
    centre = np.zeros((1, 61, 3))
    case = grid_surface(np.concatenate([centre, np.stack(rows)])[:, ::-1], crease_deg=30.0)
    dome = lathe([(0.033, 0.040), (0.037, 0.046), (0.034, 0.055), (0.02, 0.060), (0, 0.061)], 28)
    turns = np.linspace(0, 1, 60)
    swirl = np.column_stack(
        [
            (0.023 * (1 - turns) ** 0.8) * np.cos(turns * 19),
            (0.023 * (1 - turns) ** 0.8) * np.sin(turns * 19),
            0.060 + 0.034 * turns,
        ]
    )
    cream = tube(swirl, 0.0105 * (1 - 0.55 * turns), 8)
    cherry = moved(ellipsoid((0.009, 0.009, 0.0085), 12, 8), z=0.103)
    return (
        Part(case, Material("paper case", linear_color("#e9dfc9"), roughness=0.9, double_sided=True)),
        Part(dome, Material("sponge", base_color_texture=textures.crumb(crumb_code), roughness=0.95)),
        Part(cream, Material("cream", linear_color(icing), roughness=0.4)),
        Part(cherry, Material("cherry", linear_color("#9a1622"), roughness=0.12)),
    )
