"""The recorder `rerun`: what a session observed and did, as a file for the Rerun viewer.

Format and entities: https://rerun.io/docs/reference. Coordinates are those of the map frame, z up, in metres.
"""

import errno
import os
import resource
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import rerun

from benchbot.plugin import BenchbotError, ExitCode, FailureClass, Progress, Step
from benchbot_record_rerun.entities import MAP, Way, boxes_of, entities_of, truth_of

FILE = "run.rrd"
APPLICATION = "benchbot"
FLUSH_TIMEOUT_S = 60.0
SPARE_BYTES = 2**20
INDEX_BYTES = 2**14
"""Space reserved per step for the index at the end of the file: twice its actual size."""
_LOST: list[rerun.RecordingStream | None] = []


def room_for(value: Any) -> int:
    """Return how many bytes the arrays in observations have."""
    if isinstance(value, Mapping):
        return sum(room_for(item) for item in value.values())
    return int(getattr(value, "nbytes", 0))


class RerunRecording:
    """Writes `run.rrd`, which can be opened after every step, whatever happens to this process.

    The timelines are `simulated_time` (of a real robot `robot_time`) and `observation`. Raises BenchbotError when the
    file cannot be written; it then ends with the step before.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._stream: rerun.RecordingStream | None = None
        self._whole_bytes = self._steps = 0
        self._way = Way()
        self._run: Mapping[str, Any] | None = None
        self._begin()

    def reset(self) -> None:
        """Start the file over."""
        self._end()
        self._begin()

    def step(self, action: str | None, arguments: Mapping[str, float], step: Step, progress: Progress) -> None:
        """Write one step."""
        stream = self._stream
        if stream is None:
            raise self._cannot_be_written("The recording has ended")
        self._require_room(room_for(step.observations))
        self._steps += 1
        stream.set_time(progress.time_key.removesuffix("_s"), duration=progress.simulated_time_s)
        stream.set_time("observation", sequence=progress.frames)
        for path, entity in entities_of(action, arguments, step, self._way):
            stream.log(path, entity)
        self._flush(stream)

    def result(self, document: Mapping[str, Any]) -> None:
        """Write the boxes of the object map that was handed in."""
        if self._stream is not None:
            self._require_room(0)
            for path, entity in boxes_of(document.get("results")):
                self._stream.log(path, entity)
            self._flush(self._stream)

    def run(self, document: Mapping[str, Any]) -> None:
        """Keep what is run: which place it is in."""
        self._run = document

    def close(self) -> None:
        """Finish the file, with the true boxes and an index of what is in it. Safe to call twice.

        The truth comes last: a solution could read it while it drives.
        """
        if self._stream is not None and self._run is not None:
            self._require_room(0)
            for path, entity in truth_of(self._run):
                self._stream.log(path, entity, static=True)
        self._end()

    def _begin(self) -> None:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._path.write_bytes(b"")
        except OSError as error:
            raise self._cannot_be_written(error.strerror or str(error)) from error
        self._whole_bytes = self._steps = 0
        self._require_room(0)
        self._way = Way()
        self._stream = stream = rerun.RecordingStream(APPLICATION)
        stream.save(self._path)
        stream.log(MAP, rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._flush(stream)

    def _flush(self, stream: rerun.RecordingStream) -> None:
        try:
            stream.flush(timeout_sec=FLUSH_TIMEOUT_S)
        except RuntimeError as error:
            self._give_up()
            raise self._cannot_be_written(f"{error}: as when the disk is full") from error
        self._whole_bytes = self._path.stat().st_size

    def _end(self) -> None:
        stream = self._stream
        if stream is not None:
            try:
                self._require_room(0)
            except BenchbotError:
                self._give_up()
                raise
            self._stream = None
            try:
                stream.disconnect()
            except RuntimeError as error:
                self._give_up()
                raise self._cannot_be_written(f"{error}: as when the disk is full") from error

    def _require_room(self, size_bytes: int) -> None:
        """Raise BenchbotError when the disk has no room for so much: Rerun hangs where it cannot write."""
        needed = size_bytes + SPARE_BYTES + INDEX_BYTES * self._steps
        limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        if limit != resource.RLIM_INFINITY and self._whole_bytes + needed > limit:
            raise self._cannot_be_written(os.strerror(errno.EFBIG))
        if shutil.disk_usage(self._path.parent).free < needed:
            raise self._cannot_be_written(os.strerror(errno.ENOSPC))

    def _give_up(self) -> None:
        # Not disconnected, nor dropped: both would wait for a writer that has died.
        _LOST.append(self._stream)
        self._stream = None
        with suppress(OSError):
            os.truncate(self._path, self._whole_bytes)

    def _cannot_be_written(self, why: str) -> BenchbotError:
        return BenchbotError(
            f"The recording {self._path} cannot be written.",
            f"{why}.",
            "Make room, or record into a folder on a disk that has some and that you may write to.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        )
