"""The map of a scene, for every kind of picture: floor, objects, paths and poses; metres and radians, map frame."""

import io
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.evaluation import occupancy_map

Document = Mapping[str, Any]
Point = tuple[float, float]
Vector = tuple[float, float, float]
Points = NDArray[np.float64]

FARTHEST_M = 1e5
"""Coordinates beyond this are no place of a robot."""
NEAR_M = 5.0
"""Estimates that lie farther than this from all that is certain are not shown."""
FOLLOW = "move_next"
MATCH, FALSE_POSITIVE, FALSE_NEGATIVE, IGNORED = "match", "false_positive", "false_negative", "ignored"


@dataclass(frozen=True)
class Box:
    """An axis-aligned box: centre and side lengths."""

    centroid: Vector
    extent: Vector

    @classmethod
    def of(cls, centroid: Sequence[float] | None, extent: Sequence[float] | None) -> "Box | None":
        """Return the box, or None when it is not known."""
        if centroid is None or extent is None:
            return None
        (x, y, z), (width, depth, height) = (tuple(map(float, values)) for values in (centroid, extent))
        return cls((x, y, z), (width, depth, height))

    @property
    def low(self) -> Point:
        """The corner of least x and y, from above."""
        return self.centroid[0] - self.extent[0] / 2, self.centroid[1] - self.extent[1] / 2

    @property
    def high(self) -> Point:
        """The corner of greatest x and y, from above."""
        return self.centroid[0] + self.extent[0] / 2, self.centroid[1] + self.extent[1] / 2

    @property
    def footprint_m2(self) -> float:
        """The area from above."""
        return self.extent[0] * self.extent[1]

    @property
    def corners(self) -> list[Vector]:
        """The eight corners; those whose indices differ in one bit share an edge."""
        (x, y, z), (width, depth, height) = self.centroid, self.extent
        signs = itertools.product((-0.5, 0.5), repeat=3)
        return [(x + a * width, y + b * depth, z + c * height) for a, b, c in signs]


@dataclass(frozen=True)
class MapObject:
    """An object: its true box and the estimated one (either may be None), and what the evaluation makes of the two.

    `label` is the estimated class, `scene` the number of the scene within a result.
    """

    label: str = ""
    truth_label: str | None = None
    estimated: Box | None = None
    true: Box | None = None
    scene: int = 0
    verdict: str | None = None
    quality: float | None = None
    why: str = ""
    error: str | None = None
    """The kind of error that it is, None for none or where that is not known."""
    probability: float | None = None
    """What the estimate gives to its class."""
    mistaken: "MapObject | None" = None
    """Of a missed object, the estimate at its place; of a false positive, the true object there."""
    evidence: Mapping[str, Any] | None = None
    """How it was seen (schema `explanation`), None where that is not known."""

    @property
    def name(self) -> str:
        """The true class when there is one, else the estimated one."""
        return self.truth_label or self.label

    @property
    def failed(self) -> bool:
        """True for an object that was missed, or is not there."""
        return self.verdict in (FALSE_POSITIVE, FALSE_NEGATIVE)

    @property
    def boxes(self) -> list[Box]:
        """The boxes that are known, the true one first."""
        return [box for box in (self.true, self.estimated) if box is not None]

    @property
    def footprint_m2(self) -> float:
        """The area of the larger box from above; 0 when none is known."""
        return max((box.footprint_m2 for box in self.boxes), default=0.0)


def true_objects(ground_truth: object) -> list[MapObject]:
    """Return the objects of a ground truth that is a map of objects, those whose boxes are known; none of another."""
    found = [(str(item.get("class", "")), Box.of(item["centroid"], item["extent"])) for item in _boxed(ground_truth)]
    return [MapObject(truth_label=label, true=box) for label, box in found if box is not None]


