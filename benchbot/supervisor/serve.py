"""Serving runs in this process, one after the other on one address and one platform, until they are stopped."""

import logging
import os
import secrets
import signal
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, Queue
from typing import Any

from starlette.applications import Starlette
from starlette.types import Receive, Scope, Send

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding
from benchbot.core.host import Host
from benchbot.core.progress import Progress
from benchbot.core.selection import Selection
from benchbot.core.text import visible
from benchbot.supervisor.http import server
from benchbot.supervisor.http.app import create_app
from benchbot.supervisor.platform.host import ChildHost, Timeouts
from benchbot.supervisor.run import Run
from benchbot.wire.run_state import DEFAULT_PORT, RUN, Connection, RunFolder, RunState

ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SIGNAL_PERIOD_S = 0.1
STOPPED_ANSWERS_S = 1.0


@dataclass(frozen=True)
class RunPlan:
    """A run to begin: a selection, and the folders that recorders, by their names, write into."""

    selection: Selection
    record: Mapping[str, Path] = field(default_factory=dict)


class ConsecutiveRuns:
    """Runs on one platform, one at a time: each has its own session and folder; what is loaded stays loaded.

    The platform's process, its log and the supervisor's are shared by all of them. The folder of the first run holds
    the logs, and stays until the end. Of each run's folder the result is kept.
    """

    def __init__(
        self, options: Mapping[str, Any] | None, timeouts: Timeouts | None, starter: int | None = None
    ) -> None:
        self._starter = starter
        self._options = options
        self._timeouts = timeouts
        self._base = RunFolder()
        self.folder = self._base
        """The folder of the current run."""
        self.platform_log = self._base.path / "platform.log"
        self.supervisor_log = self._base.path / "supervisor.log"
        self._run: Run | None = None
        self._warm: Host | None = None
        self._host: ChildHost | None = None
        self._platform_failed = False

    @property
    def findings(self) -> list[Finding]:
        """Those of the diagnosis of a real robot."""
        return [] if self._host is None else self._host.findings

    def begin(self, plan: RunPlan) -> Run:
        """End the run that there is, but not its platform, and return the next one."""
        if self._run is not None:
            self._warm = self._run.release()
            self._note_failure()
            self._leave_folder()
            self.folder = RunFolder()
        self._run = run = Run(plan.selection, lambda: self._start_host(run), self.folder.result, self._starter)
        run.recordings.begin(plan.record)
        return run

    def close_run(self) -> None:
        """End the run that there is, and its platform."""
        if self._run is not None:
            self._run.close()
            self._note_failure()
        warm, self._warm = self._warm, None
        if warm is not None:
            warm.close()

    def close(self) -> None:
        """Leave the folders; those with a result are kept, and the logs of a platform that failed."""
        if self.folder is not self._base:
            self._leave_folder()
        self._base.close(keep=self._platform_failed or self._base.result.exists())

    def _start_host(self, run: Run) -> ChildHost:
        warm, self._warm = self._warm, None
        if isinstance(warm, ChildHost):
            with suppress(BenchbotError):  # it has died meanwhile: a new one takes its place
                warm.renew(run.selection, run.operator)
                return warm
            warm.close()
        self._host = ChildHost(
            run.selection,
            self.platform_log,
            options=self._options,
            timeouts=self._timeouts,
            operator=run.operator,
            zero_copy=True,
        )
        return self._host

    def _note_failure(self) -> None:
        self._platform_failed |= self._run is not None and self._run.platform_failed

    def _leave_folder(self) -> None:
        if self.folder is self._base:
            self._base.unpublish()
        else:
            self.folder.close(keep=self.folder.result.exists())


