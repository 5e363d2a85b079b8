"""An MP4 that is whole after every few seconds of film, whatever happens to the process that writes it.

OpenCV encodes VP9, which every browser plays, but ends an MP4 with the table that says where its frames are: a film
that is cut off is none. So it encodes segments, whose frames are appended as fragments with a table of their own.
"""

import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchbot_record_video import boxes
from benchbot_record_video.film import FRAMES_PER_S

SEGMENT_FRAMES = 5 * FRAMES_PER_S
CODEC = "vp09"


class FragmentedFilm:
    """A film written to a path in segments. Raises OSError if it cannot be written; the file is then as before."""

    def __init__(self, path: Path) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="benchbot-video-")
        self._segment = Path(self._folder.name) / "segment.mp4"
        self._writer: cv2.VideoWriter | None = None
        self._waiting = self._number = self._time = self._size = 0
        # Without a buffer: what is written is the system's to keep.
        self._file = path.open("wb", buffering=0)

    def add(self, image: NDArray[np.uint8]) -> None:
        """Append a frame."""
        if self._writer is None:
            height, width, _ = image.shape
            code = cv2.VideoWriter.fourcc(*CODEC)
            self._writer = cv2.VideoWriter(str(self._segment), cv2.CAP_FFMPEG, code, FRAMES_PER_S, (width, height))
            if not self._writer.isOpened():
                raise OSError("OpenCV cannot encode VP9 here")
        self._writer.write(cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
        self._waiting += 1
        if self._waiting == SEGMENT_FRAMES:
            self._append()

    def close(self) -> None:
        """Append what is left, and close the file."""
        try:
            self._append()
        finally:
            self._file.close()
            self._folder.cleanup()

    def _append(self) -> None:
        writer, self._writer = self._writer, None
        waiting, self._waiting = self._waiting, 0
        if writer is None:
            return
        writer.release()
        try:
            segment = boxes.read_segment(self._segment.read_bytes())
        except ValueError as error:
            raise OSError(f"There is no room for a segment in {self._folder.name}: {error}") from error
        if len(segment.samples) != waiting:
            raise OSError(f"OpenCV has encoded {len(segment.samples)} of {waiting} frames")
        start = b"" if self._number else boxes.file_start(segment)
        self._write(start + boxes.fragment(segment, self._number + 1, self._time))
        self._number += 1
        self._time += len(segment.samples) * segment.duration

    def _write(self, data: bytes) -> None:
        left = memoryview(data)
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            self._file.truncate(self._size)
            raise
        self._size += len(data)
