"""The recorder `frames`: the images of the robot's camera at each step, as JPEG files, and what tells what is hidden.

Of depth and instances, as far as the task observes them, small lossless pictures are kept: every n-th pixel, so that
they are at most so wide, from n // 2 on. Nothing is in them that the solution was not shown.
"""

import json
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.plugins.recorders.files import disk_errors

if TYPE_CHECKING:
    from benchbot.core.progress import Progress, Step

QUALITY = 92
WIDEST_PX = 320
TOO_FAR_MM = 65535
_COMPRESSION = 4


class FramesRecording:
    """Writes `00000.jpg`, `00001.jpg`, …, after the number of the observation: one that is missing leaves a gap.

    Beside each, `00000.depth.png` has whole millimetres (16 bits; 0: not measured, 65535: too far), and
    `00000.instances.png` the numbers of instances, 1000 times their class and more; `classes.json` has the classes.
    """

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
        """Write the step's `image_rgb`, if the task observes it, and its depth and instances."""
        image, depth_m = (step.observations.get(name) for name in ("image_rgb", "image_depth"))
        segments = step.observations.get("image_segment")
        if image is None:
            return
        self._wait()
        number = f"{max(progress.frames - 1, 0):05d}"
        pictures = {f"{number}.jpg": image}
        if depth_m is not None:
            pictures[f"{number}.depth.png"] = _millimetres(_thinned(depth_m))
        if segments is not None:
            pictures[f"{number}.instances.png"] = _thinned(segments["instance_segment_img"])
            self._classes(segments["class_ids"])
        written = {self._folder / name: picture for name, picture in pictures.items()}
        self._writing = self._writer.submit(_write, written)
        self._written += written

    def close(self) -> None:
        """Finish the last frame."""
        try:
            self._wait()
        finally:
            self._writer.shutdown()

    def _classes(self, class_ids: Mapping[str, int]) -> None:
        path = self._folder / "classes.json"
        if path not in self._written:
            with disk_errors("frames", self._folder):
                path.write_text(json.dumps(class_ids), "utf-8")
            self._written.append(path)

    def _wait(self) -> None:
        """Wait for the frame that is being written; raises BenchbotError when it cannot be."""
        writing, self._writing = self._writing, None
        if writing is not None:
            with disk_errors("frames", self._folder):
                writing.result()


def _thinned(picture: Any) -> Any:
    step = -(-picture.shape[1] // WIDEST_PX)
    return picture[step // 2 :: step, step // 2 :: step]


def _millimetres(depth_m: Any) -> Any:
    import numpy as np

    whole = np.nan_to_num(np.rint(depth_m * 1000.0), nan=0.0, posinf=TOO_FAR_MM, neginf=0.0)
    return np.clip(whole, 0, TOO_FAR_MM).astype(np.uint16)


def _write(pictures: Mapping[Path, Any]) -> None:
    from PIL import Image

    for path, picture in pictures.items():
        # Not straight into the file: on a full disk, Pillow takes a frame that is cut off for one that is written.
        encoded = BytesIO()
        if path.suffix == ".jpg":
            Image.fromarray(picture).save(encoded, "JPEG", quality=QUALITY)
        else:
            Image.fromarray(picture).save(encoded, "PNG", compress_level=_COMPRESSION)
        path.write_bytes(encoded.getbuffer())
