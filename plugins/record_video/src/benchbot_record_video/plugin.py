"""The plug-in's hook: two recorders. OpenCV and Pillow are imported when a recording starts."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Recorder, Recording, hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


def _video(folder: Path) -> Recording:
    from benchbot_record_video.h264 import VideoRecording

    return VideoRecording(folder)


def _gif(folder: Path) -> Recording:
    from benchbot_record_video.film import FilmRecording
    from benchbot_record_video.gif import GifFilm

    return FilmRecording(folder, "video.gif", GifFilm)


@hookimpl
def benchbot_recorders() -> Iterator[Recorder]:
    """Yield `video` and `gif`."""
    yield Recorder("video", _video, "What the camera saw, as an MP4 that browsers play; five observations a second.")
    yield Recorder("gif", _gif, "The same as an animated GIF, 480 pixels wide.")
