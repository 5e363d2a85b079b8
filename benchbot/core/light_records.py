"""The records that `benchbot --help` meets: plain tuples with names, since defining a dataclass takes it too long.

A record that names code takes a callable. `target("module:attribute")` is one whose module is imported at its first
call, so that a plug-in's own module stays light.
"""

import pkgutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:
    from pathlib import Path

    from benchbot.core.errors import BenchbotError
    from benchbot.core.findings import Finding
    from benchbot.core.recording import Recording
    from benchbot.core.records import Evaluator, Workers, WorkOrder


class Target:
    """A callable by its place, `module:attribute`; the module is imported when it is called."""

    def __init__(self, place: str) -> None:
        self.place = place

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Import and call it."""
        return self.load()(*arguments, **options)

    def load(self) -> Any:
        """Import it."""
        return pkgutil.resolve_name(self.place)


def target(place: str) -> Callable[..., Any]:
    """Return the callable at `module:attribute`, to be imported at its first call."""
    return Target(place)


class Command(NamedTuple):
    """A sub-command of `benchbot`.

    `target` is `module:attribute` of a typer app or a function; it is imported when the command is used.
    `takes_sources` says whether the options of declaration sources, such as `--addons`, may stand among its words.
    """

    name: str
    target: str
    help: str
    takes_sources: bool = False


class Recorder(NamedTuple):
    """Told of every reset and step of a session; writes what it likes into the folder that `create` is given.

    `read`, if given, yields the observations in such a folder, step by step: none of what is not there.
    """

    name: str
    create: Callable[["Path"], "Recording"]
    description: str = ""
    read: Callable[["Path"], "Iterable[Mapping[str, Any]]"] | None = None


class Executor(NamedTuple):
    """Where the workers of a batch run.

    `launch` starts them and returns at once; it raises BenchbotError, with the fix, when they cannot run there.
    `attach` finds those that an earlier driver has launched, by their `reference`; what is gone counts as not alive.
    """

    name: str
    launch: Callable[["WorkOrder"], "Workers"]
    attach: Callable[[str], "Workers"]
    description: str = ""


class AssetPack(NamedTuple):
    """Models that scenes are furnished with; `catalogue` is the JSON file that lists them."""

    name: str
    catalogue: "Path"


class EnvironmentSet(NamedTuple):
    """Environments `NAME_1:1` to `NAME_SIZE:1`, each a place of its own, and made when it is first asked for.

    `make` takes the number of one and returns a folder with `environments/`, the one declaration in it, and
    `ground_truths/`, as folders of add-ons have them. Every process that asks calls it, so it keeps what it has made.
    It raises BenchbotError, with the fix, when an environment cannot be made. `is_made`, if given, says whether one is
    there, without a close look: those that are not are made by several processes at once.
    """

    name: str
    size: int
    make: Callable[[int], "Path"]
    description: str = ""
    is_made: Callable[[int], bool] | None = None


class SubmissionMode(NamedTuple):
    """A way to hold a solution while it runs: a sandbox, a container, …

    `target` is the module, or `module:attribute`, of what implements `benchbot.plugin.Holder`.
    """

    name: str
    target: str
    description: str = ""


class Routes(NamedTuple):
    """More routes of a run's server; `target` is `module:attribute` of a function of a run and its access rules.

    It is called with a `benchbot.plugin.Run` and a `benchbot.plugin.Access` and returns
    Starlette routes.
    """

    name: str
    target: str


class TuiScreen(NamedTuple):
    """A screen of `benchbot tui`, listed in its command palette by name and summary.

    `target` is `module:attribute` of a Textual screen class, or of a function that returns a screen; it is imported
    when the screen is opened. `key`, if given, opens it from any screen, unless that key has a meaning already.
    """

    name: str
    target: str
    summary: str
    key: str = ""


class Check(NamedTuple):
    """A check before the first episode, of the catalog and a `benchbot.cli.kit.preflight.Intent`.

    `find` yields findings; a broken one (subject: what is wrong, detail: why) keeps the command from starting.
    """

    name: str
    find: Callable[[Any, Any], "Iterable[Finding]"]


class DeclarationFolder(Protocol):
    """A folder of declarations that no distribution has brought, such as one with add-ons of BenchBot v2."""

    @property
    def root(self) -> "Path":
        """The folder."""

    @property
    def name(self) -> str:
        """Its name in the provenance of results."""

    @property
    def version(self) -> str:
        """Its version there."""

    @property
    def stands_in(self) -> bool:
        """True when a name that something else declares, too, is not taken from it."""

    def sources(self, kind: str) -> "Iterable[Path]":
        """Return the files and folders that declare a kind (`tasks`, `formats`, …)."""

    def evaluators(self) -> "Iterable[Evaluator | BenchbotError]":
        """Yield the methods of evaluation in it, and what is wrong with those that cannot be read; import nothing."""

    def functions(self, declaration: "Path", names: Mapping[str, str]) -> dict[str, Callable[..., Any]]:
        """Return the functions that a declaration in it names; raise BenchbotError for code that is not there."""

    def require_trust(self) -> None:
        """Raise BenchbotError unless the user has said that the code in it may run."""

    def content_hash(self) -> str:
        """Return the SHA-256 over the names and bytes of its files."""

    def removal(self) -> str:
        """Return what a person types to have it no longer."""


class DeclarationSource(NamedTuple):
    """Where declarations come from besides distributions.

    `folders` returns the folders in use in this process; `installed` those that are installed into the environment, as
    rows of `benchbot list plugins`. `take_options` takes the options of the source out of the words of a command, acts
    on them and returns the rest; `help` explains these options.
    """

    name: str
    folders: Callable[[], "Sequence[DeclarationFolder]"]
    installed: Callable[[], Sequence[Mapping[str, str]]]
    take_options: Callable[[Sequence[str]], list[str]]
    help: str = ""
