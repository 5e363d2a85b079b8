"""Lines of sight through a scene's voxels, without a renderer: the surfaces that are seen from each place."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
VOXEL_M = 0.05
# So many points of an object are looked at; it is seen when this share of them is.
POINTS = 16
SEEN_SHARE = 0.18
UPPER_PART = 0.8
# A line of sight ends short of its goal, where an object's own and its carrier's voxels begin.
END_GAP_M = 0.10
# How far apart a line of sight is looked at.
STEP_VOXELS = 0.7
_PLACES_AT_ONCE = 8
_THINGS_AT_ONCE = 8
_TRIANGLES_AT_ONCE = 10_000


@dataclass(frozen=True)
class Voxels:
    """A voxel grid of instances (`Instance.index`, 0 is none); `low_m` is the grid's lowest corner in the map frame."""

    low_m: Floats
    size_m: float
    owner: npt.NDArray[np.int32]

    def owners(self, points: Floats) -> npt.NDArray[np.int32]:
        """Return the instances at points (N, 3) of the map frame; 0 outside the grid."""
        shape = np.array(self.owner.shape)
        # The outermost cubes are empty, so that what is outside may count as in one of them.
        i, j, k = np.clip(((points - self.low_m) / self.size_m).astype(np.int32), 0, shape - 1).T
        found: npt.NDArray[np.int32] = self.owner.ravel()[(i * shape[1] + j) * shape[2] + k]
        return found


@dataclass(frozen=True)
class Target:
    """Something to be seen: its instance, the points (P, 3) on it that are looked at, and their middle."""

    name: str
    index: int
    points: Floats
    middle: Floats


def voxels(geometry: SceneGeometry, size_m: float = VOXEL_M) -> Voxels:
    """Fill the cubes that a scene's opaque surfaces pass through."""
    opaque = np.array([material.transmission < 0.5 for material in geometry.materials], bool)
    kept = opaque[geometry.triangle_material]
    corners = geometry.vertices[geometry.triangles[kept]].astype(np.float64)
    finite = np.isfinite(corners).all((1, 2))
    corners, instance = corners[finite], geometry.triangle_instance[kept][finite]
    batches = [slice(first, first + _TRIANGLES_AT_ONCE) for first in range(0, len(corners), _TRIANGLES_AT_ONCE)]
    parts = [surface_points(corners[batch], 0.7 * size_m) for batch in batches]
    ends = np.array([(points.min(0), points.max(0)) for points, _ in parts]).reshape(-1, 3)
    low = ends.min(0, initial=0.0) - 1.5 * size_m
    shape = np.ceil((ends.max(0, initial=0.0) - low) / size_m).astype(np.int64) + 2
    owner = np.zeros(shape, np.int32)
    for batch, (points, triangle) in zip(batches, parts, strict=True):
        i, j, k = ((points - low) / size_m).astype(np.int64).T
        owner.reshape(-1)[(i * shape[1] + j) * shape[2] + k] = instance[batch][triangle]
    return Voxels(low, size_m, owner)


def surface_points(corners: Floats, spacing_m: float) -> tuple[Floats, Integers]:
    """Points on triangles (T, 3, 3) in rows `spacing_m` apart, corners included, and the triangle of each."""
    sides_m = np.linalg.norm(np.roll(corners, -1, 1) - corners, axis=2)
    longest = np.argmax(sides_m, axis=1)
    # Rows are parallel to the longest side: a sliver has few of them.
    order = (longest[:, None] + np.arange(3)) % 3
    start, end, apex = np.take_along_axis(corners, order[..., None], 1).transpose(1, 0, 2)
    base_m = np.take_along_axis(sides_m, longest[:, None], 1)[:, 0]
    area2 = np.linalg.norm(np.cross(end - start, apex - start), axis=1)
    row_count = np.ceil(area2 / np.maximum(base_m, 1e-12) / spacing_m).astype(np.int64) + 1
    triangle, row = _runs(row_count)
    up = row / np.repeat(np.maximum(row_count - 1, 1), row_count)
    first = np.repeat(start, row_count, axis=0) + up[:, None] * np.repeat(apex - start, row_count, axis=0)
    along = (1 - up)[:, None] * np.repeat(end - start, row_count, axis=0)
    column_count = np.ceil((1 - up) * np.repeat(base_m, row_count) / spacing_m).astype(np.int64) + 1
    of, column = _runs(column_count)
    # Coordinate by coordinate, which is in memory as it is gone through.
    points = along.T.take(of, axis=1)
    points *= column / np.maximum(column_count - 1, 1)[of]
    points += first.T.take(of, axis=1)
    return points.T, triangle[of]


