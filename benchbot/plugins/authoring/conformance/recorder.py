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
from benchbot.core.light_records import Recorder
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.core.recording import Recording
from benchbot.evaluation import result_files
from benchbot.plugins.authoring.conformance.bench import find_record
from benchbot.plugins.authoring.conformance.fake_robot import fake_observations
from benchbot.plugins.authoring.conformance.observations import digest
from benchbot.plugins.authoring.conformance.properties import Violation, check_property, leaves_nothing_open, unchecked

FILE_LIMIT_BYTES = 2000
LONG, SHORT, MANY = 6, 2, 80
"""Numbers of steps."""


def check_recorder(recorder: Recorder | str) -> list[Finding]:
    """Return findings on whether a recorder conforms to `benchbot.core.recording`, on made-up observations."""
    record = find_record("recorders", recorder)
    properties: dict[str, Callable[[Recorder, Path], str]] = {
        "a session": _records,
        "observations": _leaves_observations_alone,
        "channels that a task lacks": _records_any_channels,
        "reset": _starts_over,
        "a run under way": _joins,
        "close": _closes_twice,
        "results beside it": _is_no_result,
        "nothing left": _leaves_nothing_open,
        "full disk": _reports_a_full_disk,
        "a folder that cannot be": _reports_a_bad_folder,
    }
    findings = []
    for subject, holds in properties.items():
        with tempfile.TemporaryDirectory(prefix="benchbot-testing-") as folder:
            findings.append(check_property(subject, partial(holds, record, Path(folder))))
    return findings


def _records(recorder: Recorder, folder: Path) -> str:
    target = folder / "deep" / "recording"
    _record(recorder, target, SHORT)
    if _size_bytes(target) == 0:
        fix = "Write into the folder that create is given; make it when it is not there."
        raise Violation("Nothing was written.", fix)
    written = [path.name for path in (*folder.iterdir(), *(folder / "deep").iterdir())]
    if written != ["deep", "recording"]:
        raise Violation(f"Beside its folder there is {written}.", "Write into the folder that create is given only.")
    return f"{sum(path.is_file() for path in target.rglob('*'))} files, {_size_bytes(target)} bytes"


def _leaves_observations_alone(recorder: Recorder, folder: Path) -> str:
    steps = list(_steps(SHORT))
    before = [digest(step.observations) for step, _ in steps]
    with _recording(recorder, folder / "recording") as recording:
        recording.reset()
        for step, progress in steps:
            recording.step(None, {}, step, progress)
    if [digest(step.observations) for step, _ in steps] != before:
        raise Violation("It altered the observations.", "Copy what you change: the solution is shown the same arrays.")
    return "as they were"


def _records_any_channels(recorder: Recorder, folder: Path) -> str:
    for channels in ((), ("poses",), ("laser", "poses"), ("image_rgb",)):
        _record(recorder, folder / f"with_{len(channels)}_{'_'.join(channels)}", SHORT, channels=channels)
    return "with and without pictures, laser and poses"


def _starts_over(recorder: Recorder, folder: Path) -> str:
    _record(recorder, folder / "short", SHORT)
    target = folder / "again"
    _record(recorder, target, LONG, SHORT)
    short, again = _size_bytes(folder / "short"), _size_bytes(target)
    if again > 1.5 * short:
        raise Violation(
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
    if _size_bytes(folder / "recording") == 0:
        raise Violation("Nothing was written.", "Begin with whatever observation comes first, and go on after a gap.")
    return "joined late, and with a gap"


def _closes_twice(recorder: Recorder, folder: Path) -> str:
    with _recording(recorder, folder / "unused"):
        pass
    _record(recorder, folder / "used", SHORT)
    return "twice, used or not"


def _is_no_result(recorder: Recorder, folder: Path) -> str:
    """A recording lies among results, closed or cut off, and must not be taken for one by `benchbot eval`."""
    target = folder / "recording"
    with _recording(recorder, target) as recording:
        recording.reset()
        for step, progress in _steps(LONG):
            recording.step(None, {}, step, progress)
        _refuse_results(target)
    _refuse_results(target)
    return "it would not be scored"


def _refuse_results(folder: Path) -> None:
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".json", ".zip"))
    for item in result_files.read([folder] if paths else []):
        if not isinstance(item, result_files.OtherFile):
            raise Violation(
                f"benchbot eval would count {Path(item.source).relative_to(folder)} as a result, or a broken one.",
                "Call it something else than .json and .zip, or write it whole, without a result's keys.",
            )


def _leaves_nothing_open(recorder: Recorder, folder: Path) -> str:
    numbers = iter(range(100))
    return leaves_nothing_open(lambda: _record(recorder, folder / str(next(numbers)), SHORT))


def _reports_a_full_disk(recorder: Recorder, folder: Path) -> str:
    """The size of files is limited: the first write beyond raises the error that a full disk gives."""
    with _limited_file_size(FILE_LIMIT_BYTES):
        reported = _reported(recorder, folder / "recording", MANY, "step or close")
    if reported is not None:
        return str(reported).splitlines()[0]
    if any(path.is_file() and path.stat().st_size >= FILE_LIMIT_BYTES for path in folder.rglob("*")):
        raise Violation("Nothing was told when a file could not be written.", _how_to_report("step or close"))
    raise unchecked(
        f"{MANY} steps fit into files of {FILE_LIMIT_BYTES} bytes.", "Try it with a real disk that is full."
    )


def _reports_a_bad_folder(recorder: Recorder, folder: Path) -> str:
    (folder / "file").write_text("not a folder")
    reported = _reported(recorder, folder / "file" / "recording", SHORT, "create, step or close")
    if reported is None:
        fix = _how_to_report("create, step or close")
        raise Violation("Nothing was told of a folder that cannot be made.", fix)
    return reported.title


def _reported(recorder: Recorder, folder: Path, count: int, methods: str) -> BenchbotError | None:
    """Record steps; return the error that was raised for the user; raises `Violation` for a bare OSError."""
    try:
        _record(recorder, folder, count)
    except BenchbotError as error:
        return error
    except OSError as error:
        raise Violation(f"It raised {type(error).__name__}: {error}.", _how_to_report(methods)) from error
    return None


def _how_to_report(methods: str) -> str:
    return f"Raise BenchbotError(title, why, fix) from {methods}, with failure=FailureClass.INFRASTRUCTURE."


def _record(recorder: Recorder, folder: Path, *counts: int, channels: Sequence[str] = tuple(OBSERVATIONS)) -> None:
    """Record a session of so many steps; with several counts, it is reset after each but the last."""
    with _recording(recorder, folder) as recording:
        for count in counts:
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
        x_m = 0.1 * number
        observed = fake_observations(channels, Pose.planar(x_m, 0.0, 0.0), random)
        state = State.CLEAN if number == 0 else State.DIRTY
        progress = Progress(
            state, steps=number, simulated_time_s=0.5 * number, frames=number + 1, pose_xyyaw=(x_m, 0, 0)
        )
        yield Step(observed, ActionResult.SUCCESS, ("move_distance",), state, 0), progress


def _size_bytes(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


@contextmanager
def _limited_file_size(size_bytes: int) -> Iterator[None]:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
