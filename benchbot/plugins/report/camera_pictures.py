"""Small JPEG pictures for a page that needs no other file: what the camera saw, and boxes drawn into it."""

import base64
import io
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw

from benchbot.core.geometry import Pose
from benchbot.core.recording import RecordingNote
from benchbot.plugins.drawing.map_model import Box, Point, Vector
from benchbot.plugins.drawing.palette import Color
from benchbot.plugins.drawing.scene_maps import frame_folders, numbered_frames
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode

QUALITY = 76
THUMBNAIL_PX = 300
CROP_PX = (300, 200)
BUDGET_BYTES = 2_400_000
"""Of all pictures of a page together, as JPEG; a third more in the page, which is to stay below 5 MB."""
NEAREST_M = 0.1
_LARGEST_AREA = 1e4
_SMOOTHING = 2
# Something is to be seen of where a small object stands.
_LEAST_SHARE = 0.3
_EDGES = [(i, j) for i, j in itertools.combinations(range(8), 2) if (i ^ j) in (1, 2, 4)]

Outline = tuple[Box, Color]


@dataclass(frozen=True)
class Frame:
    """A recorded picture: its file, the scene, and the pose of the robot's base in the map frame."""

    path: Path
    scene: int
    base: Pose


def frames_of(episode: ReportedEpisode, data: ReportData) -> list[Frame]:
    """Return an episode's frames, in order; none when there are not as many as the robot made observations.

    They are looked for in `STEM-recordings/frames` and `STEM.frames` beside `STEM.json`, and in `frames` when no other
    result of the report lies in the same folder.
    """
    poses = [(scene, pose) for scene, path in enumerate(episode.paths) for pose in path.observed]
    for folder in _folders(episode, data):
        paths = numbered_frames(folder)
        note = RecordingNote.read(folder)
        missing = 0 if note is None else note.dropped
        if paths and len(paths) + missing == len(poses) and max(paths) < len(poses):
            return [Frame(path, *poses[number]) for number, path in paths.items()]
    return []


def _folders(episode: ReportedEpisode, data: ReportData) -> list[Path]:
    if data.frames is not None:
        return [data.frames]
    # A result in an archive is named `archive:member`, which is no file.
    if episode.source is None or not Path(episode.source).is_file():
        return []
    path = Path(episode.source)
    neighbours = [other for other in data.episodes if other.source and Path(other.source).parent == path.parent]
    beside = frame_folders(path)
    return beside if len(neighbours) == 1 else beside[:-1]


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
    def of(cls, robot: Mapping[str, Any] | None) -> "Camera | None":
        """Return the camera that a robot's declaration describes, None when it describes none."""
        camera = (robot or {}).get("camera")
        frame = (robot or {}).get("frames", {}).get((camera or {}).get("frame"))
        if camera is None or frame is None:
            return None
        mount = Pose.from_xyz_rpy_deg(frame["xyz"], frame.get("rpy_deg", (0, 0, 0)))
        return cls(mount, *(camera[key] for key in ("width", "height", "fx", "fy", "cx", "cy")))

    def pixels(self, base: Pose, points: Sequence[Vector]) -> list[Point] | None:
        """Return where points of the map appear when the robot is at `base`; None when one is not before the lens."""
        to_camera = (base @ self.mount).inverse()
        seen = []
        for point in points:
            x, y, z = (to_camera @ Pose(point)).translation_xyz
            if z < NEAREST_M:
                return None
            seen.append((self.fx * x / z + self.cx, self.fy * y / z + self.cy))
        return seen

    def edges(self, base: Pose, box: Box) -> list[tuple[Point, Point]]:
        """Return the twelve edges of a box as lines in the picture, none when it is not before the lens."""
        corners = self.pixels(base, box.corners)
        return [] if corners is None else [(corners[i], corners[j]) for i, j in _EDGES]

    def view_of(self, base: Pose, box: Box, others: Sequence[Box] = ()) -> float:
        """Return how well a box can be seen from `base`, 0 for not at all.

        Better is larger, whole, and not behind one of `others`.
        """
        corners = self.pixels(base, box.corners)
        if corners is None:
            return 0.0
        left, right = min(x for x, _ in corners), max(x for x, _ in corners)
        top, bottom = min(y for _, y in corners), max(y for _, y in corners)
        area = max((right - left) * (bottom - top), 1e-9)
        if not area < _LARGEST_AREA * self.width * self.height:
            return 0.0
        width = min(right, self.width) - max(left, 0.0)
        height = min(bottom, self.height) - max(top, 0.0)
        inside = max(width, 0.0) * max(height, 0.0) / area
        size = min(math.sqrt(area / (self.width * self.height)), 0.5)
        eye = (base @ self.mount).translation_xyz
        hidden = any(other.is_between(eye, box.centroid) for other in others)
        return inside**2 * size * (0.1 if hidden else 1.0)


