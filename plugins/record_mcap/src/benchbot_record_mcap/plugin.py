"""The plug-in's hook: one recorder. The libraries that write MCAP are imported when a recording starts."""

from collections.abc import Iterator

from benchbot.plugin import Recorder, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_recorders() -> Iterator[Recorder]:
    """Yield `mcap`."""
    create = target("benchbot_record_mcap.recording:McapRecording")
    read = target("benchbot_record_mcap.reading:read")
    yield Recorder("mcap", create, "Everything, as ROS 2 messages in MCAP: for Foxglove and ros2 bag.", read)
