"""The frozen records that hooks yield, and the protocols of what they hold; see `light_records` for the others."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from benchbot.core.documents import GroundTruth, Result

if TYPE_CHECKING:
    from pathlib import Path

    from benchbot.core.findings import Finding
    from benchbot.core.platform import Platform, PlatformSpec

API_VERSION = (1, 0)
"""The version of what `benchbot.plugin` promises, as (major, minor).

A plug-in says for which major version it was made by `PLUGIN_API = 1` in its module.
"""


Document = dict[str, Any]


@dataclass(frozen=True)
class Simulator:
    """A simulator, on which robots and environments of `type: <name>` run.

    `create` returns a fresh platform; it is called in a child process. `warm`, if given, prepares caches (compiled
    kernels) in the given folder, so that the first run starts fast; it prints nothing and returns what it did.
    `device`, if given, says in words what it would compute on here, with options of which one may be `device`: `auto`,
    `cpu` or `cuda`; it raises BenchbotError for a device that is not there, and is called before anything starts.
    """

    name: str
    create: Callable[["PlatformSpec"], "Platform"]
    warm: "Callable[[Path], str] | None" = None
    device: Callable[[Mapping[str, Any]], str] | None = None


@dataclass(frozen=True)
class RobotDriver:
    """Real robots of `type: <name>`; `create` as for a simulator.

    `diagnose`, if given, looks at a robot that is switched on and yields what works and what does not; it moves
    nothing. It is asked before the first motion of a run, in the process that drives: what is broken refuses the run.
    """

    name: str
    create: Callable[["PlatformSpec"], "Platform"]
    diagnose: Callable[["PlatformSpec"], "Iterable[Finding]"] | None = None


class Evaluate(Protocol):
    """Score one result against the ground truth of each of its scenes."""

    def __call__(self, result: Result, ground_truths: Sequence[GroundTruth]) -> dict[str, float]:
        """Return the scores by name; raise BenchbotError for a result that cannot be scored."""


class Combine(Protocol):
    """Make one summary of the scores of many results."""

    def __call__(self, scores: Sequence[dict[str, float]]) -> dict[str, float]:
        """Return the summary's scores by name; an empty dict in `scores` stands for a missing result."""


class Explain(Protocol):
    """Say how the scores of one result came about."""

    def __call__(self, result: Result, ground_truths: Sequence[GroundTruth]) -> Document:
        """Return what is added to the result's entry in an explanation (see its schema), such as `{"objects": […]}`.

        Raises what `evaluate` raises.
        """


@dataclass(frozen=True)
class Score:
    """The reading of a score: whether less of it is better, and the least and the greatest value that it can have.

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
    """The needs of one worker of a batch: processor cores, GPUs, bytes of memory and seconds of wall time at most.

    What is None is not limited, or left to the executor.
    """

    cpus: int = 1
    gpus: int = 0
    memory_bytes: int | None = None
    time_s: float | None = None


@dataclass(frozen=True)
class WorkOrder:
    """An order to an executor: launch `count` workers of the batch in `folder`, which all of them can write to.

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
