"""A feed of a run: a thread that asks its supervisor again and again, and keeps the newest view of it."""

import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.watching.client import WatchClient
from benchbot.plugins.watching.gpu import GpuMeter
from benchbot.plugins.watching.logs import Logs
from benchbot.plugins.watching.rates import Rates
from benchbot.plugins.watching.views import Look, RunView, Usage
from benchbot.submission import output_log
from benchbot.wire import run_state
from benchbot.wire.run_state import RunState

PERIOD_S = 0.1
LOG_PERIOD_S = 0.3
PATH_PERIOD_S = 0.5
RETRY_S = 0.5
ANSWER_TIMEOUT_S = 10.0
CLOSE_TIMEOUT_S = 1.0


class RunFeed:
    """Keeps `view` up to date until it is closed. It never waits, survives the end of the run, and connects anew.

    Commands wait for the supervisor's answer, and raise BenchbotError: call them in a thread.
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
        self._path_s = float("-inf")
        self._looked_at: tuple[int, tuple[str, ...], int] | None = None
        self._period_s = period_s
        self._logs = Logs(
            {
                "supervisor": Path(state.supervisor_log),
                "platform": Path(state.platform_log),
                "solution": Path(state.folder) / output_log.NAME,
            }
        )
        self._logs_read_s = float("-inf")
        self._pace, self._processors = Rates(), Rates()
        self._wake = threading.Event()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._keep_up, name="benchbot-run-feed", daemon=True)
        self._thread.start()

    @property
    def view(self) -> RunView:
        """The newest view."""
        return self._view

    def choose(self, channels: Sequence[str], width: int) -> None:
        """Look at these channels from now on, at most so many pixels wide; at none: nothing is looked at."""
        self._chosen = tuple(channels), width
        self._wake.set()

    def pause(self) -> None:
        """Hold the solution's next step."""
        with self._asking() as client:
            client.pause(paused=True)

    def go_on(self) -> None:
        """Let the solution go on."""
        with self._asking() as client:
            client.pause(paused=False)

    def single_step(self) -> None:
        """Let one step of the solution through, and hold the next."""
        with self._asking() as client:
            client.let_through(1)

    def drive(self, action: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Take a step by hand; return `{action, arguments, by_hand, outcome, result}` when it has ended."""
        with self._asking(answer_timeout_s=None) as client:
            return client.drive(action, arguments)

    def stop(self) -> None:
        """End the run."""
        with self._asking() as client:
            client.stop()

    def confirm(self) -> str:
        """Say that what the operator was asked is done, and return what that was."""
        with self._asking() as client:
            return client.confirm()

    def close(self) -> None:
        """End the thread. The run goes on, and a solution that waits at the gate goes on waiting."""
        self._closed.set()
        self._wake.set()
        self._thread.join(CLOSE_TIMEOUT_S)

    @contextmanager
    def _asking(self, answer_timeout_s: float | None = ANSWER_TIMEOUT_S) -> Iterator[WatchClient]:
        # A connection of its own: while one command waits, others are still heard.
        client = WatchClient(self.state, answer_timeout_s)
        try:
            yield client
        finally:
            client.close()
            self._wake.set()

    def _keep_up(self) -> None:
        client = WatchClient(self.state, ANSWER_TIMEOUT_S)
        self._gpu = GpuMeter()
        try:
            while not self._closed.is_set():
                self._wake.clear()
                began_s = time.monotonic()
                pause_s = self._period_s
                try:
                    self._view = self._asked(client)
                except BenchbotError as error:
                    pause_s = RETRY_S
                    self._view = self._unanswered(error)
                    if not self._view.alive:
                        return
                self._wake.wait(max(0.0, began_s + pause_s - time.monotonic()))
        finally:
            client.close()
            self._gpu.close()

    def _asked(self, client: WatchClient) -> RunView:
        before, (channels, width) = self._view, self._chosen
        began_s = time.monotonic()
        # Another choice of channels is another look at the same observation.
        after = before.look.number if before.look is not None and self._same_look(before.look, channels, width) else 0
        with_path = began_s - self._path_s >= PATH_PERIOD_S
        told = client.watch(
            after=after, channels=channels, width=width, with_session=not before.session, with_path=with_path
        )
        if with_path:
            self._path_s, self._path = began_s, tuple((x, y) for x, y in told["path"])
        look = before.look if channels else None
        if told.get("look") is not None:
            look = _look(told["look"])
            self._looked_at = look.number, channels, width
        progress = told["progress"]
        frames_per_s, real_time_factor = self._pace.note(began_s, progress["frames"], progress["simulated_time_s"])
        log = self._read_logs()
        return RunView(
            state=self.state,
            alive=True,
            problem=None,
            session=told.get("session") or before.session,
            progress=progress,
            paused=told["gate"]["paused"],
            held=told["gate"]["held"],
            driven_by_hand=told["driven_by_hand"],
            last=told["last"],
            path=self._path,
            frames_per_s=frames_per_s,
            real_time_factor=real_time_factor,
            usage=self._usage(told["usage"]),
            look=look,
            log=before.log if log is None else log,
            log_dropped=self._logs.dropped,
            result=None if told["result"] is None else Path(told["result"]),
        )

    def _same_look(self, look: Look, channels: tuple[str, ...], width: int) -> bool:
        return self._looked_at == (look.number, channels, width)

    def _unanswered(self, error: BenchbotError) -> RunView:
        """Return what is known when there is no answer: the same as before, and that the run has ended if it has."""
        alive = run_state.is_alive(self.state)
        self._logs_read_s = float("-inf")
        log = self._read_logs()
        result = Path(self.state.result)
        return replace(
            self._view,
            alive=alive,
            problem=f"{error.title} {error.why}" if alive else "The run has ended.",
            frames_per_s=0.0,
            real_time_factor=0.0,
            usage=None,
            log=self._view.log if log is None else log,
            log_dropped=self._logs.dropped,
            result=result if result.is_file() else None,
        )

    def _read_logs(self) -> Any:
        """Return the lines of the logs when there are new ones, else None."""
        now_s = time.monotonic()
        if now_s - self._logs_read_s < LOG_PERIOD_S:
            return None
        self._logs_read_s = now_s
        return self._logs.lines if self._logs.read() else None

    def _usage(self, told: Mapping[str, Any] | None) -> Usage | None:
        if told is None:
            return None
        (cores,) = self._processors.note(told["at_s"], told["cpu_s"])
        gpu = self._gpu.use
        return Usage(
            cpu_percent=100.0 * cores,
            memory_bytes=told["memory_bytes"],
            gpu_percent=None if gpu is None else gpu.percent,
            gpu_memory_bytes=None if gpu is None else gpu.memory_bytes,
        )


def _look(told: Mapping[str, Any]) -> Look:
    observations = told["observations"]
    images = {name: observations[name] for name in ("image_rgb", "image_depth") if name in observations}
    segments = observations.get("image_segment") or {}
    for name, key in (("image_class", "class_segment_img"), ("image_instance", "instance_segment_img")):
        if key in segments:
            images[name] = segments[key]
    return Look(
        number=told["number"],
        images=images,
        laser=observations.get("laser"),
        poses=observations.get("poses"),
        classes=segments.get("class_ids") or {},
        stride=told["stride"],
    )
