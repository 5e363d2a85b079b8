"""The plug-in's hook: one recorder. Rerun, which is large, is imported when a recording starts."""

import os
from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Recorder, Recording, hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


def _create(folder: Path) -> Recording:
    # What goes wrong is raised. Rerun would also print it, and hang where that cannot be printed: on a full disk.
    os.environ.setdefault("RUST_LOG", "off")
    from benchbot_record_rerun.recording import RerunRecording

    return RerunRecording(folder)


@hookimpl
def benchbot_recorders() -> Iterator[Recorder]:
    """Yield `rerun`."""
    yield Recorder("rerun", _create, "Pictures, depth, poses, way and laser, for the Rerun viewer (.rrd).")
