"""What a recording shows: pictures of each observation, a cloud of the points that were seen, and who saw which object.

It is worked out once for a recording, and kept in the user's cache.
"""

import base64
import json
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchbot.plugin import Pose, cache_dir, load_plugins
from benchbot.viewing import (
    Box,
    Boxes,
    Camera,
    Frame,
    RecordingNote,
    Scene,
    class_colors,
    hidden,
    numbered_frames,
    ramp,
    views_of,
)

VERSION = 3
WIDTH_PX = 640
MOST_BYTES = 2 * 2**30
"""Of the cache; what was not looked at for longest goes first."""
MOST_POINTS = 60_000
VOXELS_M = (0.03, 0.05, 0.08, 0.12, 0.2, 0.4)
FARTHEST_M = 20.0
CEILING_M = 2.2
"""Points above are left out of the cloud: who looks from above wants to see the floor."""
STRIDE = 4
DEPTH_PX = 320
"""The width of the depth that is kept to tell what is hidden."""
STRETCHES = 16
"""Of each edge of a box; each is hidden or not."""
NEAREST_M = 0.05
EDGES = np.array([(corner, corner | bit) for corner in range(8) for bit in (1, 2, 4) if not corner & bit])
"""The corners at the ends of each edge of a box, as `static/pictures.js` numbers them: bits are x, y, z."""
UNKNOWN, BACKGROUND = (120, 120, 120), (58, 60, 66)
FRAMES, INSTANCES = "frames", ".instances.png"
GREY = np.array([0.299, 0.587, 0.114])
"""The weights of red, green and blue in brightness."""

Document = dict[str, Any]
Points = NDArray[np.float64]
Seen = list[list[tuple[float, list[Any], Document]]]
"""Of each object the frames that see it: quality, what the page gets, what summaries are made of."""


@dataclass(frozen=True)
class Looked:
    """An object that is looked for: its scene, true box and estimated box."""

    scene: int
    true: Box | None
    estimated: Box | None = None


@dataclass(frozen=True)
class View:
    """The camera at each observation: scene and pose of the base in the map frame; and what may hide things there."""

    camera: Camera | None
    bases: Sequence[tuple[int, Pose]]
    scenes: Sequence[Scene] = ()


@dataclass(frozen=True)
class Recorded:
    """Where the recordings of a result are."""

    frames: Mapping[int, Path]
    """JPEG files of the camera, by the number of the observation, from 0."""
    observations: tuple[Path, Any] | None
    """A folder with all that was observed, and what yields it."""

    @property
    def stamp(self) -> str:
        """A text that changes with the recordings."""
        folder = self.observations[0] if self.observations else None
        files = sorted(folder.glob("*")) if folder else sorted(self.frames.values())[:1]
        about = [(path.name, path.stat().st_mtime_ns, path.stat().st_size) for path in files]
        return sha256(repr((VERSION, str(folder), about)).encode()).hexdigest()[:16]


def recordings_of(result: Path, recorder: str) -> list[Path]:
    """Return where what a recorder wrote of a result may be: beside a run's, or in the folder of a batch's episode."""
    beside = result.parent / f"{result.stem}-recordings" / recorder
    alone = sum(path.suffix == ".json" for path in result.parent.iterdir()) == 1
    return [beside, result.parent / recorder] if alone else [beside]


def recorded(result: Path) -> Recorded:
    """Return what was recorded of a result."""
    frames: Mapping[int, Path] = {}
    for folder in (*recordings_of(result, FRAMES), result.with_suffix(f".{FRAMES}")):
        frames = frames or numbered_frames(folder)
    for name, provided in load_plugins().pool("recorders").items():
        for folder in recordings_of(result, name) if provided.value.read is not None else ():
            note = RecordingNote.read(folder) if folder.is_dir() else None
            # With some dropped, it is not known which observations these are.
            if folder.is_dir() and (note is None or not note.dropped):
                return Recorded(frames, (folder, provided.value.read))
    return Recorded(frames, None)


def folder_of(found: Recorded, objects: Sequence[Looked]) -> Path:
    """Return the folder of the cache for a recording in which these objects are looked for."""
    return cache_dir() / "view" / f"{found.stamp}-{sha256(repr(objects).encode()).hexdigest()[:12]}"


def prepared(found: Recorded, objects: Sequence[Looked]) -> Document | None:
    """Return what is known of a recording; None before `prepare`."""
    path = folder_of(found, objects) / "evidence.json"
    try:
        document: Document = json.loads(path.read_bytes())
        path.touch()
    except (OSError, ValueError):
        return None
    return document


