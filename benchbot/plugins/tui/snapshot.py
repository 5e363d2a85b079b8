"""Pictures of a moment, as PNG files: what the robot saw, channel by channel, and the map."""

import re
import time
from pathlib import Path

from PIL import Image
from textual.geometry import Size

from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing.palette import Pixels
from benchbot.plugins.tui import camera
from benchbot.plugins.tui.map_canvas import RunMap
from benchbot.plugins.watching.views import RunView

MAP_PX = Size(960, 720)
DEFAULT_FOLDER = Path("benchbot-snapshots")


def take(view: RunView, run_map: RunMap, folder: Path) -> list[Path]:
    """Write what a view shows into a folder, which is made; return the files. Raises BenchbotError."""
    pictures: dict[str, Pixels] = {}
    if view.snapshot is not None:
        for channel in camera.CHANNELS:
            seen = camera.picture(view.snapshot, channel)
            if seen is not None:
                pictures[channel.title] = seen.image
    pictures["map"] = run_map.pixels(MAP_PX, dark=False)
    step = view.progress.get("steps", 0)
    stem = f"{view.state.environment}-step{step}-{time.strftime('%Y%m%d-%H%M%S')}"
    stem = re.sub(r"[^\w.-]", "-", stem)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        paths = [folder / f"{stem}-{name}.png" for name in pictures]
        for path, pixels in zip(paths, pictures.values(), strict=True):
            Image.fromarray(pixels).save(path)
    except OSError as error:
        raise BenchbotError(
            "The snapshot cannot be written.",
            f"{error.filename or folder}: {error.strerror or error}.",
            "Free some disk space, or start benchbot tui in a folder that you may write to.",
        ) from error
    return [path.absolute() for path in paths]
