"""The frozen records that hooks yield, and the protocols of what they hold.

A record that names code takes a callable. `target("module:attribute")` is one whose module is imported at its first
call, so that a plug-in's own module stays light.
"""

import pkgutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from pathlib import Path

    from benchbot.core.errors import BenchbotError
    from benchbot.core.findings import Finding
    from benchbot.core.platform import Platform, PlatformSpec
    from benchbot.core.recording import Recording

API_VERSION = (1, 0)
"""The version of what `benchbot.plugin` promises, as (major, minor).

A plug-in says for which major version it was made by `BENCHBOT_API = 1` in its module.
"""

Document = dict[str, Any]


@dataclass(frozen=True)
class Target:
    """A callable by its place, `module:attribute`; the module is imported when it is called."""

    place: str

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Import and call it."""
        return self.load()(*arguments, **options)

    def load(self) -> Any:
        """Import it."""
        return pkgutil.resolve_name(self.place)


def target(place: str) -> Callable[..., Any]:
    """Return the callable at `module:attribute`, to be imported at its first call."""
    return Target(place)


@dataclass(frozen=True)
class Simulator:
    """What robots and environments of `type: <name>` run on.

    `create` returns a fresh platform; it is called in a child process. `warm`, if given, prepares caches (compiled
    kernels) in the given folder, so that the first run starts fast; it prints nothing and returns what it did.
    """

    name: str
    create: Callable[["PlatformSpec"], "Platform"]
    warm: "Callable[[Path], str] | None" = None


@dataclass(frozen=True)
class RobotDriver:
    """Real robots of `type: <name>`; `create` as for a simulator.

    `diagnose`, if given, looks at a robot that is switched on and yields what works and what does not.
    """

    name: str
    create: Callable[["PlatformSpec"], "Platform"]
    diagnose: Callable[["PlatformSpec"], "Iterable[Finding]"] | None = None


class Evaluate(Protocol):
    """Score one result against the ground truth of each of its scenes."""

    def __call__(self, result: Document, ground_truths: Sequence[Document]) -> dict[str, float]:
        """Return the scores by name; raise BenchbotError for a result that cannot be scored."""


class Combine(Protocol):
    """Make one summary of the scores of many results."""

    def __call__(self, scores: Sequence[dict[str, float]]) -> dict[str, float]:
        """Return the summary's scores by name; an empty dict in `scores` stands for a missing result."""


class Explain(Protocol):
    """Say how the scores of one result came about."""

    def __call__(self, result: Document, ground_truths: Sequence[Document]) -> Document:
        """Return what is added to the result's entry in an explanation (see its schema), such as `{"objects": […]}`.

        Raises what `evaluate` raises.
        """


@dataclass(frozen=True)
class Score:
    """How a score is read: whether less of it is better, and the least and the greatest value that it can have.

    `lower_is_better` is None of a score that is not good or bad by itself, such as a length; so is what is not known.
    """

    lower_is_better: bool | None = None
    least: float | None = None
    greatest: float | None = None


@dataclass(frozen=True)
class Evaluator:
    """A method of evaluation.

    `headline` names the score that stands for a result, the first one when it is empty; `version` changes whenever the
    numbers do. Without `ground_truth_formats`, `evaluate` gets no ground truth: the result says all that it needs.
    `explain`, if given, tells a person how a result's scores came about; it may show the ground truth. `scores` says
    how scores are read, by their names; of those that are not in it nothing is known.
    """

    name: str
    version: str
    headline: str
    result_formats: frozenset[str]
    ground_truth_formats: frozenset[str]
    evaluate: Evaluate
    combine: Combine
    description: str = ""
    explain: Explain | None = None
    scores: Mapping[str, Score] = field(default_factory=dict, hash=False)

    def score(self, name: str) -> Score:
        """Return how a score is read."""
        return self.scores.get(name, Score())