def estimated_objects(results: object) -> list[MapObject]:
    """Return the objects of results that are a map of objects, by their likeliest classes; none of others."""
    names = results["class_list"] if isinstance(results, dict) and "class_list" in results else []
    found = []
    try:
        for item in _boxed(results):
            weights = item.get("label_probs") or []
            likeliest = max(range(len(weights)), key=weights.__getitem__, default=-1)
            label = str(names[likeliest]) if 0 <= likeliest < len(names) else ""
            if (box := Box.of(item["centroid"], item["extent"])) is not None:
                found.append(MapObject(label, estimated=box))
    except (TypeError, ValueError):  # a solution may save anything
        return []
    return found


def _boxed(document: object) -> list[dict[str, Any]]:
    items = document.get("objects") if isinstance(document, dict) else None
    if not isinstance(items, list):
        return []
    return [item for item in items if isinstance(item, dict) and "centroid" in item and "extent" in item]


@dataclass(frozen=True)
class MapPath:
    """The path through one scene, and the pose of the robot's base at each observation.

    `recorded` says whether the robot was there, or was only meant to be.
    """

    points: tuple[Point, ...] = ()
    observed: tuple[Pose, ...] = ()
    recorded: bool = False
    path_length_m: float | None = None
    collisions: int | None = None


def driven_paths(result: Document | None) -> list[MapPath]:
    """Return the path through each scene of a result: the recorded track, else the poses that were to be visited."""
    result = result or {}
    if result.get("track"):
        return [_recorded_path(track) for track in result["track"]]
    follows = FOLLOW in result.get("task_details", {}).get("actions", [FOLLOW])
    return [_planned_path(scene, follows=follows) for scene in result.get("environment_details", ())]


def _recorded_path(track: Document) -> MapPath:
    columns: Sequence[str] = track["columns"]
    x, y, yaw, number = (columns.index(name) for name in ("x_m", "y_m", "yaw_rad", "observation"))
    rows = [row for row in track["rows"] if max(abs(row[x]), abs(row[y])) < FARTHEST_M]
    return MapPath(
        points=tuple((float(row[x]), float(row[y])) for row in rows),
        observed=tuple(Pose.planar(row[x], row[y], row[yaw]) for row in rows if row[number] is not None),
        recorded=True,
        path_length_m=track.get("path_length_m"),
        collisions=track.get("collisions"),
    )


def _planned_path(scene: Document, *, follows: bool) -> MapPath:
    if "start_pose" not in scene:
        return MapPath()
    declared = [scene["start_pose"], *(scene.get("trajectory_poses", ()) if follows else ())]
    poses = tuple(map(Pose.from_wxyz_xyz, declared))
    return MapPath(tuple(map(planar, poses)), poses)


def planar(pose: Pose) -> Point:
    """Return where a pose is from above."""
    return pose.translation_xyz[0], pose.translation_xyz[1]


@dataclass(frozen=True, eq=False)
class Occupancy:
    """An occupancy map: bool (rows, columns), row 0 where y is greatest, cropped to what stands there."""

    occupied: NDArray[np.bool_]
    resolution_m: float
    """The side of a cell."""
    low: Point
    """The corner of least x and y."""

    @property
    def high(self) -> Point:
        """The corner of greatest x and y."""
        rows, columns = self.occupied.shape
        return self.low[0] + columns * self.resolution_m, self.low[1] + rows * self.resolution_m

    def png(self, color: tuple[int, int, int]) -> bytes:
        """Return a picture of what stands there in a colour, transparent elsewhere; one pixel for a cell."""
        from PIL import Image

        picture = Image.fromarray(self.occupied.astype(np.uint8))
        picture.putpalette([0, 0, 0, 0, *color, 255], "RGBA")
        buffer = io.BytesIO()
        picture.save(buffer, "PNG", optimize=True)
        return buffer.getvalue()


def occupancy_of(environment: Declaration | None) -> Occupancy | None:
    """Return the occupancy map of an environment, as far as something stands there; None when none can be read."""
    if environment is None:
        return None
    try:
        return _cropped(occupancy_map.read(occupancy_map.map_file(environment.data, environment.path.parent)))
    except BenchbotError:
        return None


