"""A back end as a child process: starting it for one submission, and having it go on with the next run."""

import logging
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Self

import msgspec

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.request import RunRequest
from benchbot.process import how_it_ended, is_running, last_words, start_module, tree
from benchbot.supervisor.platform import messages
from benchbot.supervisor.platform.host import Timeouts
from benchbot.supervisor.recording.host import CLOSE_TIMEOUT_S
from benchbot.wire import run_state
from benchbot.wire.run_state import RunState

START_TIMEOUT_S = 180.0
"""A real robot is diagnosed meanwhile."""
STOP_TIMEOUT_S = 15.0
BEGIN_TIMEOUT_S = 120.0
STACK_LINES = 100
"""Enough of all threads of a supervisor that hangs, for the place where its main thread stands to be among them."""
PROGRAM = "a program"

logger = logging.getLogger(__name__)


class BackendRequest(msgspec.Struct, frozen=True):
    """The first run of a back end, what has started it, where it listens, and how its platform is started."""

    run: RunRequest
    owner: str
    port: int | None
    unix_socket: str | None
    options: dict[str, Any]
    timeouts: Timeouts


@dataclass
class Backend:
    """A back end that runs as a child process of this one."""

    _process: "subprocess.Popen[bytes]"
    _child: socket.socket
    _log: IO[bytes]
    state: RunState

    @property
    def pid(self) -> int:
        """The child's process number."""
        return self._process.pid

    def died(self) -> BenchbotError | None:
        """Return why the back end is no longer alive, or None while it is."""
        return None if self._process.poll() is None else _dead(self._process, self._log)

    def begin(self, request: RunRequest, timeout_s: float = BEGIN_TIMEOUT_S) -> None:
        """End the run that there is and begin another one, in the same place: the simulator stays as it is, warm.

        The request is of the same robot and environment. `state` is then that of the new run, with another token.
        Raises BenchbotError when that one is impossible, or the back end is dead or stuck: end it then.
        """
        self.state = _ask(self._process, self._child, _absolute(request), self._log, timeout_s)

    @classmethod
    @contextmanager
    def start(
        cls,
        run: RunRequest,
        *,
        owner: str = PROGRAM,
        port: int | None = 0,
        unix_socket: Path | None = None,
        options: Mapping[str, Any] | None = None,
        timeouts: Timeouts | None = None,
        start_timeout_s: float = START_TIMEOUT_S,
    ) -> Iterator[Self]:
        """Start a back end in a child process, yield it when it answers, and end it on leaving.

        Only who is given its address finds it, unless its `owner` is `benchbot run`.

        The child ends by itself when this process dies. Raises the child's own BenchbotError when the run is
        impossible or the address is taken.
        """
        path = None if unix_socket is None else str(unix_socket)
        request = BackendRequest(_absolute(run), owner, port, path, dict(options or {}), timeouts or Timeouts())
        with tempfile.TemporaryFile() as log:
            ours, theirs = socket.socketpair()
            with ours:
                with theirs:
                    process = start_module("benchbot.supervisor", output=log, stdin=theirs.fileno())
                try:
                    yield cls(process, ours, log, _ask(process, ours, request, log, start_timeout_s))
                finally:
                    _end(process, log, STOP_TIMEOUT_S + (CLOSE_TIMEOUT_S if run.record else 0.0))


def _absolute(request: RunRequest) -> RunRequest:
    """Return the request with absolute folders: the child may have another working folder."""
    return replace(request, record={name: str(Path(folder).absolute()) for name, folder in request.record.items()})


def _ask(
    process: "subprocess.Popen[bytes]",
    child: socket.socket,
    request: BackendRequest | RunRequest,
    log: IO[bytes],
    timeout_s: float,
) -> RunState:
    """Tell the child what to run and return the state that it answers with when it listens."""
    try:
        messages.send(child, msgspec.msgpack.encode(request))
        return messages.decode_reply(messages.receive(child, timeout_s), RunState)
    except (EOFError, OSError) as error:
        with suppress(subprocess.TimeoutExpired):
            process.wait(1.0)
        raise _dead(process, log) from error


def _end(process: "subprocess.Popen[bytes]", log: IO[bytes], timeout_s: float) -> None:
    """End the child: politely, then by force; it is always reaped, and what it could not tidy up any more is.

    Ended by force, it says where it stood. What writes recordings ends by itself then, and is waited for.
    """
    process.terminate()
    try:
        process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        started = [pid for pid in tree(process.pid) if pid != process.pid]
        process.send_signal(signal.SIGABRT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(1.0)
        process.kill()
        process.wait()
        said = last_words(log, most_lines=STACK_LINES)
        logger.warning("The supervisor did not end in %g s and was ended by force. %s", timeout_s, said)
        given_up_s = time.monotonic() + STOP_TIMEOUT_S
        while any(map(is_running, started)) and time.monotonic() < given_up_s:
            time.sleep(0.05)
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