def _runs(counts: Integers) -> tuple[Integers, Integers]:
    """For runs of so many: which run each element is of, and its number within."""
    run = np.repeat(np.arange(len(counts)), counts)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(counts) - counts, counts)


def targets(geometry: SceneGeometry, names: Collection[str] | None = None) -> list[Target]:
    """The objects of a class, or those named, as things to be seen."""
    chosen = []
    for instance in geometry.instances:
        if (instance.class_name is None) if names is None else (instance.name not in names):
            continue
        corners = geometry.vertices[geometry.triangles[geometry.triangle_instance == instance.index]]
        if not len(corners):
            continue
        low, high = corners.min((0, 1)), corners.max((0, 1))
        points, _ = surface_points(corners.astype(np.float64), float(np.linalg.norm(high - low)) / 4)
        rng = np.random.default_rng(0)
        # Half of the points are from its upper part: the rest may be sunk into what carries it.
        upper = np.flatnonzero(points[:, 2] >= low[2] + UPPER_PART * (high[2] - low[2]))
        chosen_points = [rng.permutation(some)[: POINTS // 2] for some in (upper, np.arange(len(points)))]
        spread = np.unique(np.concatenate(chosen_points))
        middle = ((low + high) / 2).astype(np.float64)
        chosen.append(Target(instance.name, instance.index, points[spread], middle))
    return chosen


def seen_from(
    eyes: Floats, things: Sequence[Target], scene: Voxels, range_m: float, half_height_deg: float
) -> npt.NDArray[np.bool_]:
    """Say which of `things` each of `eyes` (E, 3) sees, turned towards it: (E, things).

    Seen means within `range_m`, a share of the points within the picture's height, and nothing else in between.
    """
    seen = np.zeros((len(eyes), len(things)), bool)
    for first in range(0, len(things), _THINGS_AT_ONCE):
        some = slice(first, first + _THINGS_AT_ONCE)
        found = _see([(eyes, thing) for thing in things[some]], scene, range_m, half_height_deg)
        seen[:, some] = np.stack(found, 1)
    return seen


def _see(
    looks: Sequence[tuple[Floats, Target]], scene: Voxels, range_m: float, half_height_deg: float
) -> list[npt.NDArray[np.bool_]]:
    """Say which of some eyes (E, 3) see a thing, as `seen_from` does: (E,) of each look."""
    limit = math.tan(math.radians(half_height_deg))
    # Many short lines of sight are followed at once: step by step, a call for all costs little more than one for few.
    lines = []
    for eyes, thing in looks:
        near = np.flatnonzero(np.linalg.norm(eyes - thing.middle, axis=1) <= range_m)
        ways = thing.points[None] - eyes[near, None]
        visible = np.abs(ways[..., 2]) <= limit * np.linalg.norm(ways[..., :2], axis=2)
        lines.append((near, ways, visible))
    free = _is_free(
        np.concatenate(
            [
                np.repeat(eyes[near], visible.sum(1), axis=0)
                for (eyes, _), (near, _, visible) in zip(looks, lines, strict=True)
            ]
        ),
        np.concatenate([ways[visible] for _, ways, visible in lines]),
        np.concatenate(
            [np.full(visible.sum(), thing.index) for (_, thing), (*_, visible) in zip(looks, lines, strict=True)]
        ),
        scene,
    )
    found, end = [], 0
    for (eyes, _), (near, _, visible) in zip(looks, lines, strict=True):
        start, end = end, end + int(visible.sum())
        visible[visible] = free[start:end]
        seen = np.zeros(len(eyes), bool)
        seen[near] = visible.mean(1) >= SEEN_SHARE
        found.append(seen)
    return found


def unseen(geometry: SceneGeometry, poses: Sequence[Sequence[float]], robot: "Observer") -> list[str]:
    """The objects of a class that a robot sees from none of its poses [qw, qx, qy, qz, x, y, z].

    It sees what is within half the picture's width of where it looks, and as far as `seen_from` says.
    """
    things, scene = targets(geometry), voxels(geometry)
    eyes = np.array([[pose[4], pose[5], robot.eye_m] for pose in poses], float)
    headings = np.array([2 * math.atan2(pose[3], pose[0]) for pose in poses])
    turn = bearings_rad(eyes, things) - headings[:, None]
    ahead = np.abs(np.arctan2(np.sin(turn), np.cos(turn))) <= math.radians(robot.half_width_deg)
    left: list[tuple[Target, Floats]] = []
    for number, thing in enumerate(things):
        # A robot turns on the spot: there are a few poses of each place. Mostly one of the nearest sees it.
        places = np.unique(eyes[ahead[:, number]], axis=0)
        left.append((thing, places[np.argsort(np.linalg.norm(places - thing.middle, axis=1), kind="stable")]))
    found: set[str] = set()
    while left:
        found |= {thing.name for thing, places in left if not len(places)}
        left = [(thing, places) for thing, places in left if len(places)]
        looks = [(places[:_PLACES_AT_ONCE], thing) for thing, places in left]
        seen = _see(looks, scene, robot.range_m, robot.half_height_deg) if looks else []
        left = [
            (thing, places[_PLACES_AT_ONCE:])
            for (thing, places), sees in zip(left, seen, strict=True)
            if not sees.any()
        ]
    return [thing.name for thing in things if thing.name in found]


def _is_free(start: Floats, ways: Floats, index: Integers, scene: Voxels) -> npt.NDArray[np.bool_]:
    """Say of lines of sight (N, 3) whether each meets nothing but the instance that it leads to: (N,)."""
    length_m = np.linalg.norm(ways, axis=1)
    reach_m = np.maximum(length_m - END_GAP_M, 0.0)
    # Coordinate by coordinate, which is in memory as it is gone through.
    start, unit = np.ascontiguousarray(start.T), np.ascontiguousarray((ways / np.maximum(length_m, 1e-9)[:, None]).T)
    free = np.ones(len(ways), bool)
    going = np.arange(len(ways))
    way_m = STEP_VOXELS * scene.size_m
    while len(going := going[reach_m[going] > way_m]):
        owner = scene.owners((start.take(going, axis=1) + way_m * unit.take(going, axis=1)).T)
        is_clear = (owner == 0) | (owner == index[going])
        free[going[~is_clear]] = False
        going = going[is_clear]
        way_m += STEP_VOXELS * scene.size_m
    return free


def bearings_rad(eyes: Floats, things: Sequence[Target]) -> Floats:
    """The direction in the floor's plane from each eye to the middle of each thing: (E, things)."""
    middles = np.array([thing.middle for thing in things]).reshape(-1, 3)
    ways = middles[None] - eyes[:, None]
    angles: Floats = np.arctan2(ways[..., 1], ways[..., 0])
    return angles


@dataclass(frozen=True)
class Observer:
    """A robot as far as it matters here: a disc that collides between two heights, and a camera on its axis.

    `half_width_deg` and `half_height_deg` are half the picture's angles; beyond `range_m` objects are too small.
    """

    radius_m: float
    z_min_m: float
    z_max_m: float
    eye_m: float
    half_width_deg: float
    half_height_deg: float
    range_m: float = 4.0


# The robot "carter" of benchbot-sim-taichi.
CARTER = Observer(0.30, 0.03, 1.10, 1.05, 45.0, 29.4)


def observer(robot: Mapping[str, object]) -> Observer:
    """The observer that a robot's declaration describes; a camera without focal lengths is 90 degrees wide."""
    footprint, camera, frames = (_mapping(robot.get(key)) for key in ("footprint", "camera", "frames"))
    frame = _mapping(frames.get(str(camera.get("frame"))))
    mount = frame.get("xyz", (0.0, 0.0, CARTER.eye_m))
    height, width = (float(str(camera.get(key, value))) for key, value in (("height", 540), ("width", 960)))
    fx, fy = (float(str(camera.get(key, width / 2))) for key in ("fx", "fy"))
    return Observer(
        float(str(footprint.get("radius_m", CARTER.radius_m))),
        float(str(footprint.get("z_min_m", CARTER.z_min_m))),
        float(str(footprint.get("z_max_m", CARTER.z_max_m))),
        float(mount[2]) if isinstance(mount, (list, tuple)) else CARTER.eye_m,
        math.degrees(math.atan(width / 2 / fx)),
        math.degrees(math.atan(height / 2 / fy)),
    )


def _mapping(value: object) -> Mapping[str, object]:
    return value if isinstance(value, Mapping) else {}