def serve(
    selection: Selection,
    *,
    host: str = "127.0.0.1",
    port: int | None = DEFAULT_PORT,
    unix_socket: Path | None = None,
    allow_remote: bool = False,
    open_to_v2: bool = False,
    owner: str = RUN,
    options: Mapping[str, Any] | None = None,
    timeouts: Timeouts | None = None,
    record: Mapping[str, Path] | None = None,
    following: "Queue[RunPlan] | None" = None,
    on_ready: Callable[[RunState], None] | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    progress_interval_s: float = 0.5,
) -> signal.Signals | None:
    """Serve a run until it is stopped; return the signal that ended it, or None when a client asked for its end.

    Call it in the main thread: it handles SIGINT, SIGTERM and SIGHUP while it runs. `port` 0 is any free port, None is
    no TCP at all. `record` names recorders and the folders that they write into. `on_ready` and `on_progress` are
    called in the main thread. Leaves no process, socket or state file behind; the run's folder stays when it holds a
    result, or the log of a platform that failed. Raises BenchbotError when the address is taken or not on loopback
    (`allow_remote` permits others). `open_to_v2` lets clients of BenchBot v2 in without a token, on this machine only.
    `owner` is what has started it: solutions join those of `benchbot run` only.

    Each plan in the queue `following` ends the run that there is and begins another one, of the same robot and task:
    on the same address and the same platform, which keeps what it has loaded, with a token, a folder and a result of
    its own; `on_ready` tells of it. Each of these runs is one episode: a result that is handed in does not end it.
    """
    if open_to_v2 and allow_remote:
        raise BenchbotError(
            "A run without a token cannot be open to other machines.",
            "Everybody on the network could move the robot.",
            "Leave one of the two away: let BenchBot v2's client run on this machine.",
        )
    with ExitStack() as stack:
        received = stack.enter_context(_received_signals())
        runs = ConsecutiveRuns(options, timeouts, None if following is None else os.getppid())
        stack.callback(runs.close)
        run = runs.begin(RunPlan(selection, record or {}))
        stack.enter_context(_logging_to(runs.supervisor_log))
        listeners, connection = _listen(stack, host, port, unix_socket, allow_remote=allow_remote)

        def published(connection: Connection) -> tuple[RunState, Starlette]:
            state = _state(run.selection, runs, connection, owner)
            folder = runs.folder.path if owner == RUN else None
            tokens = state.connection.token, state.operator_token
            return state, create_app(run, *tokens, open_to_v2=open_to_v2, folder=folder)

        state, app = published(connection)

        async def app_of_current_run(scope: Scope, receive: Receive, send: Send) -> None:
            await app(scope, receive, send)

        running = stack.enter_context(server.Server(app_of_current_run, listeners))
        preparer = ThreadPoolExecutor(1, "benchbot-prepare")
        stack.callback(preparer.shutdown)
        stack.callback(runs.close_run)
        while True:
            run.session.one_episode = following is not None
            preparing = preparer.submit(run.prepare)
            while not received and wait([preparing], SIGNAL_PERIOD_S).not_done:
                pass  # the diagnosis of a real robot takes its time, and is cut off by a signal
            if received:
                break
            preparing.result()
            state = replace(state, findings=runs.findings)
            runs.folder.publish(state)
            if on_ready is not None:
                on_ready(state)
            plan = _wait(run, running, received, following, on_progress, progress_interval_s)
            if plan is None:
                break
            run = runs.begin(plan)
            state, app = published(replace(connection, token=_new_token()))
        if run.stopped_in_use:
            # The robot has been stopped: the client still has time to ask why before the server ends.
            time.sleep(STOPPED_ANSWERS_S)
        return received[0] if received else None


def _wait(
    run: Run,
    running: server.Server,
    received: Sequence[signal.Signals],
    following: "Queue[RunPlan] | None",
    on_progress: Callable[[Progress], None] | None,
    progress_interval_s: float,
) -> RunPlan | None:
    """Return None when the run is stopped, or the plan of the next one when there is one."""
    told_s = time.monotonic()
    while not received and not run.stop_asked.is_set():
        if following is None:
            run.stop_asked.wait(SIGNAL_PERIOD_S)
        else:
            with suppress(Empty):
                return following.get(timeout=SIGNAL_PERIOD_S)
        running.check()
        if on_progress is not None and time.monotonic() - told_s >= progress_interval_s:
            told_s = time.monotonic()
            on_progress(run.progress)
    return None


@contextmanager
def _received_signals() -> Iterator[list[signal.Signals]]:
    """Yield a list of the signals received so far. The handler does no more: it may interrupt anything."""
    received: list[signal.Signals] = []

    def note(number: int, _frame: object) -> None:
        received.append(signal.Signals(number))

    before = {number: signal.signal(number, note) for number in ENDING_SIGNALS}
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Indented(logging.Formatter):
    """Writes a record so that no line but its first looks like that of another: a solution's words are in some."""

    def format(self, record: logging.LogRecord) -> str:
        """Return its text."""
        return visible(super().format(record)).replace("\n", "\n    ")


@contextmanager
def _logging_to(path: Path) -> Iterator[None]:
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(_Indented("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    # The server's warnings are of requests that anybody may send, without a token and without end.
    levels = {"benchbot.supervisor": logging.INFO, "uvicorn.error": logging.ERROR}
    loggers = [logging.getLogger(name) for name in levels]
    for logger in loggers:
        logger.setLevel(levels[logger.name])
        logger.propagate = False
        logger.addHandler(handler)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeHandler(handler)
        handler.close()


def _listen(
    stack: ExitStack, host: str, port: int | None, unix_socket: Path | None, *, allow_remote: bool
) -> tuple[list[socket.socket], Connection]:
    if port is None and unix_socket is None:
        raise BenchbotError(
            "The run has no address.", "It has neither a port nor a unix socket.", "Give it one: --port 0"
        )
    listeners, url, path = [], None, None
    if unix_socket is not None:
        unix_socket = unix_socket.absolute()
        listeners.append(stack.enter_context(server.bind_unix(unix_socket)))
        stack.callback(lambda: unix_socket.unlink(missing_ok=True))
        path = str(unix_socket)
    if port is not None:
        listeners.append(stack.enter_context(server.bind_tcp(host, port, allow_remote=allow_remote)))
        url = server.url_of(listeners[-1])
    return listeners, Connection(url, path, _new_token())


def _new_token() -> str:
    return secrets.token_urlsafe(32)


def _state(selection: Selection, runs: ConsecutiveRuns, connection: Connection, owner: str) -> RunState:
    return RunState(
        connection=connection,
        operator_token=_new_token(),
        pid=os.getpid(),
        task=selection.task.name,
        robot=selection.robot.name,
        environment=selection.environment,
        seed=selection.seed,
        secret=selection.secret,
        folder=str(runs.folder.path),
        platform_log=str(runs.platform_log),
        supervisor_log=str(runs.supervisor_log),
        result=str(runs.folder.result),
        started_s=time.time(),
        owner=owner,
    )
