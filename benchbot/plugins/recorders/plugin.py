"""The recorders that need nothing else installed, and recording a run from another terminal."""

from collections.abc import Iterator

from benchbot.plugin import Command, Recorder, hookimpl, target

_HERE = "benchbot.plugins.recorders"


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "record", "benchbot.plugins.recorders.command:record", "Record a run that is under way, from another terminal."
    )


@hookimpl
def benchbot_recorders() -> Iterator[Recorder]:
    """Yield the recorders."""
    steps = "A line of JSON for each step: action, outcome, times, pose, digest."
    trajectory = "Where the robot was, as observed and in truth, as TUM files."
    yield Recorder("frames", target(f"{_HERE}.frames:FramesRecording"), "What the camera saw, as JPEG files.")
    yield Recorder("steps", target(f"{_HERE}.steps:StepsRecording"), steps)
    yield Recorder("trajectory", target(f"{_HERE}.trajectory:TrajectoryRecording"), trajectory)
