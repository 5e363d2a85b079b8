"""What the robot sees: one channel of its newest observation, with the legend of its colours."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from textual.app import ComposeResult
from textual.containers import Vertical

from benchbot.plugins.tui.watching import panels, pictures
from benchbot.plugins.tui.watching.pictures import Picture
from benchbot.plugins.tui.watching.raster import Raster, Still
from benchbot.plugins.watching.views import Look


@dataclass(frozen=True)
class Channel:
    """A channel that has a picture: its name on the wire, that of its image in a look, and its title."""

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


def picture(look: Look, channel: Channel) -> Picture | None:
    """Return what a look shows of a channel, None where it shows nothing of it."""
    image = look.images.get(channel.image)
    if image is None or not image.size:
        return None
    if channel.image == "image_rgb":
        return pictures.rgb(np.asarray(image, np.uint8))
    if channel.image == "image_depth":
        return pictures.depth(np.asarray(image, np.float32))
    return pictures.classes(image, look.classes, look.images.get("image_rgb"))


class Camera(Vertical):
    """Shows a channel; `Camera.show` with the look that it shows already costs nothing."""

    DEFAULT_CSS: ClassVar[str] = """
    Camera {
        border: round $foreground 25%; border-title-color: $foreground 70%;
        border-subtitle-color: $foreground 50%; width: 1fr; height: 1fr;
    }
    Camera > Words { height: 1; }
    """

    def __init__(self, box: Raster, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(id=id)
        self._box = box
        self._legend = panels.Words()
        self._key: tuple[object, ...] = ()
        self._seen: Picture | None = None

    def compose(self) -> ComposeResult:
        """Lay out the picture and its legend."""
        yield self._box
        yield self._legend

    @property
    def pixels_wide(self) -> int:
        """How many pixels there are for the picture, from left to right."""
        return self._box.pixels_wide

    def show(self, look: Look | None, channel: Channel | None) -> None:
        """Show a channel of a look, or why there is nothing to show; None is a run that has no such channel."""
        key = (look, channel) if look is None else (look.number, channel, tuple(look.images))
        if key == self._key:
            return
        self._key = key
        seen = None if look is None or channel is None else picture(look, channel)
        self.border_title = "Camera" if channel is None else f"Camera · {channel.title}"
        self.border_subtitle = f"observation {look.number}" if look is not None and seen is not None else ""
        self._box.show(None if seen is None else Still(seen), _why_nothing(look, channel))
        self._seen = seen
        self._legend.display = seen is not None and bool(seen.legend)
        self._tell_legend()

    def on_resize(self) -> None:
        """Fit the legend."""
        self._tell_legend()

    def _tell_legend(self) -> None:
        if self._seen is not None:
            marks = self._seen.marks if self.app.no_color else ()
            self._legend.tell(panels.legend(self._seen.legend, self.size.width - 2, marks))


def _why_nothing(look: Look | None, channel: Channel | None) -> str:
    if channel is None:
        return "This run observes no picture."
    return "Nothing has been observed yet." if look is None else f"Waiting for {channel.title} …"
