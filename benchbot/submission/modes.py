"""The ways to run a solution: natively, in a sandbox, in a container; and what all of them promise."""

import os
import pkgutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins
from benchbot.submission.solution import Solution
from benchbot.wire.run_state import Connection

RESULT = "result.json"
"""The file in the exchange folder that a solution's result is read from."""
SOCKET_PATH_BYTES = 107
RESULT_MAX_BYTES = 64 * 2**20


@dataclass(frozen=True)
class ProcessLimits:
    """What a solution may use at most; None leaves it to the mode, which may have a limit of its own or none."""

    memory_bytes: int | None = None
    processes: int | None = None
    cpu_time_s: float | None = None
    file_size_bytes: int | None = None


DEFAULT_LIMITS = ProcessLimits()


class Running(Protocol):
    """A solution that has been started. Leaving its context ends everything that it has started in turn."""

    @property
    def process(self) -> int:
        """This machine's number of the leading process; 0 where there is none."""

    @property
    def last_words(self) -> str:
        """The last lines of its output."""

    def wait(self, timeout_s: float) -> int | None:
        """Return the exit status (negative: the signal that ended it), or None when it still runs after `timeout_s`."""

    def explain(self, status: int) -> BenchbotError | None:
        """Return what the mode knows about why it ended with `status`: a limit that was reached. None: nothing."""

    def end(self) -> None:
        """End it, and everything that it has started. May be called more than once."""


class Mode(Protocol):
    """A way to run a solution."""

    @property
    def name(self) -> str:
        """`native`, `sandbox` or `container`: part of a result's provenance, unless it is `native`."""

    @property
    def needs_socket(self) -> bool:
        """Whether its solutions reach the supervisor by a unix socket only."""

    def describe(self) -> str:
        """Return how it holds the solution, as a part of a sentence: `in a container (podman)`."""

    def check(self) -> None:
        """Raise BenchbotError when this machine cannot do it; called before anything is started."""

    def start(
        self, spec: "SolutionSpec", connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> AbstractContextManager[Running]:
        """Return the solution, which starts on entering and ends on leaving.

        `exchange` is a fresh folder (0700) of this machine for this solution alone: it writes its result to `RESULT` in
        there, which BENCHBOT_RESULT names as the solution sees it. `output` takes what it prints, chunk by chunk, in a
        thread of its own. Entering raises BenchbotError when the solution cannot be started.
        """


@dataclass(frozen=True)
class Native:
    """Runs a solution with everything that the user who submits it has."""

    name = "native"
    needs_socket = False

    def describe(self) -> str:
        """Return how the solution is held."""
        return "with all rights of its user"

    def check(self) -> None:
        """Do nothing: it is always possible."""

    def start(
        self, spec: "SolutionSpec", connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> AbstractContextManager[Running]:
        """Return the solution as a process."""
        variables = {**connection.environment(), "BENCHBOT_RESULT": str(exchange / RESULT), **spec.variables}
        return Solution(spec.command, spec.folder, {**_environment(), **variables}, output)


NATIVE = Native()


@dataclass(frozen=True)
class SolutionSpec:
    """A solution to run: a command in a folder, with variables of its own, for at most `timeout_s` seconds; and how."""

    command: list[str]
    folder: Path
    variables: Mapping[str, str] = field(default_factory=dict)
    timeout_s: float | None = None
    mode: "Mode" = NATIVE
    limits: ProcessLimits = DEFAULT_LIMITS


class Holder(Protocol):
    """What stands behind a submission mode, often a module: how its solutions are prepared.

    `options` are the mode's own, as plain data that a plan or a bundle can keep.
    """

    def resolved(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """Return the options complete and checked; raise BenchbotError for what cannot be."""

    def prepared(
        self, spec: "SolutionSpec", options: Mapping[str, Any], tell: Callable[[str], object]
    ) -> AbstractContextManager["SolutionSpec"]:
        """Yield the order as it is run in the mode, after proving that this machine can; `tell` hears of progress."""

    def files(self, options: Mapping[str, Any]) -> Mapping[str, str] | None:
        """Return the hashes of what the solution is made of; None where its command names the files."""


def holder_of(plugins: Plugins, mode: str) -> Holder:
    """Return what stands behind a submission mode; raises BenchbotError for one that is not installed."""
    holder: Holder = pkgutil.resolve_name(plugins.record("submission_modes", mode).target)
    return holder


def unix_socket_of(mode: Mode, connection: Connection) -> Path:
    """Return the supervisor's unix socket; raises BenchbotError when it listens on none."""
    if connection.socket is None:
        raise BenchbotError(
            "The back end cannot be reached from where the solution runs.",
            f"It has no unix socket, and a solution in a {mode.name} has no network.",
            "Start it with one: benchbot run --unix-socket PATH …; or have submit start one: --task, --robot, --env.",
        )
    return Path(connection.socket).absolute()


@contextmanager
def private_socket() -> Iterator[Path]:
    """Yield a path for a back end's socket, in a folder of its own that goes with it.

    Nobody else can list the folder, and the socket is for this user (0600); but a solution's own user may be let in.
    """
    usual = tempfile.gettempdir()
    # The kernel takes a short path only (unix(7)).
    place = usual if len(os.fsencode(usual)) < SOCKET_PATH_BYTES - len("/benchbot-01234567/s") else os.path.sep + "tmp"
    with tempfile.TemporaryDirectory(prefix="benchbot-", dir=place) as folder:
        Path(folder).chmod(0o711)
        yield Path(folder) / "s"


def _environment() -> dict[str, str]:
    """Return this process's environment without the folders of add-ons: ground truths are in them."""
    kept = {name: value for name, value in os.environ.items() if name != "BENCHBOT_ADDONS"}
    return {**kept, "PYTHONUNBUFFERED": "1"}
