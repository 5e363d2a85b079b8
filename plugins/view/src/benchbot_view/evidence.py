"""What a recording shows: pictures of each observation, a cloud of the points that were seen, and who saw which object.

It is worked out once for a recording, and kept in the user's cache.
"""

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
    hidden,
    numbered_frames,
    views_of,
)
from benchbot_view.cloud import Cloud, base64_of
from benchbot_view.pictures import class_picture, depth_picture, small

VERSION = 3
MOST_BYTES = 2 * 2**30
"""Of the cache; what was not looked at for longest goes first."""
DEPTH_PX = 320
"""The width of the depth that is kept to tell what is hidden."""
STRETCHES = 16
"""Of each edge of a box; each is hidden or not."""
NEAREST_M = 0.05
EDGES = np.array([(corner, corner | bit) for corner in range(8) for bit in (1, 2, 4) if not corner & bit])
"""The corners at the ends of each edge of a box, as `static/pictures.js` numbers them: bits are x, y, z."""
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
    cloud = Cloud()
    for number, path, observed in _observations(found):
        made = _pictures(folder, number, observed, document["classes"], found)
        document["frames"].append({"number": number, **made})
        if view.camera is None or number >= len(view.bases):
            continue
        scene, base = view.bases[number]
        depth = observed.get("image_depth")
        if depth is not None:
            document["measured"] = True
            cloud.add(np.asarray(depth), view.camera, base, observed.get("image_rgb"), number, scene)
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
    return base64_of(np.packbits(bits))


def _pictures(
    folder: Path, number: int, observed: Mapping[str, Any], classes: dict[str, int], found: Recorded
) -> Document:
    """Write the pictures of an observation; return which there are."""
    made: Document = {}
    rgb = observed.get("image_rgb")
    if rgb is not None and number not in found.frames:
        small(Image.fromarray(np.asarray(rgb)[..., :3])).save(folder / f"{number:05d}.jpg", quality=85)
    depth = observed.get("image_depth")
    if depth is not None:
        shown, far_m = depth_picture(np.asarray(depth, np.float32))
        shown.save(folder / f"{number:05d}-depth.png")
        made["depth_m"] = far_m
    segments = observed.get("image_segment") or {}
    numbers = segments.get("class_segment_img")
    if numbers is not None:
        classes.update({str(name): int(value) for name, value in (segments.get("class_ids") or {}).items()})
        class_picture(np.asarray(numbers), classes).save(folder / f"{number:05d}-classes.png")
        made["classes"] = True
    return made


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
