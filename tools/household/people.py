"""People, clothed, in poses. Those are of an adult of 1.74 m; `scale` does the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tools.household import textures
from tools.household.implicit import Field, ball, cut, limb, smooth_union, surface, without
from tools.household.model import Floats, Material, Mesh, Model, Part, affine, merge, moved, rotated
from tools.household.poses import Pose
from tools.household.shapes import bevelled_box, ellipsoid, tube
from tools.household.textures import linear_color

SIDES = (-1.0, 1.0)
ARM, LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")
HIP_RADIUS_M = 0.078
# How far a pullover stands off the hips, over what is worn below, and how far that reaches up under it.
OVER_TROUSERS_M, UNDER_HEM_M = 0.022, 0.02


@dataclass(frozen=True)
class Looks:
    """The features that distinguish one person from another; colours are web colours."""

    scale: float
    is_woman: bool
    skin: str
    hair: str
    long_hair: bool
    top: Material
    bottom: Material
    shoes: str
    skirt: bool = False
    eyes: str = "#4a3423"


def person(pose: Pose, looks: Looks) -> Model:
    """A whole person, of some 4,200 triangles."""
    neck = np.array([pose.spine[-1][0], 0.0, pose.spine[-1][1]])
    skin = Material("skin", linear_color(looks.skin), roughness=0.52)
    parts = [
        *_head(neck, looks, skin),
        Part(merge([_hand(pose, side) for side in SIDES]), skin),
        Part(_top(pose, looks), looks.top),
        Part(merge([_shoe(pose, side) for side in SIDES]), Material("shoes", linear_color(looks.shoes), roughness=0.4)),
    ]
    if pose.phones:
        parts.append(Part(_telephone(pose), Material("telephone", linear_color("#1b1c1e"), roughness=0.3)))
    if looks.skirt:
        tights = Material("tights", linear_color("#2b2a30"), roughness=0.7)
        parts += [Part(_skirt(pose), looks.bottom), Part(_legs(pose, looks, 0.0, 0.034), tights)]
    else:
        parts.append(Part(_legs(pose, looks, 0.015, 0.031), looks.bottom))
    return tuple(Part(affine(part.mesh, np.eye(3) * looks.scale), part.material) for part in parts)


def _torso(pose: Pose, looks: Looks, grow: float) -> list[Field]:
    (px, pz), (wx, wz), (cx, cz), (nx, nz) = pose.spine
    woman = looks.is_woman
    waist = (0.088, 0.122, 0.15) if woman else (0.103, 0.142, 0.16)
    fields = [
        ball((px, 0, pz), np.array((0.112, 0.168 if woman else 0.160, 0.12)) + grow),
        ball((wx, 0, wz), np.array(waist) + grow),
        ball((cx, 0, cz), np.array((0.105, 0.150, 0.175) if woman else (0.118, 0.168, 0.185)) + grow),
        *(
            limb((nx + 0.004, 0, nz - 0.062), (nx + 0.004, side * 0.128, nz - 0.094), 0.044 + grow, 0.040 + grow)
            for side in SIDES
        ),
        limb((nx, 0, nz - 0.06), (nx + 0.005, 0, nz + 0.02), 0.070 + grow, 0.056 + grow),
    ]
    if woman:
        fields += [
            ball((cx + 0.066, side * 0.070, cz + 0.005), np.array((0.056, 0.058, 0.062)) + grow) for side in SIDES
        ]
    return fields


def _top(pose: Pose, looks: Looks) -> Mesh:
    """A pullover to the hips, with sleeves to the wrists and folds where joints bend."""
    slim = 0.90 if looks.is_woman else 1.0
    fields, sleeves = _torso(pose, looks, 0.012), []
    for side in SIDES:
        shoulder, elbow, wrist = (pose.joint(name, side) for name in ARM)
        fields.append(limb(shoulder, elbow, 0.060 * slim, 0.050 * slim))
        hip, knee = pose.joint("hip", side), pose.joint("knee", side)
        fields.append(limb(hip, hip + 0.2 * (knee - hip), *[HIP_RADIUS_M + OVER_TROUSERS_M] * 2))
        sleeves.append(_sleeve(elbow, wrist, slim))
    hem = pose.spine[0][1] - pose.hem
    neck = np.array([pose.spine[-1][0], 0.0, pose.spine[-1][1] - 0.004])
    collar = np.array([0.42, 0.0, 0.907])

    def trimmed(points: Floats) -> Floats:
        return np.asarray(np.maximum(hem - points[:, 2], (points - neck) @ collar))

    joints = [pose.joint(name, side) for name in ("shoulder", "elbow") for side in SIDES]
    low, high = _box([*joints, [-0.1, 0, hem], neck], 0.19)
    body = _folded(smooth_union(fields, 0.032), 0.0045, 34.0, seed=1)
    return merge([surface(cut(body, trimmed), low, high, 0.0295, 640), *sleeves])


def _sleeve(elbow: Floats, wrist: Floats, slim: float) -> Mesh:
    """The lower half of a sleeve, a mesh of its own: one that hangs beside the hips would grow together with them."""
    way = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    low, high = _box([elbow, wrist], 0.08)
    lower = _folded(limb(elbow, wrist, 0.050 * slim, 0.038 * slim), 0.0045, 34.0, seed=1)
    return surface(cut(lower, lambda points: np.asarray((points - wrist) @ way + 0.012)), low, high, 0.0295, 90)


def _folded(field: Field, depth_m: float, frequency: float, seed: int) -> Field:
    """Cloth that lies in soft creases."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(0.0, 1.0, (5, 3)) * [0.55, 0.45, 1.0] * frequency
    phases = rng.uniform(0.0, 6.0, 5)

    def folded(points: Floats) -> Floats:
        crease = sum(np.sin(points @ wave + phase) for wave, phase in zip(waves, phases, strict=True))
        return np.asarray(field(points) - depth_m * 0.45 * crease)

    return folded