@dataclass
class Budget:
    """The bytes of pictures that a page may still have."""

    left: int = BUDGET_BYTES
    refused: int = 0

    def takes(self, size: int) -> bool:
        """Say whether there is room for so many bytes, and keep it for them."""
        if size > self.left:
            self.refused += 1
            return False
        self.left -= size
        return True

    def data_uri(self, image: Image.Image) -> str | None:
        """Return a picture as a data URI, None when there is no room for it."""
        buffer = io.BytesIO()
        image.save(buffer, "JPEG", quality=QUALITY, optimize=True)
        if not self.takes(buffer.tell()):
            return None
        return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode()


def thumbnail(frame: Frame, budget: Budget) -> str | None:
    """Return a frame, at most 300 pixels wide, as a data URI; None when it is no readable picture."""
    image = _opened(frame)
    if image is None:
        return None
    height = max(round(image.height * THUMBNAIL_PX / image.width), 1)
    return budget.data_uri(image.resize((THUMBNAIL_PX, height), Image.Resampling.LANCZOS))


def best_frame(frames: Sequence[Frame], camera: Camera, box: Box, scene: int, others: Sequence[Box]) -> Frame | None:
    """Return the frame in which a box should be seen best, None when it is in none of them."""
    seen = [(camera.view_of(frame.base, box, others), frame) for frame in frames if frame.scene == scene]
    quality, frame = max(seen, key=lambda pair: pair[0], default=(0.0, None))
    return frame if quality > 0 else None


def crop(frame: Frame, camera: Camera, outlines: Sequence[Outline], budget: Budget) -> str | None:
    """Return the part of a frame around boxes, 300 x 200 pixels, the boxes drawn as wire frames, as a data URI."""
    image = _opened(frame)
    if image is None or image.size != (camera.width, camera.height):
        return None
    lines = [(camera.edges(frame.base, box), color) for box, color in outlines]
    points = [point for edges, _ in lines for point in itertools.chain.from_iterable(edges)]
    left, top, right, bottom = _window(points, camera)
    scale = CROP_PX[0] * _SMOOTHING / (right - left)
    large = (CROP_PX[0] * _SMOOTHING, CROP_PX[1] * _SMOOTHING)
    part = image.resize(large, Image.Resampling.BICUBIC, box=(left, top, right, bottom))
    pencil = ImageDraw.Draw(part)
    for width, shade in ((7, (0, 0, 0)), (3, None)):
        for edges, color in lines:
            for (x0, y0), (x1, y1) in edges:
                ends = ((x0 - left) * scale, (y0 - top) * scale, (x1 - left) * scale, (y1 - top) * scale)
                pencil.line(ends, fill=shade or color, width=width)
    return budget.data_uri(part.resize(CROP_PX, Image.Resampling.LANCZOS))


def _window(points: Sequence[Point], camera: Camera) -> tuple[float, float, float, float]:
    """Return the part of the picture to show: 3 : 2, around the points, inside the picture."""
    xs, ys = [x for x, _ in points], [y for _, y in points]
    aspect = CROP_PX[0] / CROP_PX[1]
    most = min(float(camera.width), camera.height * aspect)
    wanted = 1.6 * max(max(xs) - min(xs), (max(ys) - min(ys)) * aspect)
    width = min(max(wanted, camera.width * _LEAST_SHARE), most)
    height = width / aspect
    left = min(max((min(xs) + max(xs) - width) / 2, 0.0), camera.width - width)
    top = min(max((min(ys) + max(ys) - height) / 2, 0.0), camera.height - height)
    return left, top, left + width, top + height


def _opened(frame: Frame) -> Image.Image | None:
    try:
        return Image.open(frame.path).convert("RGB")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
