"""The same film in H.264, which also plays where VP9 does not: in QuickTime, PowerPoint and on older phones.

OpenCV's wheels have no encoder for it; PyAV's, if it is installed, have x264.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import Progress, Step
from benchbot_record_video.film import FRAMES_PER_S, FilmRecording
from benchbot_record_video.fragmented import CODEC, SEGMENT_FRAMES, FragmentedFilm

ENCODERS = ("libx264", "libopenh264")
"""Encoders that need no device, the best first."""
FILM, NOTE = "video.h264.mp4", "codecs.json"


def encoder() -> str | None:
    """Return the name of the encoder that is there, None where PyAV is not installed or has none."""
    try:
        import av
    except ImportError:
        return None
    return next((name for name in ENCODERS if name in av.codecs_available), None)


class H264Film:
    """A film in H.264, in fragments: what a process leaves that is killed can be played. Raises OSError."""

    def __init__(self, path: Path, codec: str) -> None:
        import av

        self._errors = av.error.FFmpegError
        self._file = path.open("wb", buffering=0)
        options = {"movflags": "frag_keyframe+empty_moov+default_base_moof"}
        container: Any = av.open(self._file, "w", format="mp4", options=options)
        self._container = container
        self._stream = container.add_stream(codec, rate=FRAMES_PER_S)
        self._stream.options = {"crf": "20", "preset": "veryfast"} if codec == "libx264" else {}
        self._stream.pix_fmt = "yuv420p"
        self._stream.codec_context.gop_size = SEGMENT_FRAMES
        self._sized = False

    def add(self, image: NDArray[np.uint8]) -> None:
        """Append a frame; an odd last row or column is left out, as the format has none."""
        from av import VideoFrame

        height, width = (length - length % 2 for length in image.shape[:2])
        if not self._sized:
            self._stream.height, self._stream.width, self._sized = height, width, True
        self._mux(VideoFrame.from_ndarray(np.ascontiguousarray(image[:height, :width]), format="rgb24"))

    def close(self) -> None:
        """Write what is left, and close the file."""
        try:
            if self._sized:
                self._mux(None)
            self._container.close()
        except self._errors as error:
            raise OSError(f"FFmpeg cannot write it: {error}") from error
        finally:
            self._file.close()

    def _mux(self, frame: Any) -> None:
        try:
            for packet in self._stream.encode(frame):
                self._container.mux(packet)
        except self._errors as error:
            raise OSError(f"FFmpeg cannot write it: {error}") from error


class VideoRecording:
    """Writes `video.mp4` (VP9), `video.h264.mp4` where an encoder is installed, and `codecs.json`: what made them."""

    def __init__(self, folder: Path) -> None:
        self._films = [FilmRecording(folder, "video.mp4", FragmentedFilm)]
        made = {"video.mp4": f"VP9 ({CODEC}), OpenCV {cv2.__version__}"}
        codec = encoder()
        if codec is not None:
            import av

            self._films.append(FilmRecording(folder, FILM, lambda path: H264Film(path, codec)))
            made[FILM] = f"H.264 ({codec}), PyAV {av.__version__}"
        with self._films[0].told():
            (folder / NOTE).write_text(json.dumps(made, indent=1) + "\n", "utf-8")

    def reset(self) -> None:
        """Start the films over."""
        for film in self._films:
            film.reset()

    def step(self, action: str | None, arguments: Mapping[str, float], step: Step, progress: Progress) -> None:
        """Add a frame to each, if the task observes one."""
        for film in self._films:
            film.step(action, arguments, step, progress)

    def close(self) -> None:
        """Finish the films. Safe to call twice."""
        for film in self._films:
            film.close()
