"""The geometry toolkit: shapes in metres, z up, with smooth normals and texture coordinates in metres.

Outlines and profiles are (K, 2) sequences. Wood grain and weave run along u: a swept or boxed part has its
length along u when `grain` names its long axis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tools.household.meshing import build
from tools.household.model import Floats, Ints, Mesh, affine, merge
from tools.household.outlines import Points, circle, inward_directions, signed_area, triangulate


def grid_surface(
    points: Floats,
    uvs: Floats | None = None,
    close_rows: bool = False,
    close_columns: bool = False,
    crease_deg: float = 60.0,
) -> Mesh:
    """A surface through a (R, C, 3) grid of points; its front faces rows x columns (right-hand rule).

    `close_rows` joins the last row to the first, `close_columns` the last column to the first. Without `uvs`
    (R, C, 2) u is the length along the columns and v along the rows, in metres.
    """
    if close_rows:
        points = np.concatenate([points, points[:1]], axis=0)
    if close_columns:
        points = np.concatenate([points, points[:, :1]], axis=1)
    rows, columns = points.shape[:2]
    if uvs is None:
        along_columns = np.linalg.norm(np.diff(points, axis=1), axis=2).max(axis=0)
        along_rows = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1)
        u, v = np.concatenate([[0], np.cumsum(along_columns)]), np.concatenate([[0], np.cumsum(along_rows)])
        uvs = np.stack(np.meshgrid(u, v), axis=2)
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2).reshape(-1, 3)
    return build(points.reshape(-1, 3), triangles.astype(np.int32), uvs.reshape(-1, 2), crease_deg)


def height_field(
    width_m: float,
    depth_m: float,
    height: Callable[[Floats, Floats], Floats],
    columns: int = 32,
    rows: int = 32,
) -> Mesh:
    """The surface z = height(x, y) over a centred rectangle, facing up."""
    x, y = np.meshgrid(np.linspace(-width_m / 2, width_m / 2, columns), np.linspace(-depth_m / 2, depth_m / 2, rows))
    points = np.stack([x, y, height(x, y)], axis=2)
    return grid_surface(points[:, ::-1], np.stack([x, y], axis=2)[:, ::-1])


def bevelled_box(
    size: Sequence[float],
    center: Sequence[float] = (0.0, 0.0, 0.0),
    bevel: float = 0.004,
    segments: int = 1,
    grain: str = "x",
) -> Mesh:
    """A box with rounded edges of radius `bevel`; 12 (2 segments + 1)^2 triangles."""
    half, middle = np.asarray(size, float) / 2, np.asarray(center, float)
    bevel = min(bevel, float(half.min()) * 0.999)
    angles = np.tan(np.radians(np.linspace(0.0, 45.0, segments + 1)))
    steps = np.concatenate([-angles[::-1], angles])
    signs = np.concatenate([-np.ones(segments + 1), np.ones(segments + 1)])
    b, a = np.meshgrid(steps, steps)
    sign_b, sign_a = np.meshgrid(signs, signs)
    positions: list[Floats] = []
    normals: list[Floats] = []
    uvs: list[Floats] = []
    triangles: list[Ints] = []
    count = len(steps)
    index = np.arange(count * count).reshape(count, count)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    along = "xyz".index(grain)
    for axis in range(3):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        for side in (1.0, -1.0):
            direction, inner = np.empty((count, count, 3)), np.empty((count, count, 3))
            direction[..., axis], inner[..., axis] = side, side * (half[axis] - bevel)
            direction[..., first], inner[..., first] = a, sign_a * (half[first] - bevel)
            direction[..., second], inner[..., second] = b, sign_b * (half[second] - bevel)
            direction /= np.linalg.norm(direction, axis=2, keepdims=True)
            point = (inner + bevel * direction).reshape(-1, 3) + middle
            u_axis = along if axis != along else first
            positions.append(point)
            normals.append(direction.reshape(-1, 3))
            uvs.append(point[:, [u_axis, 3 - axis - u_axis]])
            offset = len(triangles) * count * count
            triangles.append((faces if side > 0 else faces[:, ::-1]) + offset)
    return Mesh(
        np.concatenate(positions),
        np.concatenate(triangles).astype(np.int32),
        np.concatenate(normals),
        np.concatenate(uvs),
    )


def lathe(
    profile: Points,
    segments: int = 24,
    crease_deg: float = 40.0,
    start_deg: float = 0.0,
    end_deg: float = 360.0,
) -> Mesh:
    """Revolve a profile of (radius, z) points about the z axis; list it from bottom to top for an outer wall.

    A profile that ends at radius 0 is closed there. u runs around, v along the profile, in metres.
    """
    curve = np.asarray(profile, float)
    angles = np.radians(np.linspace(start_deg, end_deg, segments + 1))
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    radius, z = curve[:, :1], curve[:, 1:]
    points = np.stack([radius * np.cos(angles), radius * np.sin(angles), z + 0 * angles], axis=2)
    u = angles * max(float(curve[:, 0].max()), 1e-6)
    uvs = np.stack(np.meshgrid(u, lengths), axis=2)
    return grid_surface(points[:, ::-1], uvs[:, ::-1], crease_deg=crease_deg)


def loft(rings: Floats, crease_deg: float = 50.0, grain: str = "x") -> Mesh:
    """A closed body through (R, K, 3) rings of points: counter-clockwise seen from above, listed from bottom to top.

    Both ends are closed towards their middle.
    """
    first, last = (np.broadcast_to(ring.mean(axis=0), ring.shape)[None] for ring in (rings[0], rings[-1]))
    points = np.concatenate([first, rings, last])
    count = points.shape[1]
    return build(points.reshape(-1, 3), _bands(count, len(points)), crease_deg=crease_deg, grain=grain)


def cylinder(radius: float, height: float, bevel: float = 0.002, segments: int = 24) -> Mesh:
    """A cylinder standing on z = 0 with softened rims."""
    bevel = min(bevel, radius * 0.5, height * 0.5)
    return lathe(
        [
            (0, 0),
            (radius - bevel, 0),
            (radius, bevel),
            (radius, height - bevel),
            (radius - bevel, height),
            (0, height),
        ],
        segments,
        crease_deg=50.0,
    )


def ellipsoid(radii: Sequence[float], segments: int = 24, rings: int = 14) -> Mesh:
    """An ellipsoid about the origin."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    sphere = lathe(np.stack([np.cos(angle), np.sin(angle)], axis=1), segments, crease_deg=80.0)
    scaled = affine(sphere, np.diag(np.asarray(radii, float)))
    return Mesh(scaled.vertices, scaled.triangles, scaled.normals, scaled.uvs * float(np.mean(radii)))


