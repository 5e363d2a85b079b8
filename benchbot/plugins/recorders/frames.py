"""The recorder `frames`: the images of the robot's camera at each step, as JPEG files."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.plugins.recorders.files import disk_errors

if TYPE_CHECKING:
    from benchbot.core.progress import Progress, Step

QUALITY = 92


class FramesRecording:
    """Writes `00000.jpg`, `00001.jpg`, …, after the number of the observation: one that is missing leaves a gap."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._written: list[Path] = []
        # One frame is written while the next one is taken.
        self._writer = ThreadPoolExecutor(max_workers=1)
        self._writing: Future[None] | None = None
        with disk_errors("frames", folder):
            folder.mkdir(parents=True, exist_ok=True)

    def reset(self) -> None:
        """Remove the frames of the abandoned episode."""
        self._wait()
        for path in self._written:
            path.unlink(missing_ok=True)
        self._written.clear()

    def step(self, action: str | None, arguments: Mapping[str, float], step: "Step", progress: "Progress") -> None:
        """Write the step's `image_rgb`, if the task observes it."""
        image = step.observations.get("image_rgb")
        if image is not None:
            self._wait()
            path = self._folder / f"{max(progress.frames - 1, 0):05d}.jpg"
            self._writing = self._writer.submit(_write, path, image)
            self._written.append(path)

    def close(self) -> None:
        """Finish the last frame."""
        try:
            self._wait()
        finally:
            self._writer.shutdown()

    def _wait(self) -> None:
        """Wait for the frame that is being written; raises BenchbotError when it cannot be."""
        writing, self._writing = self._writing, None
        if writing is not None:
            with disk_errors("frames", self._folder):
                writing.result()


def _write(path: Path, image: Any) -> None:
    from PIL import Image

    # Not straight into the file: on a full disk, Pillow takes a frame that is cut off for one that is written.
    encoded = BytesIO()
    Image.fromarray(image).save(encoded, "JPEG", quality=QUALITY)
    path.write_bytes(encoded.getbuffer())
