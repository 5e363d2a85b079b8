"""What ships in the box, registered through the same hooks as anybody's plug-in."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.core.hookspecs import Executor, Recorder, Workers, WorkOrder, hookimpl
from benchbot.core.recording import Recording

_FOLDER = Path(__file__).parent


@hookimpl
def benchbot_formats() -> Iterator[Path]:
    """Yield the formats of object maps and of their ground truths."""
    yield _FOLDER / "formats"


@hookimpl
def benchbot_examples() -> Iterator[Path]:
    """Yield the first solutions to read and to run."""
    yield _FOLDER / "examples"


@hookimpl
def benchbot_recorders() -> Iterator[Recorder]:
    """Yield the recorders that need nothing else installed."""
    yield Recorder("frames", _record_frames, "What the camera saw, as JPEG files.")
    yield Recorder("steps", _record_steps, "A line of JSON for each step: action, outcome, times, pose, digest.")
    yield Recorder("trajectory", _record_trajectory, "Where the robot was, as observed and in truth, as TUM files.")


@hookimpl
def benchbot_executors() -> Iterator[Executor]:
    """Yield the executor that runs the workers of a batch on this machine."""
    yield Executor("local", _launch_locally, _attach_locally, "Processes of this machine.")


def _launch_locally(order: WorkOrder) -> Workers:
    from benchbot.plugins.local_executor import workers

    return workers.launch(order)


def _attach_locally(reference: str) -> Workers:
    from benchbot.plugins.local_executor import workers

    return workers.attach(reference)


def _record_frames(folder: Path) -> Recording:
    from benchbot.plugins.recorders.frames import FramesRecording

    return FramesRecording(folder)


def _record_steps(folder: Path) -> Recording:
    from benchbot.plugins.recorders.steps import StepsRecording

    return StepsRecording(folder)


def _record_trajectory(folder: Path) -> Recording:
    from benchbot.plugins.recorders.trajectory import TrajectoryRecording

    return TrajectoryRecording(folder)