def capsule(radius: float, height: float, segments: int = 16, rings: int = 5) -> Mesh:
    """A cylinder with hemispherical ends, standing on z = 0, `height` in all."""
    angle = np.linspace(-np.pi / 2, 0, rings + 1)
    bottom = np.stack([radius * np.cos(angle), radius + radius * np.sin(angle)], axis=1)
    top = np.stack([bottom[::-1, 0], height - bottom[::-1, 1]], axis=1)
    return lathe(np.concatenate([bottom, top]), segments, crease_deg=80.0)


def sweep(
    path: Points,
    profile: Points,
    scale: float | Sequence[float] | Floats = 1.0,
    closed: bool = False,
    caps: bool = True,
    up: Sequence[float] = (0.0, 0.0, 1.0),
    crease_deg: float = 40.0,
) -> Mesh:
    """Carry a closed counter-clockwise profile along a path (N, 3), without twist.

    The profile's second axis starts along `up`. `scale` is one factor, or one per path point (N,) or (N, 2).
    u is the length along the path, v the way around the profile, in metres.
    """
    line, outline = np.asarray(path, float), np.asarray(profile, float)
    scales = np.broadcast_to(np.asarray(scale, float).reshape(-1, 1 if np.ndim(scale) < 2 else 2), (len(line), 2))
    tangents = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0) if closed else np.gradient(line, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    vertical = np.asarray(up, float)
    if abs(vertical @ tangents[0]) > 0.99:
        vertical = np.array([1.0, 0.0, 0.0]) if abs(tangents[0][0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    rings = []
    for point, tangent, size in zip(line, tangents, scales, strict=True):
        vertical = vertical - (vertical @ tangent) * tangent
        vertical = vertical / np.linalg.norm(vertical)
        side = np.cross(vertical, tangent)
        rings.append(point + (outline[:, :1] * size[0]) * side + (outline[:, 1:] * size[1]) * vertical)
    points = np.stack(rings)
    around = np.linalg.norm(np.diff(outline, axis=0, append=outline[:1]), axis=1) * float(scales.max())
    stations = np.concatenate([line, line[:1]]) if closed else line
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(stations, axis=0), axis=1))])
    v, u = np.meshgrid(np.concatenate([[0], np.cumsum(around)]), along)
    if closed:
        points = np.concatenate([points, points[:1]])
    surface = grid_surface(
        np.concatenate([points, points[:, :1]], axis=1)[::-1],
        np.stack([u, v], axis=2)[::-1],
        crease_deg=crease_deg,
    )
    if closed or not caps:
        return surface
    flat = triangulate(outline)
    first = build(points[0], flat[:, ::-1].copy(), outline)
    last = build(points[-1], flat, outline)
    return merge([surface, first, last])


