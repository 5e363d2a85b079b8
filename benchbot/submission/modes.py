"""The modes in which a solution is run (natively, in a sandbox, in a container), and the specification of one."""

import os
import pkgutil
import shlex
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins
from benchbot.submission.solution import Solution, cannot_start, python_first
from benchbot.wire.run_state import Connection

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog

RESULT = "result.json"
"""The file in the exchange folder that a solution's result is read from."""
SOCKET_PATH_BYTES = 107
RESULT_MAX_BYTES = 64 * 2**20
LOG_LIMIT_BYTES = 10 * 2**20


@dataclass(frozen=True)
class ProcessLimits:
    """The most that a solution may use; None leaves it to the mode, which may have a limit of its own or none."""

    memory_bytes: int | None = None
    processes: int | None = None
    cpu_time_s: float | None = None
    file_size_bytes: int | None = None


DEFAULT_LIMITS = ProcessLimits()


class Running(Protocol):
    """A solution that has been started. Leaving its context ends everything that it has started in turn."""

    @property
    def process(self) -> int:
        """The number of its first process on this machine; 0 where there is none."""

    @property
    def last_words(self) -> str:
        """The last lines of its output."""

    def wait(self, timeout_s: float) -> int | None:
        """Return the exit status (negative: the signal that ended it), or None when it still runs after `timeout_s`."""

    def explain(self, status: int) -> BenchbotError | None:
        """Return the limit that made it end with `status`; None when the mode knows of none."""

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
    log_limit_bytes: int = LOG_LIMIT_BYTES
    weak_limits: tuple[str, ...] = ()
    """The limits that hold at most for each process by itself, on this machine in this mode."""
    details: Mapping[str, Any] | None = None
    """The solution as a result names it; None when that is found out as it starts."""


class Holder(Protocol):
    """The implementation of a submission mode, often a module: it prepares solutions.

    `options` are the mode's own, as plain data that a plan or a bundle can keep.
    """

    def resolved(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """Return the options complete and checked; raise BenchbotError for what cannot be."""

    def prepared(
        self, spec: "SolutionSpec", options: Mapping[str, Any], tell: Callable[[str], object]
    ) -> AbstractContextManager["SolutionSpec"]:
        """Yield the specification for the mode, once this machine has been checked; `tell` is called with progress."""


def holder_of(plugins: Plugins, mode: str) -> Holder:
    """Return the implementation of a submission mode; raises BenchbotError for one that is not installed."""
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


def spec_of(
    catalog: "Catalog",
    native: str | None,
    example: str | None,
    words: list[str],
    timeout_s: float | None,
    sandbox: str | None = None,
) -> SolutionSpec:
    """Return the solution to run, natively; raises BenchbotError unless one was chosen and its command exists."""
    commands = {"--native": native, "--sandbox": sandbox}
    given = [name for name, value in {**commands, "--example": example}.items() if value is not None]
    if len(given) != 1:
        raise BenchbotError(
            "It is not clear what to submit.",
            f"{' and '.join(given)} were given." if given else "No solution was given.",
            "Give one: --native python my_solution.py, --sandbox python my_solution.py, "
            "or --example NAME (benchbot list examples).",
        )
    if example is None:
        spec = SolutionSpec([*split_words(given[0], commands[given[0]]), *words], Path.cwd(), timeout_s=timeout_s)
    else:
        found = catalog.get("examples", example)
        command = [*split_words("native_command", found.data["native_command"]), *words]
        spec = SolutionSpec(command, found.path.parent, python_first(), timeout_s)
    if not spec.command:
        raise cannot_start(["(nothing)"], "there is no command")
    path = spec.variables.get("PATH", os.environ.get("PATH"))
    if os.sep not in spec.command[0] and shutil.which(spec.command[0], path=path) is None:
        raise cannot_start(spec.command, "there is no such program on PATH")
    return spec


def split_words(origin: str, text: str | None) -> list[str]:
    """Return the words of a command, split as a shell would; raises BenchbotError for a quote that stays open."""
    try:
        return shlex.split(text or "")
    except ValueError as error:
        raise BenchbotError(
            f"The words of {origin} cannot be told apart.", f"{text!r}: {error}.", "Close the quote, or escape it."
        ) from error


@contextmanager
def owned_by(user: tuple[int, int] | None, path: Path) -> Iterator[None]:
    """Give a path to another user and group in the meantime; None leaves it as it is."""
    if user is None:
        yield
        return
    before = path.stat()
    os.chown(path, *user)
    try:
        yield
    finally:
        with suppress(FileNotFoundError):
            os.chown(path, before.st_uid, before.st_gid)


@contextmanager
def private_socket() -> Iterator[Path]:
    """Yield a path for a back end's socket, in a folder of its own that is removed with it.

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