@dataclass(frozen=True)
class Resources:
    """What one worker of a batch needs: processor cores, GPUs, bytes of memory and seconds of wall time at most.

    What is None is not limited, or left to the executor.
    """

    cpus: int = 1
    gpus: int = 0
    memory_bytes: int | None = None
    time_s: float | None = None


@dataclass(frozen=True)
class WorkOrder:
    """What an executor is asked to launch: `count` workers of the batch in `folder`, which all of them can write to.

    A worker is the process `[*command, "--name", NAME]`, with a name that no other worker of the batch has had
    (letters, digits, `-`, `_` and `.`). It finds its work in the folder, ends by itself when there is none left, may be
    killed at any moment, and ends in order at SIGTERM, within seconds. It needs the environment of the driver.
    """

    folder: "Path"
    command: tuple[str, ...]
    count: int
    resources: Resources = Resources()
    options: Mapping[str, str] = field(default_factory=dict)

    @property
    def plan(self) -> "Path":
        """The batch's plan: a file that is there wherever the folder is."""
        return self.folder / "plan.json"

    @property
    def logs(self) -> "Path":
        """The folder of what workers print: a file `NAME.log` for each."""
        return self.folder / "workers"


class Workers(Protocol):
    """Workers that an executor has launched; they live on when the driver is gone."""

    @property
    def reference(self) -> str:
        """Enough to find them again by `Executor.attach`, from another process: process numbers, a job's number, …"""

    def alive(self) -> int:
        """Return how many run or wait to run."""

    def stop(self) -> None:
        """End all of them, in order first. Returns when they are ended or sure to end; safe to call again."""


@dataclass(frozen=True)
class Executor:
    """Where the workers of a batch run.

    `launch` starts them and returns at once; it raises BenchbotError, with the fix, when they cannot run there.
    `attach` finds those that an earlier driver has launched, by their `reference`; what is gone counts as not alive.
    """

    name: str
    launch: Callable[[WorkOrder], Workers]
    attach: Callable[[str], Workers]
    description: str = ""


@dataclass(frozen=True)
class Recorder:
    """Told of every reset and step of a session; writes what it likes into the folder that `create` is given."""

    name: str
    create: Callable[["Path"], "Recording"]
    description: str = ""


@dataclass(frozen=True)
class AssetPack:
    """Models that scenes are furnished with; `catalogue` is the JSON file that lists them."""

    name: str
    catalogue: "Path"


@dataclass(frozen=True)
class Command:
    """A sub-command of `benchbot`.

    `target` is `module:attribute` of a typer app or a function; it is imported when the command is used.
    `takes_sources` says whether the options of declaration sources, such as `--addons`, may stand among its words.
    """

    name: str
    target: str
    help: str
    takes_sources: bool = False


@dataclass(frozen=True)
class SubmissionMode:
    """A way to hold a solution while it runs: a sandbox, a container, …

    `target` is the module, or `module:attribute`, of what implements `benchbot.submission.modes.Holder`.
    """

    name: str
    target: str
    description: str = ""


@dataclass(frozen=True)
class Routes:
    """More routes of a run's server; `target` is `module:attribute` of a function of a run and its access rules.

    It is called with a `benchbot.supervisor.run.Run` and a `benchbot.supervisor.http.access.Access` and returns
    Starlette routes.
    """

    name: str
    target: str


class DeclarationFolder(Protocol):
    """A folder of declarations that no distribution has brought, such as one with add-ons of BenchBot v2."""

    @property
    def root(self) -> "Path":
        """The folder."""

    @property
    def name(self) -> str:
        """Its name in the provenance of results."""

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


@dataclass(frozen=True)
class DeclarationSource:
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


KINDS: Mapping[str, type] = {
    "simulators": Simulator,
    "robot_drivers": RobotDriver,
    "evaluators": Evaluator,
    "executors": Executor,
    "recorders": Recorder,
    "asset_packs": AssetPack,
    "commands": Command,
    "submission_modes": SubmissionMode,
    "routes": Routes,
    "declaration_sources": DeclarationSource,
}
"""Hooks that yield records, by the plural that names their pool."""