def tube(
    path: Points,
    radius: float | Sequence[float] | Floats,
    sides: int = 10,
    closed: bool = False,
    caps: bool = True,
) -> Mesh:
    """A round tube along a path; `radius` in metres, one or one per path point."""
    return sweep(path, circle(1.0, sides), radius, closed, caps, crease_deg=70.0)


def extrude(
    outline: Points,
    height: float,
    bevel: float = 0.0,
    segments: int = 2,
    holes: Sequence[Points] = (),
    grain: str = "x",
    crease_deg: float = 50.0,
) -> Mesh:
    """A plate of the given counter-clockwise outline from z = 0 to `height`, its edges rounded by `bevel`.

    Holes are outlines of either direction; their edges stay sharp.
    """
    rim = np.asarray(outline, float)
    inward = inward_directions(rim)
    angle = np.radians(np.linspace(0, 90, segments + 1)) if bevel > 0 else np.zeros(1)
    inset, rise = bevel * (1 - np.sin(angle)), bevel * (1 - np.cos(angle))
    lower = [np.column_stack([rim + inward * i, np.full(len(rim), r)]) for i, r in zip(inset, rise, strict=True)]
    upper = [
        np.column_stack([rim + inward * i, np.full(len(rim), height - r)])
        for i, r in zip(inset[::-1], rise[::-1], strict=True)
    ]
    vertices, triangles = [np.concatenate(lower + upper)], []
    triangles.append(_bands(len(rim), len(lower) + len(upper)))
    rings = [rim + inward * inset[0], *(np.asarray(hole, float) for hole in holes)]
    flat = triangulate(*rings)
    cap = np.concatenate(rings)
    base = len(vertices[0])
    vertices += [
        np.column_stack([cap, np.zeros(len(cap))]),
        np.column_stack([cap, np.full(len(cap), height)]),
    ]
    triangles += [flat[:, ::-1] + base, flat + base + len(cap)]
    for hole in rings[1:]:
        ring = hole[::-1] if signed_area(hole) > 0 else hole
        base = sum(len(block) for block in vertices)
        vertices.append(
            np.concatenate(
                [
                    np.column_stack([ring, np.zeros(len(ring))]),
                    np.column_stack([ring, np.full(len(ring), height)]),
                ]
            )
        )
        triangles.append(_bands(len(ring), 2) + base)
    return build(
        np.concatenate(vertices),
        np.concatenate(triangles).astype(np.int32),
        crease_deg=crease_deg,
        grain=grain,
    )


def _bands(count: int, rings: int) -> Ints:
    """Triangles between consecutive closed rings of `count` points each, facing outwards."""
    ring = np.arange(count)
    following = (ring + 1) % count
    quads = [
        (
            level * count + ring,
            level * count + following,
            (level + 1) * count + following,
            (level + 1) * count + ring,
        )
        for level in range(rings - 1)
    ]
    return np.concatenate(
        [np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]) for a, b, c, d in quads],
        dtype=np.int32,
    )