def _legs(pose: Pose, looks: Looks, grow: float, cell_m: float) -> Mesh:
    px, pz = pose.spine[0]
    fields = [ball((px, 0, pz), np.array((0.108, 0.165 if looks.is_woman else 0.158, 0.11)) + grow * 0.6)]
    for side in SIDES:
        hip, knee, ankle = (pose.joint(name, side) for name in LEG)
        calf = knee + (ankle - knee) * 0.28 + np.array([-0.014, 0, 0])
        fields.append(limb(hip, knee, HIP_RADIUS_M + grow * 0.5, 0.056 + grow * 0.8))
        fields.append(limb(knee, calf, 0.055 + grow * 0.8, 0.052 + grow))
        fields.append(limb(calf, ankle, 0.052 + grow, 0.034 + grow * 1.5))
    body = smooth_union(fields, 0.035)
    if grow:
        body = _folded(body, 0.0055, 30.0, seed=2)
    top = pose.knee[2] + 0.16 if looks.skirt else pz + (0.085 if pose.hem < 0.0 else UNDER_HEM_M - pose.hem)

    def trimmed(points: Floats) -> Floats:
        return np.asarray(np.maximum(0.055 - points[:, 2], points[:, 2] - top))

    low, high = _box(
        [
            *(pose.joint(name, side) for name in LEG for side in SIDES),
            [px, 0, top],
            [px, 0, 0.05],
        ],
        0.20,
    )
    return surface(cut(body, trimmed), low, high, cell_m, 360 if looks.skirt else 700)


def _skirt(pose: Pose) -> Mesh:
    """A flared skirt to the knees."""
    px, pz = pose.spine[0]
    top, hem = pz + 0.10, pose.knee[2] + 0.04

    def cone(points: Floats) -> Floats:
        share = np.clip((top - points[:, 2]) / (top - hem), 0.0, 1.0)
        x, y = points[:, 0] - px, points[:, 1]
        angle = np.arctan2(y, x)
        swing = 0.016 * share**1.3 * np.sin(8.0 * angle + 0.6 * np.sin(3.0 * angle))
        radius = 0.098 + 0.075 * np.minimum(share * 2.2, 1.0) + 0.05 * share + swing
        return np.asarray(np.hypot(x, y * 0.80) - radius)

    def ends(points: Floats) -> Floats:
        return np.asarray(np.maximum(points[:, 2] - pz + pose.hem - UNDER_HEM_M, hem - points[:, 2]))

    return surface(cut(cone, ends), (px - 0.27, -0.33, hem), (px + 0.27, 0.33, top), 0.036, 520)


def _palm(pose: Pose, side: float) -> Floats:
    """The axes of a hand, as rows: along its fingers, across to the thumb, out of the palm."""
    along = pose.joint("fingers", side)
    along = along / np.linalg.norm(along)
    palm = pose.joint("palm", side)
    palm = palm - (palm @ along) * along
    palm = palm / np.linalg.norm(palm)
    # The thumb's side: forwards for hanging hands, inwards for resting ones.
    return np.stack([along, np.cross(palm, along) * side, palm])


def _telephone(pose: Pose) -> Mesh:
    """A telephone in the right hand."""
    frame = _palm(pose, -1.0)
    held = bevelled_box((0.145, 0.071, 0.009), (0.105, 0.004, 0.030), 0.003)
    matrix = frame.T if np.linalg.det(frame) > 0 else frame.T @ np.diag([1.0, -1.0, 1.0])
    return affine(held, matrix, pose.joint("wrist", -1.0))


