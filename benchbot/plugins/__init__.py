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
    """Yield the recorder of what the camera saw."""
    yield Recorder("frames", _record_frames)


@hookimpl
def benchbot_executors() -> Iterator[Executor]:
    """Yield the executor that runs the workers of a batch on this machine."""
    yield Executor("local", _launch_locally, _attach_locally, "Processes of this machine.")


def _launch_locally(order: WorkOrder) -> Workers:
    from benchbot.batch import local

    return local.launch(order)


def _attach_locally(reference: str) -> Workers:
    from benchbot.batch import local

    return local.attach(reference)


def _record_frames(folder: Path) -> Recording:
    from benchbot.plugins.recorders.frames import FramesRecording

    return FramesRecording(folder)
