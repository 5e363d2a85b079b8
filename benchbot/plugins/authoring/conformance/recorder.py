"""The conformance of recorders."""

import resource
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.core.channels import OBSERVATIONS
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding
from benchbot.core.geometry import Pose
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.core.recording import Recording
from benchbot.core.records import Recorder
from benchbot.plugins.authoring.conformance import leaks, samples
from benchbot.plugins.authoring.conformance.properties import Wrong, look, unchecked
from benchbot.plugins.authoring.conformance.seeing import digest

ROOM_BYTES = 2000
LONG, SHORT = 6, 2
MANY = 80


def check_recorder(recorder: Recorder | str) -> list[Finding]:
    """Return what a recorder does and does not as `benchbot.core.recording` asks, on made-up observations."""
    record = _installed(recorder) if isinstance(recorder, str) else recorder
    properties: Sequence[tuple[str, Callable[[Recorder, Path], str]]] = (
        ("a session", _records),
        ("observations", _leaves_them_alone),
        ("channels that a task lacks", _takes_what_there_is),
        ("reset", _starts_over),
        ("a run under way", _joins),
        ("close", _closes_twice),
        ("nothing left", _leaves_nothing_open),
        ("full disk", _tells_of_a_full_disk),
        ("a folder that cannot be", _tells_of_a_bad_folder),
    )
    findings = []
    for subject, holds in properties:
        with tempfile.TemporaryDirectory(prefix="benchbot-testing-") as folder:
            findings.append(look(subject, partial(holds, record, Path(folder))))
    return findings


def _records(recorder: Recorder, folder: Path) -> str:
    target = folder / "deep" / "recording"
    _session(recorder, target, SHORT)
    if _size(target) == 0:
        raise Wrong("Nothing was written.", "Write into the folder that create is given; make it when it is not there.")
    strangers = [path.name for path in (*folder.iterdir(), *(folder / "deep").iterdir())]
    if strangers != ["deep", "recording"]:
        raise Wrong(f"Beside its folder there is {strangers}.", "Write into the folder that create is given only.")
    return f"{sum(path.is_file() for path in target.rglob('*'))} files, {_size(target)} bytes"


def _leaves_them_alone(recorder: Recorder, folder: Path) -> str:
    steps = list(_steps(SHORT))
    before = [digest(step.observations) for step, _ in steps]
    with _recording(recorder, folder / "recording") as recording:
        recording.reset()
        for step, progress in steps:
            recording.step(None, {}, step, progress)
    if [digest(step.observations) for step, _ in steps] != before:
        raise Wrong("It altered the observations.", "Copy what you change: the solution is shown the same arrays.")
    return "as they were"


def _takes_what_there_is(recorder: Recorder, folder: Path) -> str:
    for channels in ((), ("poses",), ("laser", "poses"), ("image_rgb",)):
        _session(recorder, folder / f"with_{len(channels)}_{'_'.join(channels)}", SHORT, channels)
    return "with and without pictures, laser and poses"


def _starts_over(recorder: Recorder, folder: Path) -> str:
    _session(recorder, folder / "short", SHORT)
    target = folder / "again"
    with _recording(recorder, target) as recording:
        for count in (LONG, SHORT):
            recording.reset()
            for step, progress in _steps(count):
                recording.step(None, {}, step, progress)
    short, again = _size(folder / "short"), _size(target)
    if again > 1.5 * short:
        raise Wrong(
            f"{SHORT} steps take {short} bytes, but {again} when {LONG} others were recorded before a reset.",
            "Drop in reset() what was recorded: the session begins again.",
        )
    return "what was before it is dropped"


