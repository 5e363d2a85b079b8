"""The recorder `mcap`: everything that a session observed and did, as a rosbag2 directory."""

import json
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError, ExitCode, FailureClass, Progress, Step
from benchbot_record_mcap import scenery, topics
from benchbot_record_mcap.bag import Bag

EPISODE_START_NS = 1_000_000_000
"""The stamp of an episode's start, the same for every run: to tf2 and rclpy, a stamp of zero means 'no time'."""


class McapRecording:
    """Writes one MCAP file and, at the end, the `metadata.yaml` that makes the folder a rosbag2 directory.

    Stamps are `EPISODE_START_NS` plus the episode's time by the robot's clock, which goes on from scene to scene. Where
    the task hides the true pose it hides the time, from which the way could be worked out: an observation is a second.
    One taken at the same instant as the one before is stamped a nanosecond later, so that tf2 never has two transforms
    for one stamp. Raises BenchbotError when the folder holds a recording already, and when something cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._lock = threading.Lock()
        self._failure: BenchbotError | None = None
        self._closed = False
        self._time_ns = 0
        self._run: Mapping[str, Any] | None = None
        self._bag: Bag
        self._writing(self._prepare_folder)
        self._writing(self._begin)

    def run(self, document: Mapping[str, Any]) -> None:
        """Keep what is run in the file's metadata, and start the file over."""
        self._run = document
        self.reset()

    def reset(self) -> None:
        """Start the file over."""
        with self._lock:
            self._require_open()
            self._failure = None
            self._bag.abandon()
            self._writing(self._begin)

    def step(self, action: str | None, arguments: Mapping[str, float], step: Step, progress: Progress) -> None:
        """Write one step. After a failure every later step fails likewise, up to the next reset."""
        with self._lock:
            self._require_open()
            if self._failure is not None:
                raise self._failure
            now_s = progress.simulated_time_s if self._tells_pose else progress.frames
            time_ns = max(EPISODE_START_NS + round(now_s * 1e9), self._time_ns + 1)
            messages = list(topics.of_step(action, arguments, step, progress, time_ns, tells_pose=self._tells_pose))
            self._writing(lambda: self._bag.write(time_ns, messages))
            self._time_ns = time_ns

    def result(self, document: Mapping[str, Any]) -> None:
        """Write the objects of a map that was handed in, as markers."""
        with self._lock:
            if self._closed or self._failure is not None:
                return
            markers = scenery.found_objects(document.get("results"), self._time_ns + 1)
            if markers is not None:
                self._append(scenery.OBJECTS, markers)

    def close(self) -> None:
        """Write the walls, index and metadata. After a failure, which was reported, keep what was written before it.

        The walls come last: a solution could read them while it drives.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
            if self._failure is not None:
                return
            grid = None if self._run is None else scenery.walls(self._run, self._time_ns + 1)
            if grid is not None:
                self._append(scenery.MAP, grid)
            self._writing(self._bag.finish)

    def _append(self, topic: str, message: Any) -> None:
        self._time_ns += 1
        self._writing(lambda: self._bag.write(self._time_ns, [(topic, message)]))

    @property
    def _tells_pose(self) -> bool:
        """Whether solutions of the run are told the true pose."""
        return self._run is not None and self._run["task"].get("localisation") != "noisy"

    def _prepare_folder(self) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        found = [*self._folder.glob("*.mcap"), *self._folder.glob("metadata.yaml")]
        if found:
            raise BenchbotError(
                f"{self._folder} holds a recording already.",
                f"There is {found[0].name}, and a recording is never overwritten.",
                "Record into another folder, or remove this one first.",
            )

    def _begin(self) -> None:
        self._time_ns = 0
        self._bag = Bag(self._folder, None if self._run is None else {"run": json.dumps(self._run, sort_keys=True)})

    def _require_open(self) -> None:
        if self._closed:
            raise BenchbotError(
                "The recording has ended.",
                "The run that it belongs to is over.",
                "Start another run: benchbot run …",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            )

    def _writing(self, write: Callable[[], None]) -> None:
        """Write; an error of the file system becomes a BenchbotError, and earlier data stays readable."""
        try:
            write()
        except OSError as error:
            self._failure = BenchbotError(
                f"The recording in {self._folder} cannot be written.",
                f"{error.strerror or error}.",
                "Make room, or record into a folder on a disk that has some and that you may write to.",
                exit_code=ExitCode.SUBMISSION_FAILED,
                failure=FailureClass.INFRASTRUCTURE,
            )
            raise self._failure from error