def prepare(found: Recorded, view: View, objects: Sequence[Looked]) -> Document:
    """Work out what a recording shows: pictures, cloud, and which frames see which of the objects.

    `seen` has an entry for each object: the frames that see it, best first, as `[number, share, true, estimated]`:
    which share of it is in sight there, and which stretches of its boxes' edges are hidden (see `_hidden_edges`).
    `measured` says whether that is told by recorded depth, else by what truly stands there.
    """
    folder = folder_of(found, objects)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    document: Document = {"frames": [], "measured": False, "seen": [], "cloud": False, "classes": {}}
    seen: Seen = [[] for _ in objects]
    cloud = _Cloud()
    for number, path, observed in _observations(found):
        made = _pictures(folder, number, observed, document["classes"], found)
        document["frames"].append({"number": number, **made})
        if view.camera is None or number >= len(view.bases):
            continue
        scene, base = view.bases[number]
        depth = observed.get("image_depth")
        if depth is not None:
            document["measured"] = True
            points, pixels = _points(np.asarray(depth), view.camera, base)
            rgb = observed.get("image_rgb")
            cloud.add(points, _scaled(pixels, np.asarray(depth), rgb), rgb, number, scene)
        frame = _Measured(path or folder / f"{number:05d}.jpg", scene, base, number, known_depth_m=_coarse(depth))
        _look(frame, view, objects, seen, observed.get("image_rgb"))
    document["cloud"] = cloud.write(folder / "cloud.json")
    document["seen"] = [[told for _, told, _ in sorted(views, key=_worst_last)] for views in seen]
    document["objects"] = [_summary(sorted(views, key=_worst_last)) for views in seen] if document["frames"] else []
    temporary = folder / "evidence.tmp"
    temporary.write_text(json.dumps(document), "utf-8")
    temporary.rename(folder / "evidence.json")
    _forget_old(folder)
    return document


@dataclass(frozen=True)
class _Measured(Frame):
    """A frame whose depth is known, or that has none."""

    known_depth_m: Points | None = None

    def depth_m(self) -> Points | None:
        return self.known_depth_m