def _joins(recorder: Recorder, folder: Path) -> str:
    """A recording may begin in the middle of a run, and miss steps for which a slow disk has no time."""
    with _recording(recorder, folder / "recording") as recording:
        for step, progress in _steps(LONG):
            progress.frames += 40 if progress.frames < LONG else 60
            recording.step("move_distance", {"distance": 0.1}, step, progress)
    if _size(folder / "recording") == 0:
        raise Wrong("Nothing was written.", "Begin with whatever observation comes first, and go on after a gap.")
    return "joined late, and with a gap"


def _closes_twice(recorder: Recorder, folder: Path) -> str:
    never_reset = recorder.create(folder / "unused")
    never_reset.close()
    never_reset.close()
    _session(recorder, folder / "used", SHORT)
    return "twice, used or not"


def _leaves_nothing_open(recorder: Recorder, folder: Path) -> str:
    numbers = iter(range(100))
    return leaks.leaves_nothing(lambda: _session(recorder, folder / str(next(numbers)), SHORT))


def _tells_of_a_full_disk(recorder: Recorder, folder: Path) -> str:
    """Files cannot grow beyond some bytes: the error that a full disk gives comes with the first write beyond."""
    with _little_room(ROOM_BYTES):
        try:
            _session(recorder, folder / "recording", MANY)
        except BenchbotError as error:
            told: Exception = error
        except OSError as error:
            told = error
        else:
            if any(path.is_file() and path.stat().st_size >= ROOM_BYTES for path in folder.rglob("*")):
                raise Wrong("Nothing was told when a file could not be written.", _HOW_TO_TELL)
            raise unchecked(
                f"{MANY} steps fit into files of {ROOM_BYTES} bytes.", "Try it with a real disk that is full."
            )
    if isinstance(told, OSError):
        raise Wrong(f"It raised {type(told).__name__}: {told}.", _HOW_TO_TELL)
    return str(told).splitlines()[0]


_HOW_TO_TELL = "Raise BenchbotError(title, why, fix) from step or close, with failure=FailureClass.INFRASTRUCTURE."


def _tells_of_a_bad_folder(recorder: Recorder, folder: Path) -> str:
    (folder / "file").write_text("not a folder")
    try:
        _session(recorder, folder / "file" / "recording", SHORT)
    except BenchbotError as error:
        return error.title
    except OSError as error:
        raise Wrong(
            f"It raised {type(error).__name__}: {error}.", _HOW_TO_TELL.replace("step", "create, step")
        ) from error
    raise Wrong("Nothing was told of a folder that cannot be made.", _HOW_TO_TELL.replace("step", "create, step"))


def _session(recorder: Recorder, folder: Path, count: int, channels: Sequence[str] = tuple(OBSERVATIONS)) -> None:
    with _recording(recorder, folder) as recording:
        recording.reset()
        action: str | None = None
        arguments: Mapping[str, Any] = {}
        for step, progress in _steps(count, channels):
            recording.step(action, arguments, step, progress)
            action, arguments = "move_distance", {"distance": 0.1}


@contextmanager
def _recording(recorder: Recorder, folder: Path) -> Iterator[Recording]:
    recording = recorder.create(folder)
    try:
        yield recording
    finally:
        recording.close()
        recording.close()


def _steps(count: int, channels: Sequence[str] = tuple(OBSERVATIONS)) -> Iterator[tuple[Step, Progress]]:
    random = np.random.default_rng(count)
    for number in range(count):
        base = Pose.planar(0.1 * number, 0.0, 0.0)
        seen = samples.observations(channels, base, random)
        state = State.CLEAN if number == 0 else State.DIRTY
        yield (
            Step(seen, ActionResult.SUCCESS, ("move_distance",), state, 0),
            Progress(
                state, steps=number, simulated_time_s=0.5 * number, frames=number + 1, pose_xyyaw=(0.1 * number, 0, 0)
            ),
        )


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


@contextmanager
def _little_room(size_bytes: int) -> Iterator[None]:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def _installed(name: str) -> Recorder:
    from benchbot.core.plugin_manager import load

    recorder: Recorder = load().record("recorders", name)
    return recorder