def _hand(pose: Pose, side: float) -> Mesh:
    """A relaxed hand: palm, four bent fingers, a thumb."""
    wrist, frame = pose.joint("wrist", side), _palm(pose, side)
    along, across, palm = frame

    def at(length: float, width: float, depth: float = 0.0) -> Floats:
        return np.asarray(wrist + along * length + across * width + palm * depth)

    fields = [limb(at(-0.05, 0), at(0.01, 0), 0.030, 0.027), ball(at(0.052, 0.0), (0.056, 0.041, 0.019), frame)]
    for width, length in ((0.028, 0.072), (0.010, 0.080), (-0.009, 0.075), (-0.027, 0.060)):
        knuckle, middle = at(0.088 - abs(width - 0.005) * 0.3, width), at(0.088 + length * 0.52, width * 1.05, 0.010)
        fields.append(limb(knuckle, middle, 0.0105, 0.0095))
        fields.append(limb(middle, at(0.088 + length * 0.95, width * 1.02, 0.032), 0.0095, 0.0075))
    fields.append(limb(at(0.025, 0.030, 0.008), at(0.060, 0.052, 0.018), 0.014, 0.0115))
    fields.append(limb(at(0.060, 0.052, 0.018), at(0.092, 0.056, 0.026), 0.0115, 0.0085))
    low, high = _box([at(-0.05, 0), at(0.17, 0.05), at(0.17, -0.04)], 0.05)
    return surface(smooth_union(fields, 0.008), low, high, 0.0105, 240)


def _shoe(pose: Pose, side: float) -> Mesh:
    x, y, z = pose.joint("ankle", side)
    upper = smooth_union(
        [
            limb((x - 0.030, y, 0.045), (x + 0.10, y + side * 0.012, 0.036), 0.042, 0.040),
            ball((x + 0.155, y + side * 0.016, 0.030), (0.058, 0.044, 0.032)),
            limb((x, y, 0.055), (x - 0.004, y, 0.095), 0.046, 0.044),
            ball((x + 0.06, y + side * 0.010, 0.008), (0.148, 0.044, 0.016)),
        ],
        0.03,
    )

    def sole(points: Floats) -> Floats:
        return np.asarray(np.maximum(-points[:, 2], points[:, 2] - 0.105))

    made = surface(cut(upper, sole), (x - 0.11, y - 0.09, 0.0), (x + 0.25, y + 0.09, 0.12), 0.017, 160)
    pitch_deg = pose.joint("pitch", side)[0]
    if not pitch_deg:
        return made
    # The heel comes off the floor about the ball of the foot, and the ankle stays in the trouser leg.
    turned = rotated(moved(made, -x, 0.0, -0.085), "y", pitch_deg)
    return moved(turned, x, 0.0, z)


