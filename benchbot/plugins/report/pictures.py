"""Small JPEG pictures for a page that needs no other file: what the camera saw, and boxes drawn into it."""

import base64
import io
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from PIL import Image, ImageDraw

from benchbot.plugins.drawing.camera import Box, Camera
from benchbot.plugins.drawing.map_drawing import Color
from benchbot.plugins.drawing.recorded_frames import Frame

QUALITY = 76
THUMBNAIL_PX = 300
CROP_PX = (300, 200)
BUDGET_BYTES = 2_400_000
"""Of all pictures of a page together, as JPEG; a third more in the page, which is to stay below 5 MB."""
_SMOOTHING = 2
# Something is to be seen of where a small object stands.
_LEAST_SHARE = 0.3

Outline = tuple[Box, Color]


@dataclass
class Budget:
    """How many bytes of pictures a page may still have."""

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


def _window(points: Sequence[tuple[float, float]], camera: Camera) -> tuple[float, float, float, float]:
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
