"""Evidence: in which recorded observations an object is truly to be seen, how near, how much of it, how well lit.

What hides what is told by the depth that was recorded, which is what the solution was shown; without it by the true
boxes and the walls of the occupancy map, which are taken to reach the ceiling.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.evaluation import occupancy_map
from benchbot.evaluation.frames import DEPTH, Frame, frames_at

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Document = dict[str, Any]

NEAREST_M = 0.1
LEAST_VISIBLE = 0.1
"""An object of which less is to be seen was not seen."""
MOST_VIEWS = 8
_TOLERANCE_M, _TOLERANCE = 0.03, 0.01
_WALL_STEP_M, _BESIDE_M = 0.04, 0.1
_RAYS, _RAYS_WITHOUT_DEPTH = 14, 5
_LEAST_RAYS = 2


@dataclass(frozen=True)
class Camera:
    """A pinhole camera on a robot: its pose in the robot's frame, and its intrinsics in pixels."""

    mount: Pose
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def of(cls, robot: Mapping[str, Any] | None) -> Self | None:
        """Return the camera that a robot's declaration describes, None when it describes none."""
        camera = (robot or {}).get("camera")
        frame = (robot or {}).get("frames", {}).get((camera or {}).get("frame"))
        if camera is None or frame is None:
            return None
        mount = Pose.from_xyz_rpy_deg(frame["xyz"], frame.get("rpy_deg", (0, 0, 0)))
        return cls(mount, *(camera[key] for key in ("width", "height", "fx", "fy", "cx", "cy")))

    def seen_from(self, base: Pose, points: Floats) -> Floats:
        """Return points (N, 3) of the map in the camera's frame, x right, y down, z forward."""
        matrix = (base @ self.mount).matrix()
        seen: Floats = (points - matrix[:3, 3]) @ matrix[:3, :3]
        return seen

    def pixels(self, seen: Floats) -> Floats:
        """Return where points (N, 3) before the lens, in the camera's frame, appear (N, 2)."""
        return np.asarray(seen[..., :2] / seen[..., 2:] * (self.fx, self.fy) + (self.cx, self.cy))

    def rays(self, base: Pose, pixels: Floats) -> Floats:
        """Return the directions (…, 3), in the map frame, of the rays through pixels (…, 2), one metre deep each."""
        z = np.ones((*pixels.shape[:-1], 1))
        rays = np.concatenate([(pixels - (self.cx, self.cy)) / (self.fx, self.fy), z], axis=-1)
        return np.asarray(rays @ (base @ self.mount).matrix()[:3, :3].T)