def _head(neck: Floats, looks: Looks, skin: Material) -> list[Part]:
    """Head, eyes, brows, lips and hair; `neck` is the root of the neck."""
    base = neck + np.array([0.025, 0.0, 0.033])
    slim = 0.94 if looks.is_woman else 1.0

    def at(x: float, y: float, z: float) -> Floats:
        return np.asarray(base + np.array([x, y * slim, z]))

    skull = smooth_union(
        [
            ball(at(-0.012, 0, 0.128), (0.097, 0.077, 0.100)),
            ball(at(0.030, 0, 0.070), np.array((0.062, 0.056, 0.072))),
            ball(at(0.066, 0, 0.022), (0.024, 0.026, 0.020)),
            *(ball(at(0.052, side * 0.040, 0.086), (0.026, 0.022, 0.026)) for side in SIDES),
            *(limb(at(0.072, side * 0.014, 0.134), at(0.062, side * 0.046, 0.136), 0.013, 0.010) for side in SIDES),
        ],
        0.024,
    )
    skull = without(
        skull,
        smooth_union([ball(at(0.096, side * 0.033, 0.116), (0.017, 0.019, 0.012)) for side in SIDES], 0.001),
        0.014,
    )
    nose = smooth_union(
        [
            limb(at(0.083, 0, 0.122), at(0.103, 0, 0.090), 0.0085, 0.0115),
            *(ball(at(0.093, side * 0.0125, 0.085), (0.011, 0.009, 0.008)) for side in SIDES),
        ],
        0.012,
    )
    lids = [ball(at(0.0735, side * 0.0325, 0.1165), (0.0165, 0.0175, 0.0125)) for side in SIDES]
    mouth = limb(at(0.086, 0, 0.057), at(0.088, 0, 0.048), 0.014, 0.014, flat=1.5)
    body = smooth_union([skull, nose, *lids, mouth], 0.009)
    throat = smooth_union([limb(at(-0.037, 0, -0.083), at(-0.012, 0, 0.05), 0.056 * slim, 0.051 * slim), body], 0.018)
    low, high = base - np.array([0.13, 0.10, 0.09]), base + np.array([0.14, 0.10, 0.25])
    face = surface(throat, tuple(low), tuple(high), 0.0095, 1080)
    ears = [
        moved(rotated(ellipsoid((0.017, 0.010, 0.030), 8, 5), "y", 12.0), *at(-0.008, side * 0.074, 0.104))
        for side in SIDES
    ]
    eyes = [
        _facing(ellipsoid((0.0042, 0.0125, 0.0052), 8, 4), at(0.0872, side * 0.0325, 0.1165), side) for side in SIDES
    ]
    irises = [
        _facing(ellipsoid((0.0036, 0.0049, 0.0049), 8, 3), at(0.0888, side * 0.0325, 0.1166), side) for side in SIDES
    ]
    red, green, blue = linear_color(looks.skin)
    hair = Material("hair", base_color_texture=textures.hair(looks.hair), roughness=0.55)
    brows = [
        tube(
            [at(0.0885, side * 0.015, 0.1325), at(0.0865, side * 0.032, 0.1375), at(0.076, side * 0.050, 0.1345)],
            [0.0030, 0.0040, 0.0022],
            6,
        )
        for side in SIDES
    ]
    lips = [
        moved(ellipsoid(radii, 10, 4), *at(*place))
        for radii, place in (
            ((0.006, 0.0215, 0.0044), (0.0965, 0, 0.0570)),
            ((0.0065, 0.0180, 0.0055), (0.0955, 0, 0.0490)),
        )
    ]
    return [
        Part(merge([face, *ears]), skin),
        Part(merge(eyes), Material("eye", linear_color("#e9e4dc"), roughness=0.15)),
        Part(merge(irises), Material("iris", linear_color(looks.eyes), roughness=0.1)),
        Part(merge(brows), hair),
        Part(merge(lips), Material("lips", (red * 0.78, green * 0.52, blue * 0.52), roughness=0.4)),
        Part(_hair(base, slim, looks), hair),
    ]


def _facing(mesh: Mesh, place: Floats, side: float) -> Mesh:
    """Part of an eye, turned a little outwards as the face is round."""
    return moved(rotated(mesh, "z", side * 14.0), *place)


def _hair(base: Floats, slim: float, looks: Looks) -> Mesh:
    """Hair over the skull behind the hairline; long hair falls to the shoulders."""

    def at(x: float, y: float, z: float) -> Floats:
        return np.asarray(base + np.array([x, y * slim, z]))

    cap = ball(at(-0.016, 0, 0.134), (0.106, 0.087, 0.108))
    fields = [cap]
    if looks.long_hair:
        fields += [
            limb(at(-0.045, side * 0.060, 0.12), at(-0.055, side * 0.075, -0.07), 0.045, 0.030) for side in SIDES
        ]
        fields.append(limb(at(-0.075, 0, 0.12), at(-0.080, 0, -0.08), 0.058, 0.040, flat=1.4))
    body = _strands(smooth_union(fields, 0.035))

    def behind_hairline(points: Floats) -> Floats:
        local = points - base
        line = 0.062 - 0.30 * np.abs(local[:, 1]) ** 1.2 * 3.0
        low = 0.150 if not looks.long_hair else 0.156
        front = np.where(
            local[:, 2] > low,
            local[:, 0] - line - 0.9 * (local[:, 2] - low),
            local[:, 0] - (-0.012 if not looks.long_hair else 0.004),
        )
        nape = 0.045 - local[:, 2] if not looks.long_hair else -1.0 - 0 * local[:, 2]
        return np.asarray(np.maximum(front, nape))

    return surface(
        cut(body, behind_hairline),
        tuple(base - np.array([0.16, 0.13, 0.13])),
        tuple(base + np.array([0.10, 0.13, 0.26])),
        0.022 if looks.long_hair else 0.0185,
        380,
    )


def _strands(field: Field) -> Field:
    def combed(points: Floats) -> Floats:
        angle = np.arctan2(points[:, 1], points[:, 0] + 0.02)
        return np.asarray(
            field(points) + 0.0016 * np.sin(31.0 * angle + 40.0 * points[:, 2]) + 0.0012 * np.sin(17.0 * angle)
        )

    return combed


def _box(points: Sequence[Floats | Sequence[float]], margin: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    corners = np.array([np.asarray(point, float) for point in points])
    return tuple(corners.min(axis=0) - margin), tuple(corners.max(axis=0) + margin)
