"""The camera's view: the picture of one channel of the newest observation, with a legend of its colours."""

import string
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from textual.content import Content

from benchbot.plugins.drawing.palette import INVALID, SHADES, UNLABELLED, Color, Pixels, class_colors, ramp
from benchbot.plugins.tui import panels
from benchbot.plugins.tui.raster import Picture, Raster, RasterPanel
from benchbot.plugins.watching.views import FeedSnapshot

LONGEST_LEGEND = 24
NO_CLASS = "."
_SPARE = string.ascii_uppercase + string.digits
_SHADES = np.frombuffer(SHADES.encode("ascii"), np.uint8)
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
_GREY_UNLABELLED, _GREY_LABELLED = np.float32(0.45), np.float32(0.3)
_ROUND_M = (0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)


@dataclass(frozen=True)
class Channel:
    """A channel that has a picture: its name on the wire, the name of its image in a snapshot, and its title."""

    name: str
    image: str
    title: str


CHANNELS = (
    Channel("image_rgb", "image_rgb", "colour"),
    Channel("image_depth", "image_depth", "depth"),
    Channel("image_segment", "image_class", "classes"),
)


def available(observations: Iterable[str]) -> list[Channel]:
    """Return the channels with a picture among the observations of a run."""
    names = set(observations)
    return [channel for channel in CHANNELS if channel.name in names]


def picture(snapshot: FeedSnapshot, channel: Channel) -> Picture | None:
    """Return the picture of a channel in a snapshot; None where the snapshot has none."""
    image = snapshot.images.get(channel.image)
    if image is None or not image.size:
        return None
    if channel.image == "image_rgb":
        return rgb(np.asarray(image, np.uint8))
    if channel.image == "image_depth":
        return depth(np.asarray(image, np.float32))
    return classes(image, snapshot.classes, snapshot.images.get("image_rgb"))


def rgb(image: NDArray[np.uint8]) -> Picture:
    """Return a colour image as it is; uint8 (H, W, 3)."""
    return Picture(np.ascontiguousarray(image[..., :3]))


def depth(depth_m: NDArray[np.float32]) -> Picture:
    """Return a depth image (H, W) in metres: near is bright, far is dark, invalid is a dull red.

    The farthest value is rounded up, so that the scale stays while the robot drives.
    """
    finite = np.isfinite(depth_m)
    # One far corner seen through a door must not make everything near look the same.
    far_m = float(np.percentile(depth_m[finite], 98)) if finite.any() else 1.0
    far_m = next((round_m for round_m in _ROUND_M if round_m >= far_m), _ROUND_M[-1])
    ranks = np.clip(np.nan_to_num(depth_m / far_m, nan=0.0, posinf=1.0, neginf=0.0) * 255, 0, 255).astype(np.uint8)
    pixels = ramp()[ranks]
    pixels[np.isnan(depth_m)] = INVALID
    near, middle, far = (_color(ramp()[rank]) for rank in (0, 128, 255))
    legend = [(near, "0 m"), (middle, f"{far_m / 2:g} m"), (far, f"{far_m:g} m and more")]
    if np.isnan(depth_m).any():
        legend.append((INVALID, "no value"))
    symbols = _SHADES[len(_SHADES) - 1 - ranks.astype(int) * len(_SHADES) // 256]
    symbols[np.isnan(depth_m)] = ord("?")
    marks = (chr(_SHADES[-1]), chr(_SHADES[len(_SHADES) // 2]), "' '", "?")[: len(legend)]
    return Picture(pixels, tuple(legend), symbols, marks)


def classes(image: NDArray[np.integer], ids: Mapping[str, int], behind: NDArray[np.uint8] | None = None) -> Picture:
    """Return a segmentation (H, W) with the colour of each class; the legend names visible classes, largest first.

    `ids` are the numbers of the classes by name; 0 is unlabelled. A colour image `behind` is blended in, in grey.
    """
    colors = class_colors(ids)
    names = {number: name for name, number in ids.items()}
    largest = int(image.max(initial=0))
    table = np.full((max(256, largest + 1), 3), UNLABELLED, np.uint8)
    for name, number in ids.items():
        if 0 < number < len(table):
            table[number] = colors[name]
    counts = np.bincount(image.ravel(), minlength=len(table))
    seen = [int(number) for number in np.argsort(-counts) if counts[number] and number]
    legend = [(_color(table[number]), names.get(number, f"class {number}")) for number in seen[:LONGEST_LEGEND]]
    marks = _letters([name for _, name in legend])
    symbols = np.full(len(table), ord(NO_CLASS), np.uint8)
    symbols[seen[:LONGEST_LEGEND]] = [ord(mark) for mark in marks]
    pixels = table[image]
    if behind is not None and behind.shape[:2] == image.shape:
        grey = (behind[..., :3] @ _LUMINANCE)[..., None]
        share = np.where(image == 0, _GREY_UNLABELLED, _GREY_LABELLED)[..., None]
        pixels = (pixels * (1 - share) + grey * share).astype(np.uint8)
    return Picture(pixels, tuple(legend), symbols[image], tuple(marks), exact=True)


class CameraPanel(RasterPanel):
    """Shows a channel of the newest snapshot; `show` with the same snapshot again costs nothing."""

    def __init__(self, box: Raster, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(box, id=id)
        self._key: tuple[object, ...] = ()
        self._seen: Picture | None = None

    @property
    def pixels_wide(self) -> int:
        """The number of pixels of the picture from left to right."""
        return self._box.pixels_wide

    def show(self, snapshot: FeedSnapshot | None, channel: Channel | None) -> None:
        """Show a channel of a snapshot, or why there is nothing to show; None is a run that has no such channel."""
        key = (snapshot, channel) if snapshot is None else (snapshot.number, channel, tuple(snapshot.images))
        if key == self._key:
            return
        self._key = key
        seen = None if snapshot is None or channel is None else picture(snapshot, channel)
        self.border_title = Content("Camera" if channel is None else f"Camera · {channel.title}")
        self.border_subtitle = f"observation {snapshot.number}" if snapshot is not None and seen is not None else ""
        self._box.show(seen, _why_nothing(snapshot, channel))
        self._seen = seen
        self._legend.display = seen is not None and bool(seen.legend)
        self.tell_legend()

    def tell_legend(self) -> None:
        """Fit the legend."""
        if self._seen is not None:
            marks = self._seen.marks if self.app.no_color else ()
            self._legend.tell(panels.legend(self._seen.legend, self.size.width - 2, marks))


def _why_nothing(snapshot: FeedSnapshot | None, channel: Channel | None) -> str:
    if channel is None:
        return "This run observes no picture."
    return "Nothing has been observed yet." if snapshot is None else f"Waiting for {channel.title} …"


def _letters(names: Sequence[str]) -> list[str]:
    """Return a different letter for each name, one of the name itself where possible."""
    found: list[str] = []
    for name in names:
        wanted = [*(letter for letter in name.upper() if letter.isascii() and letter.isalnum()), *_SPARE]
        found.append(next(letter for letter in wanted if letter not in found))
    return found


def _color(pixel: Pixels) -> Color:
    red, green, blue = pixel.tolist()
    return red, green, blue