@dataclass(frozen=True)
class Boxes:
    """N axis-aligned boxes by their corners, (N, 3) each, in the map frame."""

    lower: Floats
    upper: Floats

    @classmethod
    def of(cls, boxes: Sequence[tuple[Sequence[float], Sequence[float]]]) -> Self:
        """Return the boxes of centroids and full extents."""
        centroids, extents = (np.array([box[i] for box in boxes], float).reshape(-1, 3) for i in (0, 1))
        return cls(centroids - extents / 2, centroids + extents / 2)

    def corners(self) -> Floats:
        """Return the eight corners of each, (N, 8, 3); those whose indices differ in one bit share an edge."""
        bits = np.array([[number >> 2 & 1, number >> 1 & 1, number & 1] for number in range(8)], bool)
        return np.where(bits, self.upper[:, None], self.lower[:, None])

    def spans(self, eye: Floats, rays: Floats) -> tuple[Floats, Floats]:
        """Return where rays (N, R, 3), or (R, 3) for all, enter and leave each box, in lengths of the ray (N, R).

        A ray that misses leaves before it enters.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            first = (self.lower[:, None] - eye) / rays
            second = (self.upper[:, None] - eye) / rays
        return np.fmin(first, second).max(axis=-1), np.fmax(first, second).min(axis=-1)

    def apart(self, other: "Boxes") -> Mask:
        """Say which pairs (N, M) stand apart, from above or one over the other."""
        gap = np.maximum(self.lower[:, None] - other.upper, other.lower - self.upper[:, None])
        return np.asarray((gap > 0.02).any(axis=-1))


@dataclass(frozen=True)
class View:
    """How a box appears in a frame: the visible share, metres to its middle, its rectangle in the picture, its quality.

    `sampled` are pixels (K, 2) that show it.
    """

    frame: Frame
    visible: float
    distance_m: float
    pixels: tuple[float, float, float, float]
    quality: float
    sampled: Floats

    def document(self) -> Document:
        """Return the view as an explanation has it."""
        rounded = [round(value, 1) for value in self.pixels]
        visible, distance_m = round(self.visible, 4), round(self.distance_m, 3)
        return {"observation": self.frame.number, "visible": visible, "distance_m": distance_m, "pixels": rounded}


@dataclass(frozen=True)
class Scene:
    """What may stand before an object in one scene, where no depth was recorded: true boxes, and the walls."""

    boxes: Boxes
    walls: occupancy_map.OccupancyMap | None = None

    @cached_property
    def free_standing(self) -> Mask | None:
        """The cells of walls, and of what else is no true object."""
        if self.walls is None:
            return None
        cells = self.walls.occupied.copy()
        rows, columns = np.nonzero(cells)
        side, (x, y, yaw) = self.walls.resolution_m, self.walls.origin_xyyaw
        across, up = (columns + 0.5) * side, (len(cells) - rows - 0.5) * side
        places = np.stack(
            [x + np.cos(yaw) * across - np.sin(yaw) * up, y + np.sin(yaw) * across + np.cos(yaw) * up], axis=1
        )
        for lower, upper in zip(self.boxes.lower[:, :2], self.boxes.upper[:, :2], strict=True):
            inside = ((places > lower - _BESIDE_M) & (places < upper + _BESIDE_M)).all(axis=1)
            cells[rows[inside], columns[inside]] = False
        return cells

    def depth_m(self, eye: Floats, rays: Floats, targets: Boxes, entered: Floats) -> Floats:
        """Return how far rays (N, R, 3) go to boxes that they enter so far away (N, R), or to what is before those."""
        found = entered.copy()
        may_hide = targets.apart(self.boxes) & ~((self.boxes.lower < eye) & (eye < self.boxes.upper)).all(axis=1)
        for index, blocking in enumerate(may_hide):
            others = Boxes(self.boxes.lower[blocking], self.boxes.upper[blocking])
            first, last = others.spans(eye, rays[index])
            hits = np.where((first < last) & (first > 0), first, np.inf)
            found[index] = np.minimum(found[index], hits.min(axis=0, initial=np.inf))
        if self.walls is not None and self.free_standing is not None:
            flat_m = np.hypot(rays[..., 0], rays[..., 1])
            longest = float(np.nanmax(np.where(np.isfinite(entered), entered * flat_m, 0.0), initial=0.0))
            steps = np.arange(_WALL_STEP_M, min(longest, 40.0), _WALL_STEP_M)
            along = steps / np.maximum(flat_m, 1e-9)[..., None]
            places = eye[:2] + along[..., None] * rays[..., None, :2]
            wall = self.walls.at(self.free_standing, places.reshape(-1, 2)).reshape(along.shape)
            # A picture on a wall stands as close to it as a cell is wide.
            before = along < (entered - 2 * self.walls.resolution_m / np.maximum(flat_m, 1e-9))[..., None]
            found = np.minimum(found, np.where(wall & before, along, np.inf).min(axis=-1, initial=np.inf))
        return found


def views_of(boxes: Boxes, frames: Sequence[Frame], camera: Camera, scene: Scene, are_true: Mask) -> list[list[View]]:
    """Return the views that there are of each of N boxes of one scene, best first.

    Of a true object (`are_true`, (N,)), that is where its surface is seen; of an estimate, where nothing is before it.
    Frames without recorded depth are judged by what stands in the `scene`.
    """
    found: list[list[View]] = [[] for _ in boxes.lower]
    for frame in frames:
        for index, view in _in_frame(boxes, frame, camera, scene, are_true):
            found[index].append(view)
    return [sorted(views, key=lambda view: -view.quality) for views in found]


def _in_frame(boxes: Boxes, frame: Frame, camera: Camera, scene: Scene, are_true: Mask) -> Iterator[tuple[int, View]]:
    corners = camera.seen_from(frame.base, boxes.corners().reshape(-1, 3)).reshape(-1, 8, 3)
    depths: Floats = corners[..., 2]
    before: Mask = depths > NEAREST_M
    size = np.array([camera.width, camera.height], float)
    with np.errstate(divide="ignore", invalid="ignore"):
        places = camera.pixels(corners)
    whole: Mask = np.asarray(before.all(axis=1)).reshape(-1, 1)
    least, most = (np.where(whole, edge, ends) for edge, ends in ((places.min(1), -0.5), (places.max(1), size - 0.5)))
    left_top, right_bottom = np.clip(least, -0.5, size - 0.5), np.clip(most, -0.5, size - 0.5)
    indices = np.flatnonzero(before.any(axis=1) & (right_bottom - left_top > 0.5).all(axis=1))
    depth = frame.depth_m()
    if not len(indices):
        return
    count = _RAYS if depth is not None else _RAYS_WITHOUT_DEPTH
    shares = (np.arange(count) + 0.5) / count
    grid = np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2)
    pixels = left_top[indices, None] + grid * (right_bottom - left_top)[indices, None]
    eye = np.array((frame.base @ camera.mount).translation_xyz)
    rays = camera.rays(frame.base, pixels)
    chosen = Boxes(boxes.lower[indices], boxes.upper[indices])
    first, last = chosen.spans(eye, rays)
    first = np.maximum(first, 0.0)
    hit = (first < last) & (last > NEAREST_M)
    if depth is None:
        measured = scene.depth_m(eye, rays, chosen, np.where(hit, first, np.nan))
    else:
        measured = _sampled(depth, pixels, camera)
    tolerance = _TOLERANCE_M + _TOLERANCE * first
    hit &= ~np.isnan(measured)
    hidden = hit & (measured < first - tolerance)
    inside = hit & ~hidden & (measured <= last + tolerance)
    shown = np.where(are_true[indices, None], inside, hit & ~hidden)
    middles = np.linalg.norm((chosen.lower + chosen.upper) / 2 - eye, axis=1)
    area = (most - least).prod(axis=1)[indices]
    inside_picture = np.where(
        whole[indices, 0], (right_bottom - left_top).prod(axis=1)[indices] / np.maximum(area, 1e-9), 0.3
    )
    for place, index in enumerate(indices.tolist()):
        number, out_of = int(shown[place].sum()), int((shown[place] | hidden[place]).sum())
        # Of what is only looked through, such as the space below a table, a few rays do.
        if number < min(_LEAST_RAYS, out_of) or not number:
            continue
        visible = number / out_of
        if visible < LEAST_VISIBLE:
            continue
        spread = (right_bottom - left_top)[index]
        large = min(float(np.sqrt(spread.prod() / size.prod())), 0.5)
        surface = number / max(int(hit[place].sum()), 1)
        quality = visible**2 * float(inside_picture[place]) ** 2 * large * (0.2 + 0.8 * surface)
        rectangle = (*left_top[index].tolist(), *right_bottom[index].tolist())
        yield index, View(frame, visible, float(middles[place]), rectangle, quality, pixels[place][shown[place]])


def _sampled(depth: Floats, pixels: Floats, camera: Camera) -> Floats:
    """Return the depth that was recorded at pixels (…, 2) of a camera's picture."""
    step = max(-(-camera.width // depth.shape[1]), 1)
    columns, rows = np.moveaxis(np.round(pixels).astype(int) // step, -1, 0)
    return np.asarray(depth[np.clip(rows, 0, len(depth) - 1), np.clip(columns, 0, depth.shape[1] - 1)])


def camera_of(result: Mapping[str, Any], catalog: Catalog) -> Camera | None:
    """Return the camera of the robot that a result is of, None where it is not known."""
    robot = ((result.get("provenance") or {}).get("selection") or {}).get("robot")
    declared = catalog.find("robots", robot) if isinstance(robot, str) else None
    return None if declared is None else Camera.of(declared.data)


def scene_of(name: str, objects: Sequence[Document], catalog: Catalog) -> Scene:
    """Return what may hide something in the environment NAME:VARIANT: the true boxes, and its walls."""
    true = [(item["truth_centroid"], item["truth_extent"]) for item in objects if item["truth_extent"] is not None]
    environment = catalog.find("environments", name)
    walls = None
    if environment is not None:
        # One that has no map, or none that can be read, has no walls to know.
        with suppress(BenchbotError):
            walls = occupancy_map.read(occupancy_map.map_file(environment.data, environment.path.parent))
    return Scene(Boxes.of(true), walls)


def hidden(points: Floats, box: Boxes, frame: Frame, camera: Camera, scene: Scene) -> Mask:
    """Say which points (N, 3) on edges of one box have something before them in a frame; all are before the lens."""
    seen = camera.seen_from(frame.base, points)
    pixels, depth = camera.pixels(seen), frame.depth_m()
    if depth is None:
        eye = np.array((frame.base @ camera.mount).translation_xyz)
        measured = scene.depth_m(eye, camera.rays(frame.base, pixels)[None], box, seen[None, :, 2])[0]
    else:
        measured = _sampled(depth, pixels, camera)
    with np.errstate(invalid="ignore"):
        return np.asarray(measured < seen[:, 2] * (1 - _TOLERANCE) - _TOLERANCE_M)


def with_evidence(entry: Document, result: Mapping[str, Any], folders: Sequence[Path], catalog: Catalog) -> Document:
    """Return an explanation's entry with the `evidence` of its objects, where something was recorded in `folders`."""
    objects = entry.get("objects") or []
    camera = camera_of(result, catalog)
    frames = frames_at(_observed(result), folders)
    if camera is None or not frames or not objects:
        return entry
    names = [f"{scene.get('name')}:{scene.get('variant')}" for scene in result["environment_details"]]
    told = list(objects)
    for number, name in enumerate(names):
        of_scene = [index for index, item in enumerate(objects) if item["scene"] == name]
        seen = _evidence([objects[index] for index in of_scene], name, number, frames, camera, catalog)
        for index, evidence in zip(of_scene, seen, strict=True):
            told[index] = {**objects[index], "evidence": evidence}
    has_depth = any(frame.path.with_name(frame.path.stem + DEPTH).is_file() for frame in frames)
    about = {"by": "depth" if has_depth else "geometry", "frames": len(frames), "folder": str(frames[0].path.parent)}
    return {**entry, "objects": told, "evidence": about}


def _observed(result: Mapping[str, Any]) -> list[tuple[int, Pose]]:
    """Return the scene and the true pose of the robot's base at each observation, in order."""
    found = []
    for scene, track in enumerate(result.get("track") or ()):
        number, x, y, yaw = (track["columns"].index(name) for name in ("observation", "x_m", "y_m", "yaw_rad"))
        found += [(scene, Pose.planar(row[x], row[y], row[yaw])) for row in track["rows"] if row[number] is not None]
    return found


def _evidence(
    objects: Sequence[Document], name: str, number: int, frames: Sequence[Frame], camera: Camera, catalog: Catalog
) -> list[Document]:
    shown = [(item["truth_centroid"] or item["centroid"], item["truth_extent"] or item["extent"]) for item in objects]
    are_true = np.array([item["truth_extent"] is not None for item in objects], bool)
    here = [frame for frame in frames if frame.scene == number]
    found = views_of(Boxes.of(shown), here, camera, scene_of(name, objects, catalog), are_true)
    pictures = _Pictures()
    return [_told(views, pictures) for views in found]


def _told(views: Sequence[View], pictures: "_Pictures") -> Document:
    if not views:
        return {"times_seen": 0, "views": []}
    brightness = pictures.brightness(views[0])
    return {
        "times_seen": len(views),
        "visible": round(max(view.visible for view in views), 4),
        "nearest_m": round(min(view.distance_m for view in views), 3),
        **({} if brightness is None else {"brightness": round(brightness, 4)}),
        "views": [view.document() for view in views[:MOST_VIEWS]],
    }


class _Pictures:
    """Grey pictures of frames, each read once."""

    def __init__(self) -> None:
        self._read: dict[Path, Floats | None] = {}

    def brightness(self, view: View) -> float | None:
        """Return the mean of the pixels that show a box, in [0, 1]; None where the picture cannot be read."""
        from PIL import Image

        path = view.frame.path
        if path not in self._read:
            try:
                self._read[path] = np.asarray(Image.open(path).convert("L"), np.uint8)
            except (OSError, ValueError, SyntaxError):
                self._read[path] = None
        grey = self._read[path]
        if grey is None:
            return None
        columns, rows = np.round(view.sampled).astype(int).T
        seen = grey[np.clip(rows, 0, len(grey) - 1), np.clip(columns, 0, grey.shape[1] - 1)]
        return float(seen.mean()) / 255
