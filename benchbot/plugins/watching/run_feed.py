"""A feed of a run: a thread that polls its supervisor and keeps the newest view of it."""

import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from benchbot.api.client import Client
from benchbot.core.errors import BenchbotError
from benchbot.plugins.watching.logs import Logs
from benchbot.plugins.watching.usage import GpuMeter, Rates
from benchbot.plugins.watching.views import FeedSnapshot, LogLine, RunView, Sample, Usage
from benchbot.submission import output
from benchbot.wire import run_state
from benchbot.wire.run_state import Connection, RunState

PERIOD_S = 0.1
LOG_PERIOD_S = 0.3
PATH_PERIOD_S = 0.5
RETRY_S = 0.5
ANSWER_TIMEOUT_S = 10.0
CLOSE_TIMEOUT_S = 1.0
SAMPLE_PERIOD_S = 1.0
KEPT_SAMPLES = 300


class WatchClient(Client):
    """A client of the routes `/api/v1/watch…`, with the operator's token; not thread-safe. Raises as `Client` does."""

    def __init__(self, state: RunState, answer_timeout_s: float | None = None) -> None:
        connection = Connection(state.connection.url, state.connection.socket, state.operator_token)
        super().__init__(connection, answer_timeout_s, shares_memory=False)

    def watch(
        self,
        *,
        after: int = 0,
        channels: Sequence[str] = (),
        width: int = 0,
        with_session: bool = False,
        with_path: bool = True,
    ) -> dict[str, Any]:
        """Return the state of the run, with the newest observation of these channels if it comes after `after`."""
        query: dict[str, Any] = {"session": int(with_session), "path": int(with_path)}
        if channels:
            query |= {"after": after, "channels": ",".join(channels), "width": width}
        return self._call("GET", f"watch?{urlencode(query)}")

    def gate(self, **order: bool | int) -> None:
        """Hold the solution's next step or let it go on (`paused`), or let so many `steps` through."""
        self._call("POST", "watch/gate", order)

    def drive(self, action: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Take an action by hand, to its end; return `{action, arguments, by_hand, outcome, result}`."""
        return self._call("POST", "watch/drive", {"action": action, "arguments": dict(arguments)})


class RunFeed:
    """Keeps `view` up to date until it is closed. It survives the end of the run, and reconnects after errors.

    Reading `view` never blocks. Commands wait for the supervisor's answer, and raise BenchbotError: call them in a
    thread.
    """

    def __init__(
        self,
        state: RunState,
        *,
        width: int = 320,
        channels: Sequence[str] = ("image_rgb",),
        period_s: float = PERIOD_S,
    ) -> None:
        self.state = state
        self._view = RunView(state, alive=True, problem="Nothing is known yet.", session={}, progress={})
        self._chosen = tuple(channels), width
        self._path: tuple[tuple[float, float], ...] = ()
        self._path_read_s = float("-inf")
        self._fetched: tuple[int, tuple[str, ...], int] | None = None
        self._period_s = period_s
        self._logs = Logs(
            {
                "supervisor": Path(state.supervisor_log),
                "platform": Path(state.platform_log),
                "solution": Path(state.folder) / output.LOG_NAME,
            },
            began_s=state.started_s,
        )
        self._logs_read_s = float("-inf")
        self._frame_rates, self._cpu_rate = Rates(), Rates()
        self._history: deque[Sample] = deque(maxlen=KEPT_SAMPLES)
        self._sampled_s = float("-inf")
        self._wake = threading.Event()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._poll, name="benchbot-run-feed", daemon=True)
        self._thread.start()

    @property
    def view(self) -> RunView:
        """The newest view."""
        return self._view

    def choose(self, channels: Sequence[str], width: int) -> None:
        """Fetch these channels from now on, at most so many pixels wide; with no channels, no observations."""
        self._chosen = tuple(channels), width
        self._wake.set()

    def pause(self) -> None:
        """Hold the solution's next step."""
        with self._client() as client:
            client.gate(paused=True)

    def go_on(self) -> None:
        """Let the solution go on."""
        with self._client() as client:
            client.gate(paused=False)

    def single_step(self) -> None:
        """Let one step of the solution through, and hold the next."""
        with self._client() as client:
            client.gate(steps=1)

    def drive(self, action: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Take a step by hand; return `{action, arguments, by_hand, outcome, result}` when it has ended."""
        with self._client(answer_timeout_s=None) as client:
            return client.drive(action, arguments)

    def stop(self) -> None:
        """End the run."""
        with self._client() as client:
            client.stop("a key of its screen")

    def confirm(self) -> str:
        """Confirm that the operator has done what the robot asked, and return what that was."""
        with self._client() as client:
            return client.confirm()

    def close(self) -> None:
        """End the thread. The run goes on, and a solution that waits at the gate goes on waiting."""
        self._closed.set()
        self._wake.set()
        self._thread.join(CLOSE_TIMEOUT_S)

    @contextmanager
    def _client(self, answer_timeout_s: float | None = ANSWER_TIMEOUT_S) -> Iterator[WatchClient]:
        # A connection for each command: while one waits, others still get through.
        client = WatchClient(self.state, answer_timeout_s)
        try:
            yield client
        finally:
            client.close()
            self._wake.set()

    def _poll(self) -> None:
        client = WatchClient(self.state, ANSWER_TIMEOUT_S)
        self._gpu = GpuMeter()
        try:
            while not self._closed.is_set():
                self._wake.clear()
                began_s = time.monotonic()
                pause_s = self._period_s
                try:
                    self._view = self._fetch(client)
                except BenchbotError as error:
                    pause_s = RETRY_S
                    self._view = self._unanswered(error)
                    if not self._view.alive:
                        return
                self._wake.wait(max(0.0, began_s + pause_s - time.monotonic()))
        finally:
            client.close()
            self._gpu.close()

    def _fetch(self, client: WatchClient) -> RunView:
        before, (channels, width) = self._view, self._chosen
        began_s = time.monotonic()
        # After another choice of channels, the same observation is fetched again.
        known = before.snapshot is not None and self._fetched == (before.snapshot.number, channels, width)
        with_path = began_s - self._path_read_s >= PATH_PERIOD_S
        answer = client.watch(
            after=before.snapshot.number if before.snapshot is not None and known else 0,
            channels=channels,
            width=width,
            with_session=not before.session,
            with_path=with_path,
        )
        if with_path:
            self._path_read_s, self._path = began_s, tuple((x, y) for x, y in answer["path"])
        snapshot = before.snapshot if channels else None
        if answer.get("look") is not None:
            snapshot = _snapshot(answer["look"])
            self._fetched = snapshot.number, channels, width
        progress = answer["progress"]
        time_s = progress.get("simulated_time_s", progress.get("robot_time_s"))
        frames_per_s, real_time_factor = self._frame_rates.note(began_s, progress["frames"], time_s)
        usage = self._usage(answer["usage"])
        result = None if answer["result"] is None else Path(answer["result"])
        return RunView(
            state=self.state,
            alive=True,
            problem=None,
            session=answer.get("session") or before.session,
            progress=progress,
            paused=answer["gate"]["paused"],
            held=answer["gate"]["held"],
            driven_by_hand=answer["driven_by_hand"],
            last=answer["last"],
            path=self._path,
            frames_per_s=frames_per_s,
            real_time_factor=real_time_factor,
            usage=usage,
            history=self._sampled(began_s, progress, frames_per_s, usage),
            snapshot=snapshot,
            log=self._read_logs(),
            log_dropped=self._logs.dropped,
            result=result,
        )

    def _unanswered(self, error: BenchbotError) -> RunView:
        """Return the view before without rates, and say why it is old: no answer, or the end of the run."""
        alive = run_state.is_alive(self.state)
        self._logs_read_s = float("-inf")
        result = Path(self.state.result)
        return replace(
            self._view,
            alive=alive,
            problem=f"{error.title} {error.why}" if alive else "The run has ended.",
            frames_per_s=0.0,
            real_time_factor=0.0,
            usage=None,
            log=self._read_logs(),
            log_dropped=self._logs.dropped,
            result=result if result.is_file() else None,
        )

    def _sampled(
        self, now_s: float, progress: Mapping[str, Any], frames_per_s: float, usage: Usage | None
    ) -> tuple[Sample, ...]:
        """Return the samples, with one of now where that is due; the same tuple where it is not."""
        if now_s - self._sampled_s < SAMPLE_PERIOD_S:
            return self._view.history
        self._sampled_s = now_s
        length = progress["trajectory_length"]
        coverage = progress["trajectory_index"] / length if length else None
        cpu, memory = (None, None) if usage is None else (usage.cpu_percent, usage.memory_bytes)
        self._history.append(Sample(frames_per_s, cpu, memory, coverage))
        return tuple(self._history)

    def _read_logs(self) -> tuple[LogLine, ...]:
        """Return the lines of the logs, read again at most every `LOG_PERIOD_S`; the same tuple without new ones."""
        now_s = time.monotonic()
        if now_s - self._logs_read_s < LOG_PERIOD_S:
            return self._view.log
        self._logs_read_s = now_s
        return self._logs.lines if self._logs.read() else self._view.log

    def _usage(self, answer: Mapping[str, Any] | None) -> Usage | None:
        if answer is None:
            return None
        (cores,) = self._cpu_rate.note(answer["at_s"], answer["cpu_s"])
        gpu = self._gpu.usage
        return Usage(
            cpu_percent=100.0 * cores,
            memory_bytes=answer["memory_bytes"],
            gpu_percent=None if gpu is None else gpu.percent,
            gpu_memory_bytes=None if gpu is None else gpu.memory_bytes,
        )


def _snapshot(answer: Mapping[str, Any]) -> FeedSnapshot:
    observations = answer["observations"]
    images = {name: observations[name] for name in ("image_rgb", "image_depth") if name in observations}
    segments = observations.get("image_segment") or {}
    for name, key in (("image_class", "class_segment_img"), ("image_instance", "instance_segment_img")):
        if key in segments:
            images[name] = segments[key]
    return FeedSnapshot(
        number=answer["number"],
        images=images,
        laser=observations.get("laser"),
        poses=observations.get("poses"),
        classes=segments.get("class_ids") or {},
        stride=answer["stride"],
    )
