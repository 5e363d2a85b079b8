"""The recorder `frames`: what the robot's camera saw at each step, as JPEG files."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
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
        # One frame is written while the next one is taken.
        self._writer = ThreadPoolExecutor(max_workers=1)
        self._writing: Future[None] | None = None
        folder.mkdir(parents=True, exist_ok=True)

    def reset(self) -> None:
        """Remove the frames of the episode that was given up."""
        self._wait()
        for path in self._written:
            path.unlink(missing_ok=True)
        self._written.clear()

    def step(self, action: str | None, arguments: Mapping[str, Any], step: "Step", progress: "Progress") -> None:
        """Write the step's `image_rgb`, if the task observes it."""
        image = step.observations.get("image_rgb")
        if image is not None:
            from PIL import Image

            self._wait()
            path = self._folder / f"{len(self._written):05d}.jpg"
            self._writing = self._writer.submit(Image.fromarray(image).save, path, quality=QUALITY)
            self._written.append(path)

    def close(self) -> None:
        """Finish the last frame."""
        self._wait()
        self._writer.shutdown()

    def _wait(self) -> None:
        """Wait for the frame that is being written; raises what went wrong with it."""
        writing, self._writing = self._writing, None
        if writing is not None:
            writing.result()
