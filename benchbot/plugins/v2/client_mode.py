"""The submission mode `v2-client`: a native solution that uses the client which BenchBot v2 published.

That client finds the run by a proxy (`bridge`), and saves its result to one file of the machine: so one such solution
runs at a time.
"""

import fcntl
import os
import shutil
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.v2 import bridge
from benchbot.submission.init.handover import open_result
from benchbot.submission.modes import NATIVE, RESULT, RESULT_MAX_BYTES, Running, SolutionSpec
from benchbot.submission.output import refused_result
from benchbot.wire.run_state import Connection

NAME = "v2-client"
RESULT_OF_V2 = Path("/tmp/benchbot_result")  # noqa: S108 - v2's client knows no other
LOCK = RESULT_OF_V2.with_suffix(".lock")

_held: list[int] = []
"""The open file of the lock, while this process holds it."""


def resolved(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return no options: there are none."""
    return {}


@contextmanager
def prepared(spec: SolutionSpec, options: Mapping[str, Any], tell: Callable[[str], object]) -> Iterator[SolutionSpec]:
    """Yield the specification, while no other solution of this machine may write v2's result.

    `tell` is called when it waits for that.
    """
    with _alone(tell):
        yield replace(spec, mode=V2ClientMode())


@dataclass(frozen=True)
class V2ClientMode:
    """Runs a solution with everything that the user who submits it has, and v2's client finds the run."""

    name = NAME
    needs_socket = False

    def describe(self) -> str:
        """Return how the solution is held."""
        return "with all rights of its user, and v2's client finds the run"

    def check(self) -> None:
        """Do nothing: it is always possible."""

    @contextmanager
    def start(
        self, spec: SolutionSpec, connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> Iterator[Running]:
        """Yield the solution as a process, whose result may be where v2's client saves it."""
        _remove_result()
        with bridge.listening(connection, output) as variables:
            told = replace(spec, variables={**variables, **spec.variables})
            with NATIVE.start(told, connection, exchange, output) as solution:
                yield _SavesWhereV2Does(solution, exchange / RESULT)


@dataclass(frozen=True)
class _SavesWhereV2Does:
    """A running solution whose result is taken from where v2's client saves it."""

    solution: Running
    target: Path

    @property
    def process(self) -> int:
        return self.solution.process

    @property
    def last_words(self) -> str:
        return self.solution.last_words

    def wait(self, timeout_s: float) -> int | None:
        return self.solution.wait(timeout_s)

    def explain(self, status: int) -> BenchbotError | None:
        if status == 0 and not self.target.exists():
            why = take_result(RESULT_OF_V2, self.target)
            if why is not None:
                return refused_result(why)
        return self.solution.explain(status)

    def end(self) -> None:
        self.solution.end()


def take_result(source: Path, target: Path) -> str | None:
    """Move a result that v2's client has saved; return why it was refused, if it was.

    No link is followed, nothing but a regular file of this user is read, and no more than a result may have.
    """
    try:
        handle = open_result(str(source), RESULT_MAX_BYTES)
    except FileNotFoundError:
        return None
    except OSError as error:
        return f"{source}: {error.strerror or error}"
    with os.fdopen(handle, "rb") as file:
        if os.fstat(handle).st_uid != os.geteuid():
            return f"{source} belongs to another user"
        with target.open("xb") as copy:
            shutil.copyfileobj(file, copy)
    source.unlink(missing_ok=True)
    return None


def _remove_result() -> None:
    with suppress(FileNotFoundError):
        try:
            if not stat.S_ISDIR(RESULT_OF_V2.lstat().st_mode):
                RESULT_OF_V2.unlink()
                return
        except PermissionError:
            pass
        raise BenchbotError(
            f"{RESULT_OF_V2} is there, and cannot be removed.",
            "BenchBot v2's client saves its result to that file. It is somebody else's, or a folder.",
            "Have it removed; or run the solution in a container: --v2-client --containerised FOLDER",
        )


@contextmanager
def _alone(tell: Callable[[str], object]) -> Iterator[None]:
    """Hold the lock by which one solution of this machine at a time writes v2's result; the kernel drops it.

    A process runs one at a time, however many it has prepared.
    """
    if _held:
        yield
        return
    try:
        handle = os.open(LOCK, os.O_RDONLY | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)
    except PermissionError:  # another user's, in a folder where only that one may create it (fs.protected_regular)
        handle = os.open(LOCK, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            tell(f"Waits for another solution of BenchBot v2's client: both would save their result to {RESULT_OF_V2}")
            fcntl.flock(handle, fcntl.LOCK_EX)
        _held.append(handle)
        yield
    finally:
        _held.clear()
        os.close(handle)