def _observations(found: Recorded) -> Iterator[tuple[int, Path | None, Mapping[str, Any]]]:
    """Yield number, picture and content of all observations: as they were, else what the frames keep of them."""
    if found.observations is not None:
        where, read = found.observations
        for number, observed in enumerate(read(where)):
            yield number, found.frames.get(number), observed
        return
    ids = _class_ids(next(iter(found.frames.values())).parent) if found.frames else {}
    for number, path in found.frames.items():
        kept: Document = {}
        with suppress(OSError, ValueError):
            kept["image_rgb"] = np.asarray(Image.open(path).convert("RGB"))
        depth_m = Frame(path, 0, Pose()).depth_m()
        if depth_m is not None:
            kept["image_depth"] = depth_m
        with suppress(OSError, ValueError):
            instances = np.asarray(Image.open(path.with_name(f"{path.stem}{INSTANCES}")))
            kept["image_segment"] = {"class_segment_img": instances // 1000, "class_ids": ids}
        yield number, path, kept


def _class_ids(folder: Path) -> dict[str, int]:
    with suppress(OSError, ValueError):
        return {str(name): int(number) for name, number in json.loads((folder / "classes.json").read_bytes()).items()}
    return {}


def _coarse(depth: Any) -> Points | None:
    """Return depth as frames keep it: the middle pixel of every few, at most so many wide."""
    if depth is None:
        return None
    whole = np.asarray(depth, float)
    step = -(-whole.shape[1] // DEPTH_PX)
    kept: Points = whole[step // 2 :: step, step // 2 :: step].copy()
    kept[kept <= 0] = np.nan
    return kept


def _look(frame: Frame, view: View, objects: Sequence[Looked], seen: Seen, rgb: Any) -> None:
    """Note which objects a frame sees, by quality."""
    camera = view.camera
    boxes = [(place, each.true or each.estimated) for place, each in enumerate(objects) if each.scene == frame.scene]
    known = [(place, box) for place, box in boxes if box is not None]
    if camera is None or not known:
        return
    scene = view.scenes[frame.scene] if frame.scene < len(view.scenes) else Scene(Boxes.of([]))
    are_true = np.array([objects[place].true is not None for place, _ in known])
    found = views_of(Boxes.of([(box.centroid, box.extent) for _, box in known]), [frame], camera, scene, are_true)
    for (place, _), views in zip(known, found, strict=True):
        for one in views:
            edges = [
                _hidden_edges(box, frame, camera, scene) for box in (objects[place].true, objects[place].estimated)
            ]
            about = {"distance_m": one.distance_m, "visible": one.visible}
            if rgb is not None:
                columns, rows = np.round(one.sampled).astype(int).T
                shown = np.asarray(rgb)[rows.clip(0, len(rgb) - 1), columns.clip(0, np.asarray(rgb).shape[1] - 1), :3]
                about["brightness"] = float((shown @ GREY).mean()) / 255
            seen[place].append((one.quality, [frame.number, round(one.visible, 3), *edges], about))


def _worst_last(found: tuple[float, list[Any], Document]) -> float:
    return -found[0]


def _summary(views: Sequence[tuple[float, list[Any], Document]]) -> Document:
    """Return how an object was seen, as explanations have it: how often, from where, how much of it, in which light."""
    if not views:
        return {"times_seen": 0}
    about = [each for _, _, each in views]
    told: Document = {
        "times_seen": len(views),
        "nearest_m": min(each["distance_m"] for each in about),
        "visible": max(each["visible"] for each in about),
    }
    return told | {key: about[0][key] for key in ("brightness",) if key in about[0]}


def _hidden_edges(box: Box | None, frame: Frame, camera: Camera, scene: Scene) -> str | None:
    """Return which stretches of a box's edges something is before: bits in base64, edge by edge."""
    if box is None:
        return None
    signs = np.array([[corner >> axis & 1 for axis in range(3)] for corner in range(8)]) - 0.5
    corners = np.array(box.centroid) + signs * np.array(box.extent)
    shares = ((np.arange(STRETCHES) + 0.5) / STRETCHES)[:, None]
    starts, ends = corners[EDGES[:, 0]][:, None], corners[EDGES[:, 1]][:, None]
    points = (starts + shares * (ends - starts)).reshape(-1, 3)
    before = camera.seen_from(frame.base, points)[:, 2] > NEAREST_M
    bits = np.zeros(len(points), bool)
    if before.any():
        bits[before] = hidden(points[before], Boxes.of([(box.centroid, box.extent)]), frame, camera, scene)
    return _base64(np.packbits(bits))


def _scaled(pixels: NDArray[np.intp], depth: NDArray[Any], rgb: Any) -> NDArray[np.intp]:
    """Return where pixels of depth are in a picture that may be larger."""
    return pixels if rgb is None else pixels * max(np.asarray(rgb).shape[1] // depth.shape[1], 1)


def _pictures(
    folder: Path, number: int, observed: Mapping[str, Any], classes: dict[str, int], found: Recorded
) -> Document:
    """Write the pictures of an observation; return which there are."""
    made: Document = {}
    rgb = observed.get("image_rgb")
    if rgb is not None and number not in found.frames:
        _small(Image.fromarray(np.asarray(rgb)[..., :3])).save(folder / f"{number:05d}.jpg", quality=85)
    depth = observed.get("image_depth")
    if depth is not None:
        shown, far_m = _depth_picture(np.asarray(depth, np.float32))
        shown.save(folder / f"{number:05d}-depth.png")
        made["depth_m"] = far_m
    segments = observed.get("image_segment") or {}
    numbers = segments.get("class_segment_img")
    if numbers is not None:
        classes.update({str(name): int(value) for name, value in (segments.get("class_ids") or {}).items()})
        _class_picture(np.asarray(numbers), classes).save(folder / f"{number:05d}-classes.png")
        made["classes"] = True
    return made


def _small(image: Image.Image) -> Image.Image:
    if image.width <= WIDTH_PX:
        return image
    return image.resize((WIDTH_PX, max(round(image.height * WIDTH_PX / image.width), 1)), Image.Resampling.LANCZOS)


def _stepped(array: NDArray[Any]) -> NDArray[Any]:
    step = -(-array.shape[1] // WIDTH_PX)
    return array[::step, ::step]


def _depth_picture(depth: NDArray[np.float32]) -> tuple[Image.Image, float]:
    """Return a picture of depth in the colours of `ramp`, near is bright, and the depth in metres that is darkest."""
    depth = _stepped(depth)
    valid = np.isfinite(depth) & (depth > 0)
    far_m = float(np.ceil(np.percentile(depth[valid], 99))) if valid.any() else 1.0
    far_m = max(far_m, 1.0)
    levels = np.zeros(depth.shape, np.uint8)
    levels[valid] = 1 + np.clip(depth[valid] / far_m * 254, 0, 254).astype(np.uint8)
    colors = ramp().copy()
    colors[0] = (30, 30, 34)
    image = Image.fromarray(levels)
    image.putpalette(colors.tobytes())
    return image, far_m


def _class_picture(numbers: NDArray[Any], classes: Mapping[str, int]) -> Image.Image:
    numbers = _stepped(numbers)
    colors = class_colors(classes)
    palette = np.full((256, 3), UNKNOWN, np.uint8)
    palette[0] = BACKGROUND
    for name, number in classes.items():
        if 0 <= number < 256:
            palette[number] = BACKGROUND if name == "background" else colors[name]
    image = Image.fromarray(np.clip(numbers, 0, 255).astype(np.uint8))
    image.putpalette(palette.tobytes())
    return image


def _points(depth: NDArray[Any], camera: Camera, base: Pose) -> tuple[Points, NDArray[np.intp]]:
    """Return points in the map frame, (N, 3), and their pixels, (N, 2), row and column: of every few pixels one."""
    stride = max(round(STRIDE * depth.shape[1] / camera.width), 1)
    rows, columns = np.mgrid[stride // 2 : depth.shape[0] : stride, stride // 2 : depth.shape[1] : stride]
    distances = depth[rows, columns].astype(float)
    valid = np.isfinite(distances) & (distances > 0.05) & (distances < FARTHEST_M)
    rows, columns, distances = rows[valid], columns[valid], distances[valid]
    # A picture may be smaller than the declaration says.
    scale = depth.shape[1] / camera.width
    x = (columns + 0.5 - camera.cx * scale) / (camera.fx * scale) * distances
    y = (rows + 0.5 - camera.cy * scale) / (camera.fy * scale) * distances
    rotation, translation = matrix(base @ camera.mount)
    return np.stack([x, y, distances], 1) @ rotation.T + translation, np.stack([rows, columns], 1)


def matrix(pose: Pose) -> tuple[Points, Points]:
    """Return the rotation and the translation of a pose."""
    origin = np.array(pose.translation_xyz)
    axes = [np.array((pose @ Pose(axis)).translation_xyz) - origin for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    return np.stack(axes, 1), origin


class _Cloud:
    """Points of all frames, one for each voxel, with the frame that saw it first."""

    def __init__(self) -> None:
        self._parts: list[tuple[Points, NDArray[np.uint8], int, int]] = []

    def add(self, points: Points, pixels: NDArray[np.intp], rgb: Any, number: int, scene: int) -> None:
        kept = points[:, 2] < CEILING_M
        points, pixels = points[kept], pixels[kept]
        _, first = np.unique(np.floor(points / VOXELS_M[0]).astype(np.int32), axis=0, return_index=True)
        colors = np.full((len(points), 3), 150, np.uint8) if rgb is None else _colors(np.asarray(rgb), pixels)
        self._parts.append((points[first], colors[first], number, scene))

    def write(self, path: Path) -> bool:
        """Write the cloud, thinned out; return whether there is one."""
        if not self._parts:
            return False
        points = np.concatenate([part[0] for part in self._parts])
        colors = np.concatenate([part[1] for part in self._parts])
        numbers = np.concatenate([np.full(len(part[0]), part[2], np.uint16) for part in self._parts])
        scenes = np.concatenate([np.full(len(part[0]), part[3], np.uint8) for part in self._parts])
        for side_m in VOXELS_M:
            cells = np.column_stack([scenes, np.floor(points / side_m).astype(np.int32)])
            _, first = np.unique(cells, axis=0, return_index=True)
            if len(first) <= MOST_POINTS:
                break
        first = np.sort(first)[:MOST_POINTS]
        low = points[first].min(0)
        scale_m = max(float(np.ptp(points[first], axis=0).max()) / 65535, 1e-6)
        quantized = np.round((points[first] - low) / scale_m).astype("<u2")
        document = {
            "low": low.round(6).tolist(),
            "scale_m": scale_m,
            "points": _base64(quantized),
            "colors": _base64(colors[first]),
            "frames": _base64(numbers[first].astype("<u2")),
            "scenes": _base64(scenes[first]),
        }
        path.write_text(json.dumps(document), "utf-8")
        return True


def _colors(rgb: NDArray[np.uint8], pixels: NDArray[np.intp]) -> NDArray[np.uint8]:
    return rgb[pixels[:, 0].clip(max=rgb.shape[0] - 1), pixels[:, 1].clip(max=rgb.shape[1] - 1), :3]


def _base64(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _forget_old(kept: Path) -> None:
    """Remove what was not looked at for longest, until the cache is within its limit."""
    sizes = {folder: sum(path.stat().st_size for path in folder.iterdir()) for folder in _folders(kept.parent)}
    for folder in sorted(sizes, key=_looked_at_s):
        if sum(sizes.values()) <= MOST_BYTES:
            return
        if folder != kept:
            shutil.rmtree(folder, ignore_errors=True)
            del sizes[folder]


def _folders(parent: Path) -> Iterator[Path]:
    return (folder for folder in parent.iterdir() if folder.is_dir())


def _looked_at_s(folder: Path) -> float:
    with suppress(OSError):
        return (folder / "evidence.json").stat().st_mtime
    return time.time()  # it is being made
