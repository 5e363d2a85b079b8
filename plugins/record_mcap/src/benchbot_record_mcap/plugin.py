"""The plug-in's hook: one recorder. The libraries that write MCAP are imported when a recording starts."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Recorder, Recording, hookimpl


def _create(folder: Path) -> Recording:
    from benchbot_record_mcap.recording import McapRecording

    return McapRecording(folder)


@hookimpl
def benchbot_recorders() -> Iterator[Recorder]:
    """Yield `mcap`."""
    yield Recorder("mcap", _create, "Everything, as ROS 2 messages in MCAP: for Foxglove and ros2 bag.")
