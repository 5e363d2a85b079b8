"""Running a back end: in this process until it is told to stop, or as a child process for one submission."""

import logging
import os
import secrets
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import IO, Any, Self

import msgspec

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.progress import Progress
from benchbot.core.selection import Limits, Selection
from benchbot.process import how_it_ended, last_words
from benchbot.supervisor.http import server
from benchbot.supervisor.http.app import create_app
from benchbot.supervisor.http.relay import Relay
from benchbot.supervisor.platform import messages
from benchbot.supervisor.platform.host import Timeouts
from benchbot.supervisor.recording.host import CLOSE_TIMEOUT_S
from benchbot.supervisor.run import Run
from benchbot.supervisor.succession import RunOrder, Succession
from benchbot.wire import run_state
from benchbot.wire.run_state import DEFAULT_PORT, Connection, RunState

ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SIGNAL_PERIOD_S = 0.1
STOP_TIMEOUT_S = 15.0
BEGIN_TIMEOUT_S = 120.0
STOPPED_ANSWERS_S = 1.0


def serve(
    selection: Selection,
    *,
    host: str = "127.0.0.1",
    port: int | None = DEFAULT_PORT,
    unix_socket: Path | None = None,
    allow_remote: bool = False,
    open_to_v2: bool = False,
    options: Mapping[str, Any] | None = None,
    timeouts: Timeouts | None = None,
    record: Mapping[str, Path] | None = None,
    following: "SimpleQueue[RunOrder] | None" = None,
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

    Each order in the queue `following` ends the run that there is and begins another one, of the same robot and task:
    on the same address and the same platform, which keeps what it has loaded, with a token, a folder and a result of
    its own; `on_ready` tells of it.
    """
    if open_to_v2 and allow_remote:
        raise BenchbotError(
            "A run without a token cannot be open to other machines.",
            "Everybody on the network could move the robot.",
            "Leave one of the two away: let BenchBot v2's client run on this machine.",
        )
    with ExitStack() as stack:
        received = stack.enter_context(_received_signals())
        runs = stack.enter_context(Succession(options, timeouts))
        run = runs.begin(RunOrder(selection, record or {}))
        stack.enter_context(_logging_to(runs.supervisor_log))
        listeners, connection = _listen(stack, host, port, unix_socket, allow_remote=allow_remote)
        state = _state(run.selection, runs, connection)
        relay = Relay(create_app(run, state.connection.token, state.operator_token, open_to_v2=open_to_v2))
        running = stack.enter_context(server.Server(relay, listeners))
        stack.callback(runs.close_run)
        while True:
            run.prepare()
            runs.folder.publish(state)
            if on_ready is not None:
                on_ready(state)
            order = _watch(run, running, received, following, on_progress, progress_interval_s)
            if order is None:
                break
            run = runs.begin(order)
            state = _state(run.selection, runs, replace(connection, token=_new_token()))
            relay.app = create_app(run, state.connection.token, state.operator_token, open_to_v2=open_to_v2)
        if run.stopped_in_use:
            # The robot has been stopped; whoever submitted learns of it, and why, before nobody answers any more.
            time.sleep(STOPPED_ANSWERS_S)
        return received[0] if received else None


def _watch(
    run: Run,
    running: server.Server,
    received: Sequence[signal.Signals],
    following: "SimpleQueue[RunOrder] | None",
    on_progress: Callable[[Progress], None] | None,
    progress_interval_s: float,
) -> RunOrder | None:
    """Return when the run is stopped, or with the order for the next one."""
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


@contextmanager
def _logging_to(path: Path) -> Iterator[None]:
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    loggers = [logging.getLogger(name) for name in ("benchbot.supervisor", "uvicorn.error")]
    for logger in loggers:
        logger.setLevel(logging.INFO)
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


def _state(selection: Selection, runs: Succession, connection: Connection) -> RunState:
    return RunState(
        connection=connection,
        operator_token=_new_token(),
        pid=os.getpid(),
        task=selection.task.name,
        robot=selection.robot.name,
        environment=selection.environment,
        seed=selection.seed,
        folder=str(runs.folder.path),
        platform_log=str(runs.platform_log),
        supervisor_log=str(runs.supervisor_log),
        result=str(runs.folder.result),
        started_s=time.time(),
    )


class Backend:
    """A back end that runs as a child process of this one."""

    def __init__(
        self, process: "subprocess.Popen[bytes]", child: socket.socket, log: IO[bytes], state: RunState
    ) -> None:
        self._process = process
        self._child = child
        self._log = log
        self.state = state

    @property
    def pid(self) -> int:
        """The child's process number."""
        return self._process.pid

    def died(self) -> BenchbotError | None:
        """Return why the back end is no longer alive, or None while it is."""
        return None if self._process.poll() is None else _dead(self._process, self._log)

    def begin(
        self,
        *,
        seed: int = 0,
        limits: Limits | None = None,
        episode: int | None = None,
        record: Mapping[str, Path] | None = None,
        timeout_s: float = BEGIN_TIMEOUT_S,
    ) -> None:
        """End the run that there is and begin another one, in the same place: the simulator stays as it is, warm.

        `state` is then that of the new run, with another token. Raises BenchbotError when that one is impossible, or
        the back end is dead or stuck: end it then.
        """
        following = Following(seed, limits or Limits(), episode, _absolute(record))
        self.state = _ask(self._process, self._child, following, self._log, timeout_s)

    @classmethod
    @contextmanager
    def start(
        cls,
        *,
        task: str,
        robot: str,
        environment: str,
        seed: int = 0,
        limits: Limits | None = None,
        episode: int | None = None,
        method: str | None = None,
        port: int | None = 0,
        unix_socket: Path | None = None,
        options: Mapping[str, Any] | None = None,
        timeouts: Timeouts | None = None,
        record: Mapping[str, Path] | None = None,
        settings: Mapping[str, Any] | None = None,
        start_timeout_s: float = 60.0,
    ) -> Iterator[Self]:
        """Start a back end in a child process, yield it when it answers, and end it on leaving.

        The child ends by itself when this process dies. Raises the child's own BenchbotError when the selection is
        impossible or the address is taken.
        """
        order = Order(
            task,
            robot,
            environment,
            seed,
            method,
            limits or Limits(),
            port,
            None if unix_socket is None else str(unix_socket),
            dict(options or {}),
            timeouts or Timeouts(),
            _absolute(record),
            episode,
            dict(settings or {}),
        )
        with tempfile.TemporaryFile() as log:
            ours, theirs = socket.socketpair()
            with ours:
                with theirs:
                    # A session of its own: Ctrl-C in the terminal is for this process, which ends the child in order.
                    process = subprocess.Popen(
                        [sys.executable, "-P", "-m", "benchbot.supervisor"],
                        stdin=theirs.fileno(),
                        stdout=log,
                        stderr=log,
                        start_new_session=True,
                    )
                try:
                    yield cls(process, ours, log, _ask(process, ours, order, log, start_timeout_s))
                finally:
                    _end(process, STOP_TIMEOUT_S + (CLOSE_TIMEOUT_S if record else 0.0))


class Order(msgspec.Struct, frozen=True):
    """What `Backend.start` asks its child to run."""

    task: str
    robot: str
    environment: str
    seed: int
    method: str | None
    limits: Limits
    port: int | None
    unix_socket: str | None
    options: dict[str, Any]
    timeouts: Timeouts
    record: dict[str, str]
    episode: int | None = None
    settings: dict[str, Any] = {}


class Following(msgspec.Struct, frozen=True):
    """What `Backend.begin` asks its child to run next: what differs from the run before."""

    seed: int
    limits: Limits
    episode: int | None
    record: dict[str, str]


def _absolute(record: Mapping[str, Path] | None) -> dict[str, str]:
    return {name: str(path.absolute()) for name, path in (record or {}).items()}


def _ask(
    process: "subprocess.Popen[bytes]",
    child: socket.socket,
    order: Order | Following,
    log: IO[bytes],
    timeout_s: float,
) -> RunState:
    """Tell the child what to run and return the state that it answers with when it listens."""
    try:
        messages.send(child, msgspec.msgpack.encode(order))
        return messages.decode_reply(messages.receive(child, timeout_s), RunState)
    except (EOFError, OSError) as error:
        with suppress(subprocess.TimeoutExpired):
            process.wait(1.0)
        raise _dead(process, log) from error


def _end(process: "subprocess.Popen[bytes]", timeout_s: float) -> None:
    """End the child: politely, then by force; it is always reaped, and what it could not tidy up any more is."""
    process.terminate()
    try:
        process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    if process.returncode < 0:
        with suppress(OSError):
            run_state.clean()


def _dead(process: "subprocess.Popen[bytes]", log: IO[bytes]) -> BenchbotError:
    code = process.poll()
    return BenchbotError(
        "The supervisor does not start." if code is None else "The supervisor died.",
        f"Its process {'does not answer' if code is None else how_it_ended(code)}. {last_words(log)}",
        "Run again; if it happens again, report it.",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )
