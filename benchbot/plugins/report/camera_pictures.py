"""Small JPEG pictures for a page that needs no other file: what the camera saw, and boxes drawn into it."""

import base64
import io
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchbot.evaluation.evidence import NEAREST_M, Boxes, Camera, Floats, Scene, hidden
from benchbot.evaluation.frames import Frame, folders_of, frames_at
from benchbot.plugins.drawing.map_model import Box
from benchbot.plugins.drawing.palette import Color
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode

QUALITY = 76
THUMBNAIL_PX = 300
CROP_PX = (300, 200)
BUDGET_BYTES = 2_400_000
"""Of all pictures of a page together, as JPEG; a third more in the page, which is to stay below 5 MB."""
_SMOOTHING = 2
# Something is to be seen of where a small object stands.
_LEAST_SHARE = 0.3
_EDGES = [(i, j) for i, j in itertools.combinations(range(8), 2) if (i ^ j) in (1, 2, 4)]
_POINTS_OF_EDGE, _DASH = 61, 3
_FONT_PX = 25


@dataclass(frozen=True)
class Outline:
    """A box to draw into a picture, its colour, and what is written beside it."""

    box: Box
    color: Color
    text: str = ""


@dataclass(frozen=True)
class Shot:
    """A frame to draw boxes into, the camera that took it, and what may stand before them."""

    frame: Frame
    camera: Camera
    scene: Scene

    def lines(self, box: Box) -> list[tuple[Floats, bool]]:
        """Return the edges of a box in pixels as stretches (N, 2), and whether each is hidden; without a lens, none."""
        boxes = Boxes.of([(box.centroid, box.extent)])
        corners = boxes.corners()[0]
        shares = np.linspace(0.0, 1.0, _POINTS_OF_EDGE)[:, None]
        starts, ends = (corners[[edge[i] for edge in _EDGES]][:, None] for i in (0, 1))
        points = (starts + shares * (ends - starts)).reshape(-1, 3)
        seen = self.camera.seen_from(self.frame.base, points)
        before = seen[:, 2] > NEAREST_M
        if not before.any():
            return []
        pixels = self.camera.pixels(seen[before])
        behind = hidden(points[before], boxes, self.frame, self.camera, self.scene)
        places = np.append(0, np.cumsum(before.reshape(len(_EDGES), -1).sum(axis=1)))
        found: list[tuple[Floats, bool]] = []
        for first, last in itertools.pairwise(places.tolist()):
            of_edge = behind[first:last]
            breaks = [0, *(np.flatnonzero(np.diff(of_edge)) + 1).tolist(), last - first]
            # A stretch ends where the next one begins.
            stretches = [(pixels[first:last][a : b + 1], a) for a, b in itertools.pairwise(breaks)]
            found += [(stretch, bool(of_edge[a])) for stretch, a in stretches if len(stretch) > 1]
        return found


def frames_of(episode: ReportedEpisode, data: ReportData) -> list[Frame]:
    """Return an episode's frames, in order; none when there are not as many as the robot made observations.

    They are looked for in `STEM-recordings/frames` and `STEM.frames` beside `STEM.json`, and in `frames` when no other
    result of the report lies in the same folder.
    """
    poses = [(scene, pose) for scene, path in enumerate(episode.paths) for pose in path.observed]
    if data.frames is not None:
        return frames_at(poses, [data.frames])
    folder = Path(episode.source or "").parent
    neighbours = [other for other in data.episodes if other.source and Path(other.source).parent == folder]
    return frames_at(poses, folders_of(episode.source, alone=len(neighbours) == 1))


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


def crop(shot: Shot, outlines: Sequence[Outline], budget: Budget) -> str | None:
    """Return the part of a frame around boxes as a data URI, None when it cannot be shown; see `tile`."""
    picture = tile(shot, outlines)
    return None if picture is None else budget.data_uri(picture)


