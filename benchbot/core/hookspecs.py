"""The hooks that a plug-in may implement, and the frozen records that they yield.

A plug-in is a module (or object) named by an entry point in the group `benchbot`. It marks its implementations with
`benchbot.hookimpl`. Keep the module light: import heavy things inside `create` and `evaluate`.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import pluggy

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable
    from pathlib import Path

    from benchbot.core.findings import Finding
    from benchbot.core.platform import Platform, PlatformSpec
    from benchbot.core.recording import Recording

PROJECT = "benchbot"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)

Document = dict[str, Any]


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
    """

    name: str
    target: str
    help: str


@hookspec
def benchbot_tasks() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield task declarations: YAML files, or folders of them."""


@hookspec
def benchbot_robots() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield robot declarations: YAML files, or folders of them."""


@hookspec
def benchbot_environments() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield environment declarations: YAML files, or folders of them."""


@hookspec
def benchbot_formats() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield declarations of result and ground-truth formats: YAML files, or folders of them."""


@hookspec
def benchbot_ground_truths() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield ground truths: JSON files, or folders of them. They are read by evaluation only."""


@hookspec
def benchbot_examples() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield declarations of example solutions: YAML files, or folders of them."""


@hookspec
def benchbot_batches() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield batch declarations (named lists of environments): YAML files, or folders of them."""


@hookspec
def benchbot_episodes() -> "Iterable[Traversable | Path]":  # type: ignore[empty-body]
    """Yield episode lists: JSON files, or folders of them."""


@hookspec
def benchbot_simulators() -> Iterable[Simulator]:  # type: ignore[empty-body]
    """Yield simulators."""


@hookspec
def benchbot_robot_drivers() -> Iterable[RobotDriver]:  # type: ignore[empty-body]
    """Yield drivers of real robots."""


@hookspec
def benchbot_evaluators() -> Iterable[Evaluator]:  # type: ignore[empty-body]
    """Yield methods of evaluation."""


@hookspec
def benchbot_executors() -> Iterable[Executor]:  # type: ignore[empty-body]
    """Yield executors of batches."""


@hookspec
def benchbot_recorders() -> Iterable[Recorder]:  # type: ignore[empty-body]
    """Yield recorders of sessions."""


@hookspec
def benchbot_asset_packs() -> Iterable[AssetPack]:  # type: ignore[empty-body]
    """Yield packs of models for scenes."""


@hookspec
def benchbot_commands() -> Iterable[Command]:  # type: ignore[empty-body]
    """Yield sub-commands of `benchbot`."""


KINDS: Mapping[str, type] = {
    "simulators": Simulator,
    "robot_drivers": RobotDriver,
    "evaluators": Evaluator,
    "executors": Executor,
    "recorders": Recorder,
    "asset_packs": AssetPack,
    "commands": Command,
}
"""Hooks that yield records, by the plural that names their pool."""
