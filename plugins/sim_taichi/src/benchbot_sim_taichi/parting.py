"""Surfaces that cross a window pane, cut at it: one half of a rail lies in daylight, the other in the room."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray, SceneGeometry

LEAST_PANE_M2 = 0.02
BESIDE_M = 0.02
AROUND_M = 0.12  # a window's frame, and its reveals behind that
THICKNESS_M = 0.0005

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class _Plane:
    """Where panes are that lie in one plane: its unit normal and offset, and the box (2, 3) around them in metres."""

    normal: Floats
    offset_m: float
    box: Floats

    def distance_m(self, points: Floats) -> Floats:
        """Return how far (..., 3) points lie before the plane; those within its thickness lie in it."""
        away_m: Floats = points @ self.normal - self.offset_m
        return np.where(np.abs(away_m) < THICKNESS_M, 0.0, away_m)


def parted(scene: SceneGeometry) -> SceneGeometry:
    """Return a scene in which no triangle of what is not glass crosses a pane; it covers the same surface."""
    planes = list(_planes(scene))
    if not planes:
        return scene
    low, high = _extents(scene)
    is_near = np.zeros(len(scene.triangles), bool)
    for plane in planes:
        is_near |= _touches(plane, low, high)
    before = np.flatnonzero(is_near).astype(np.int32)
    near = replace(scene, triangles=scene.triangles[before], triangle_instance=before)
    for plane in planes:
        corner = near.vertices[near.triangles].astype(np.float64)
        away_m = plane.distance_m(corner)
        crosses = _touches(plane, corner.min(axis=1), corner.max(axis=1))
        crosses &= (away_m.min(axis=1) < 0.0) & (away_m.max(axis=1) > 0.0)
        near = _cut(near, np.flatnonzero(crosses), away_m[crosses])
    if len(near.triangles) == len(before):
        return scene
    origin = np.concatenate([np.flatnonzero(~is_near), near.triangle_instance])
    order = np.argsort(origin, kind="stable")
    return replace(
        near,
        triangles=np.concatenate([scene.triangles[~is_near], near.triangles])[order],
        triangle_instance=scene.triangle_instance[origin[order]],
        triangle_material=scene.triangle_material[origin[order]],
    )


def sides(scene: SceneGeometry) -> Ints:
    """Return a number for each triangle: 0 away from panes, another for either side of each."""
    side = np.zeros(len(scene.triangles), np.int64)
    low, high = _extents(scene)
    for number, plane in enumerate(_planes(scene)):
        near = np.flatnonzero(_touches(plane, low, high))
        middle = scene.vertices[scene.triangles[near]].astype(np.float64).mean(axis=1)
        side[near] = 1 + 2 * number + (plane.distance_m(middle) > 0.0)
    return side


def _planes(scene: SceneGeometry) -> Iterator[_Plane]:
    """Find the planes of panes, object by object: such as that of a window of several."""
    glass = np.flatnonzero(_is_glass(scene))
    corner = scene.vertices[scene.triangles[glass]].astype(np.float64)
    oriented = 0.5 * np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area_m2 = np.sqrt(np.einsum("tx,tx->t", oriented, oriented))
    normal = oriented / np.maximum(area_m2, 1e-20)[:, None]
    largest = np.abs(normal).argmax(axis=1)
    normal *= np.where(normal[np.arange(len(normal)), largest] < 0.0, -1.0, 1.0)[:, None]
    offset_m = np.einsum("tx,tx->t", normal, corner[:, 0])
    key = np.column_stack([scene.triangle_instance[glass], np.rint(normal * 200), np.rint(offset_m * 500)])
    group = np.unique(key, axis=0, return_inverse=True)[1].reshape(-1)
    for number in np.flatnonzero(np.bincount(group, area_m2) >= LEAST_PANE_M2):
        of_plane = np.flatnonzero(group == number)
        points = corner[of_plane].reshape(-1, 3)
        margin_m = BESIDE_M + (AROUND_M - BESIDE_M) * (1.0 - np.abs(normal[of_plane[0]]))
        box = np.stack([points.min(axis=0) - margin_m, points.max(axis=0) + margin_m])
        yield _Plane(normal[of_plane[0]], float(offset_m[of_plane].mean()), box)


def _extents(scene: SceneGeometry) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest corners (T, 3) of triangles; those of glass are nowhere."""
    one, two, three = (scene.vertices[scene.triangles[:, corner]] for corner in range(3))
    low, high = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
    low[_is_glass(scene)] = np.inf
    return low, high


def _is_glass(scene: SceneGeometry) -> npt.NDArray[np.bool_]:
    is_glass = np.array([material.is_glass for material in scene.materials], bool)
    return is_glass[scene.triangle_material]


def _touches(plane: _Plane, low: npt.NDArray[np.floating], high: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
    touches: npt.NDArray[np.bool_] = ((low <= plane.box[1]) & (high >= plane.box[0])).all(axis=1)
    return touches


def _cut(scene: SceneGeometry, crossing: Ints, away_m: Floats) -> SceneGeometry:
    """Replace each crossing triangle by the piece that has one of its corners, and two of the rest."""
    if not len(crossing):
        return scene
    sign = np.sign(away_m)
    alone = (sign * sign.sum(axis=1, keepdims=True) < 0.0).argmax(axis=1)
    balanced = sign.sum(axis=1) == 0.0  # one corner lies in the plane: either of the others is alone
    alone[balanced] = (sign[balanced] != 0.0).argmax(axis=1)
    a, b, c = (scene.triangles[crossing, (alone + i) % 3].astype(np.int64) for i in range(3))
    far_a, far_b, far_c = (away_m[np.arange(len(alone)), (alone + i) % 3] for i in range(3))
    ends = np.concatenate([np.column_stack([a, b]), np.column_stack([a, c])])
    far = np.concatenate([np.column_stack([far_a, far_b]), np.column_stack([far_a, far_c])])
    # Triangles that share an edge have to find the same point of it, from whichever end they come.
    order = np.lexsort(scene.vertices[ends].transpose(2, 0, 1), axis=1)[:, :1]
    is_turned = (order == 1)[:, 0]
    ends[is_turned], far[is_turned] = ends[is_turned, ::-1], far[is_turned, ::-1]
    share = (far[:, 0] / (far[:, 0] - far[:, 1]))[:, None]

    def between(values: npt.NDArray[np.float32]) -> Floats:
        start, end = values[ends[:, 0]].astype(np.float64), values[ends[:, 1]].astype(np.float64)
        found: Floats = start + share * (end - start)
        return found

    normal = between(scene.normals)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    p = len(scene.vertices) + np.arange(len(crossing))
    q = p + len(crossing)
    pieces = np.stack([np.column_stack(three) for three in ((a, p, q), (p, b, c), (p, c, q))], axis=1)
    kept = np.ones((len(crossing), 3), bool)
    kept[far_b == 0.0, 1] = False  # there p is b
    kept[far_c == 0.0, 2] = False  # there q is c
    whole = np.ones(len(scene.triangles), bool)
    whole[crossing] = False
    return replace(
        scene,
        vertices=np.concatenate([scene.vertices, between(scene.vertices)]).astype(np.float32),
        normals=np.concatenate([scene.normals, normal]).astype(np.float32),
        uvs=np.concatenate([scene.uvs, between(scene.uvs)]).astype(np.float32),
        triangles=np.concatenate([scene.triangles[whole], pieces[kept]]).astype(np.int32),
        triangle_instance=np.concatenate(
            [scene.triangle_instance[whole], np.repeat(scene.triangle_instance[crossing], kept.sum(axis=1))]
        ),
    )