def tile(shot: Shot, outlines: Sequence[Outline]) -> Image.Image | None:
    """Return the part of a frame around boxes, 300 x 200 pixels, the boxes as wire frames, hidden edges dashed.

    None when the frame cannot be read, or shows nothing of the boxes.
    """
    image, camera = _opened(shot.frame), shot.camera
    if image is None or image.size != (camera.width, camera.height):
        return None
    lines = [shot.lines(outline.box) for outline in outlines]
    drawn = [pixels for stretches in lines for pixels, _ in stretches]
    if not drawn:
        return None
    left, top, right, bottom = _window(np.concatenate(drawn), camera)
    scale = CROP_PX[0] * _SMOOTHING / (right - left)
    large = (CROP_PX[0] * _SMOOTHING, CROP_PX[1] * _SMOOTHING)
    part = image.resize(large, Image.Resampling.BICUBIC, box=(left, top, right, bottom))
    pencil = ImageDraw.Draw(part)
    for is_behind in (True, False):
        for width, shade in ((7, (0, 0, 0)), (3, None)):
            for stretches, outline in zip(lines, outlines, strict=True):
                for pixels, behind in stretches:
                    if behind == is_behind:
                        _draw((pixels - (left, top)) * scale, pencil, shade or outline.color, width, dashed=behind)
    taken: list[tuple[float, float, float, float]] = []
    for stretches, outline in zip(lines, outlines, strict=True):
        if stretches and outline.text:
            places = (np.concatenate([pixels for pixels, _ in stretches]) - (left, top)) * scale
            taken.append(_write(pencil, outline, places, large, taken))
    return part.resize(CROP_PX, Image.Resampling.LANCZOS)


def _draw(points: Floats, pencil: ImageDraw.ImageDraw, color: Color, width: int, *, dashed: bool) -> None:
    if not dashed:
        pencil.line([*map(tuple, points[[0, -1]].tolist())], fill=color, width=width)
        return
    # Dashes are as long in the picture, however the edge runs.
    length = float(np.hypot(*(points[-1] - points[0])))
    count = max(round(length / (6 * _DASH)), 1)
    for number in range(count):
        ends = points[0] + (points[-1] - points[0]) * np.array([[number / count], [(number + 0.45) / count]])
        pencil.line([*map(tuple, ends.tolist())], fill=color, width=max(width - 1, 1))


def _write(
    pencil: ImageDraw.ImageDraw,
    outline: Outline,
    places: Floats,
    size: tuple[int, int],
    taken: Sequence[tuple[float, float, float, float]],
) -> tuple[float, float, float, float]:
    """Write the text of a box above it, below it or within, where no other text is; return where."""
    font = ImageFont.load_default(_FONT_PX)
    _, _, width, height = font.getbbox(outline.text)
    width, height = width + 12, height + 8
    (x0, y0), (x1, y1) = places.min(axis=0), places.max(axis=0)
    x = float(np.clip((x0 + x1 - width) / 2, 0, max(size[0] - width, 0)))
    tops = [float(np.clip(y, 0, size[1] - height)) for y in (y0 - height - 6, y1 + 6, y0 + 6, y1 - height - 6, 0)]
    tops += [float(y) for y in range(0, round(size[1] - height), round(height / 2))]
    boxes = [(x, top, x + width, top + height) for top in tops]
    chosen = next((box for box in boxes if all(box[3] <= other[1] or other[3] <= box[1] for other in taken)), boxes[0])
    pencil.rounded_rectangle(chosen, radius=6, fill=(16, 18, 22))
    pencil.text((x + 6, chosen[1] + 2), outline.text, fill=outline.color, font=font)
    return chosen


def _window(points: Floats, camera: Camera) -> tuple[float, float, float, float]:
    """Return the part of the picture to show: 3 : 2, around the points, inside the picture."""
    (least_x, least_y), (most_x, most_y) = (
        np.clip(ends, 0.0, (camera.width, camera.height)).tolist() for ends in (points.min(0), points.max(0))
    )
    aspect = CROP_PX[0] / CROP_PX[1]
    most = min(float(camera.width), camera.height * aspect)
    wanted = 1.6 * max(most_x - least_x, (most_y - least_y) * aspect)
    width = min(max(wanted, camera.width * _LEAST_SHARE), most)
    height = width / aspect
    left = min(max((least_x + most_x - width) / 2, 0.0), camera.width - width)
    top = min(max((least_y + most_y - height) / 2, 0.0), camera.height - height)
    return left, top, left + width, top + height


def _opened(frame: Frame) -> Image.Image | None:
    try:
        return Image.open(frame.path).convert("RGB")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
