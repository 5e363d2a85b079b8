"""The recorder `frames`: what the robot's camera saw at each step, as JPEG files."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchbot.core.progress import Progress, Step

QUALITY = 92


class FramesRecording:
    """Writes `00000.jpg`, `00001.jpg`, … in the order in which a solution saw them."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: list[Path] = []
        folder.mkdir(parents=True, exist_ok=True)

    def reset(self) -> None:
        """Remove the frames of the episode that was given up."""
        for path in self._written:
            path.unlink(missing_ok=True)
        self._written.clear()

    def step(self, action: str | None, arguments: Mapping[str, Any], step: "Step", progress: "Progress") -> None:
        """Write the step's `image_rgb`, if the task observes it."""
        image = step.observations.get("image_rgb")
        if image is not None:
            from PIL import Image

            path = self._folder / f"{len(self._written):05d}.jpg"
            Image.fromarray(image).save(path, quality=QUALITY)
            self._written.append(path)

    def close(self) -> None:
        """Nothing to finish: every frame is a whole file."""