def _cropped(found: occupancy_map.OccupancyMap) -> Occupancy | None:
    occupied, (x, y, yaw_rad), side_m = found.occupied, found.origin_xyyaw, found.resolution_m
    if yaw_rad:
        # Drawn upright: each cell shows what the turned map has in its middle.
        (x, y), (right, top) = found.corners().min(0).tolist(), found.corners().max(0).tolist()
        columns, rows = math.ceil((right - x) / side_m), math.ceil((top - y) / side_m)
        middles = np.mgrid[rows - 1 : -1 : -1, 0:columns] + 0.5
        points = np.stack([x + middles[1].ravel() * side_m, y + middles[0].ravel() * side_m], 1)
        occupied = found.at(found.occupied, points).reshape(rows, columns)
    kept_rows, kept_columns = (np.flatnonzero(occupied.any(axis)) for axis in (1, 0))
    if not len(kept_rows):
        return None
    upper, lower = int(kept_rows[0]), int(kept_rows[-1]) + 1
    left, last = int(kept_columns[0]), int(kept_columns[-1]) + 1
    low = x + left * side_m, y + (len(occupied) - lower) * side_m
    return Occupancy(occupied[upper:lower, left:last], side_m, low)


@dataclass(frozen=True, eq=False)
class SceneMap:
    """Everything on the map of one scene; each kind of picture shows a part of it."""

    name: str = ""
    """The environment, `NAME:VARIANT`."""
    occupancy: Occupancy | None = None
    objects: tuple[MapObject, ...] = ()
    path: MapPath = MapPath()
    believed: Points | None = None
    """The path as a solution estimates it, (N, 2), fitted to the true one as a whole."""
    planned: tuple[Point, ...] = ()
    start_xyyaw: Vector | None = None
    goals: tuple[Point, ...] = ()
    robot_xyyaw: Vector | None = None
    laser: Points | None = None
    """The ends of the laser's rays, (N, 2)."""
    solution: str = ""
    """Whose result it shows, where there are several."""

    @property
    def truth(self) -> list[tuple[str, Box]]:
        """Class and box of the true objects, the largest first, so that smaller ones are drawn on top of them."""
        return _largest_first((item.truth_label or "", item.true) for item in self.objects)

    @property
    def estimates(self) -> list[tuple[str, Box]]:
        """Class and box of the estimated objects, the largest first."""
        return _largest_first((item.label, item.estimated) for item in self.objects)

    @property
    def points(self) -> list[Point]:
        """All that the map of a result must have room for: the corners of floor and objects, the path, goals."""
        areas = [box for item in self.objects for box in item.boxes]
        floor = [] if self.occupancy is None else [self.occupancy.low, self.occupancy.high]
        return [*floor, *(corner for box in areas for corner in (box.low, box.high)), *self.path.points, *self.goals]

    def without_far(self) -> "SceneMap":
        """Return the map without estimates that lie far from the true objects and the path, or are nowhere at all."""
        objects = [item for item in self.objects if item.boxes]
        anchors = [item.true.centroid[:2] for item in objects if item.true is not None] + list(self.path.points)
        if not anchors:
            centroids = (item.estimated.centroid for item in objects if item.estimated is not None)
            anchors = [centroid[:2] for centroid in centroids if max(map(abs, centroid)) < 1e4]
        if not anchors:
            return replace(self, objects=())
        reach = [(min(values) - NEAR_M, max(values) + NEAR_M) for values in zip(*anchors, strict=True)]

        def is_near(box: Box | None) -> bool:
            return box is None or all(
                least <= box.low[i] and box.high[i] <= greatest for i, (least, greatest) in enumerate(reach)
            )

        return replace(self, objects=tuple(item for item in objects if is_near(item.estimated)))


def _largest_first(items: Iterator[tuple[str, Box | None]]) -> list[tuple[str, Box]]:
    known = [(label, box) for label, box in items if box is not None]
    return sorted(known, key=lambda item: -item[1].footprint_m2)
