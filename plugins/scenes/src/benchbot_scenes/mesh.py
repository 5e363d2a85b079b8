"""Meshes of flat pieces: polygons, and what is extruded from them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import mapbox_earcut
import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import MultiPolygon, Polygon, box
from shapely.geometry.polygon import orient

Floats = npt.NDArray[np.float64]
Vector = Sequence[float] | Floats
Shape = Polygon | MultiPolygon


@dataclass(frozen=True)
class Mesh:
    """Triangles in the map frame: `vertices` (V, 3) metres, `normals` (V, 3) unit, `uvs` (V, 2) in metres with u to
    the right and v up, `triangles` (T, 3) counter-clockwise from outside.
    """

    vertices: Floats
    normals: Floats
    uvs: Floats
    triangles: npt.NDArray[np.int64]

    def with_uvs(self, uvs: Floats) -> "Mesh":
        """The same with other texture coordinates."""
        return replace(self, uvs=uvs)


@dataclass(frozen=True)
class Frame:
    """A plane in space: a point of it is `origin + u right + v up`, and it faces `right × up`."""

    origin: Vector
    right: Vector
    up: Vector

    @property
    def out(self) -> Floats:
        """The unit vector that the plane faces."""
        return np.cross(np.asarray(self.right, float), np.asarray(self.up, float))

    def points(self, plane: Floats, depth_m: float = 0.0) -> Floats:
        """(N, 3) points of (N, 2) plane coordinates, `depth_m` in front of the plane."""
        axes = np.stack([np.asarray(self.right, float), np.asarray(self.up, float)])
        points: Floats = np.asarray(self.origin, float) + plane @ axes + depth_m * self.out
        return points


FLOOR = Frame((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
"""The plane z = 0, facing up; its coordinates are x and y."""


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """Join meshes into one; an empty one when there are none."""
    parts = list(meshes)
    if not parts:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 3), np.int64))
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in parts[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in parts]),
        np.concatenate([mesh.normals for mesh in parts]),
        np.concatenate([mesh.uvs for mesh in parts]),
        np.concatenate([mesh.triangles + offset for mesh, offset in zip(parts, offsets, strict=True)]),
    )


def polygons(shape: shapely.Geometry) -> list[Polygon]:
    """The polygons of a geometry, counter-clockwise with clockwise holes; slivers, lines and points are dropped."""
    parts = shapely.get_parts(shape)
    return [orient(part) for part in parts if isinstance(part, Polygon) and part.area > 1e-9]


def face(shape: shapely.Geometry, frame: Frame, depth_m: float = 0.0, *, is_back: bool = False) -> Mesh:
    """A flat piece `depth_m` before the frame's plane, facing as it does, or away when `is_back`."""
    pieces = []
    for polygon in polygons(shape):
        rings = [np.asarray(ring.coords)[:-1, :2] for ring in (polygon.exterior, *polygon.interiors)]
        plane = np.concatenate(rings)
        triangles = _counter_clockwise(plane, _triangulated(plane, rings))
        normal = -frame.out if is_back else frame.out
        pieces.append(
            Mesh(
                frame.points(plane, depth_m),
                np.tile(normal, (len(plane), 1)),
                plane,
                triangles[:, ::-1] if is_back else triangles,
            )
        )
    return merge(pieces)


def extrusion(shape: shapely.Geometry, frame: Frame, low_m: float, high_m: float, *, has_back: bool = False) -> Mesh:
    """A plate between two depths before the frame's plane: its front, its edges, and its back on request."""
    pieces = [face(shape, frame, high_m)]
    if has_back:
        pieces.append(face(shape, frame, low_m, is_back=True))
    for polygon in polygons(shape):
        rings = (polygon.exterior, *polygon.interiors)
        pieces += [_band(np.asarray(ring.coords)[:, :2], frame, low_m, high_m) for ring in rings]
    return merge(pieces)


def block(frame: Frame, low: Vector, high: Vector) -> Mesh:
    """A box between two corners (right, up, out) of a frame, closed."""
    return extrusion(box(low[0], low[1], high[0], high[1]), frame, low[2], high[2], has_back=True)


def _band(ring: Floats, frame: Frame, low_m: float, high_m: float) -> Mesh:
    """The edges of a plate along a closed ring that has its inside on the left; u runs along it, v is the depth."""
    start, end = ring[:-1], ring[1:]
    length = np.linalg.norm(end - start, axis=1)
    start, end, length = start[length > 1e-9], end[length > 1e-9], length[length > 1e-9]
    along = np.concatenate([[0.0], np.cumsum(length)])
    outward = np.stack([end[:, 1] - start[:, 1], start[:, 0] - end[:, 0]], axis=1) / length[:, None]
    count = len(start)
    corners = [frame.points(*corner) for corner in ((start, low_m), (end, low_m), (end, high_m), (start, high_m))]
    uvs = [(along[:-1], low_m), (along[1:], low_m), (along[1:], high_m), (along[:-1], high_m)]
    quads = 4 * np.arange(count)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh(
        np.stack(corners, axis=1).reshape(-1, 3),
        np.repeat(outward @ np.stack([np.asarray(frame.right, float), np.asarray(frame.up, float)]), 4, axis=0),
        np.stack([np.stack([u, np.full(count, v)], axis=1) for u, v in uvs], axis=1).reshape(-1, 2),
        quads.reshape(-1, 3),
    )


def _triangulated(plane: Floats, rings: list[Floats]) -> npt.NDArray[np.int64]:
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    flat = mapbox_earcut.triangulate_float64(np.ascontiguousarray(plane), ends)
    return np.asarray(flat, np.int64).reshape(-1, 3)


def _counter_clockwise(plane: Floats, triangles: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    a, b, c = (plane[triangles[:, corner]] for corner in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    turned = np.where((area < 0)[:, None], triangles[:, ::-1], triangles)
    return turned[np.abs(area) > 1e-12]
