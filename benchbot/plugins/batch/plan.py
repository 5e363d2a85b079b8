"""The plan of a batch: its episodes, hashed, and written before anything starts."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from benchbot.cli.kit.holding import CONTAINER, NATIVE, SANDBOX, V2_CLIENT
from benchbot.core import results
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.request import AUTO, Limits, RunRequest, canonical, digest
from benchbot.evaluation import batch_folder
from benchbot.submission.modes import DEFAULT_LIMITS, LOG_LIMIT_BYTES, ProcessLimits

VERSION = 2
KEY_DIGITS = batch_folder.KEY_DIGITS

SceneKey = tuple[str, str, str]
"""The scene that a simulator has loaded: robot, environment, and settings (as JSON)."""


@dataclass(frozen=True)
class Policy:
    """The rules for what goes wrong in a batch."""

    retries: int = 2
    """After failures of platform or infrastructure; a failure of the solution is a result."""
    rerun_collided: int = 0
    stall_s: float = 1800.0
    """A solution that makes no progress for so long is ended; 0 is never."""
    stale_s: float = 30.0
    """A worker that is silent for so long has lost its claim."""
    minimum_free_bytes: int = 200 * 2**20
    log_limit_bytes: int = LOG_LIMIT_BYTES
    """The size of an episode's log, which keeps beginning and end of what the solution prints."""
    canary: bool = True
    """Whether the first episode of each solution is computed before all others, and may end the batch."""
    fail_on_error: int | float | None = None
    """The number of failed episodes that ends the batch, or a fraction of all of them."""


@dataclass(frozen=True)
class Hold:
    """What holds a solution: a sandbox, or the container of a `dockerfile` in a folder, its `context`; or nothing."""

    sandboxed: bool = False
    readable: tuple[str, ...] = ()
    context: str | None = None
    dockerfile: str | None = None
    weak_limits: bool = False
    limits: ProcessLimits = DEFAULT_LIMITS
    v2_client: bool = False
    """Whether it uses the client of BenchBot v2."""

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Self:
        """Return what was written into a plan."""
        limits = ProcessLimits(**document["limits"])
        return cls(**{**document, "readable": tuple(document["readable"]), "limits": limits})

    def in_mode(self, gpus: int = 0) -> tuple[str, dict[str, Any]]:
        """Return the submission mode, and its options; `gpus` are given to a container."""
        if self.context is not None:
            options = {"context": self.context, "dockerfile": self.dockerfile}
            limited = {"weak_limits": self.weak_limits, "gpus": gpus}
            return CONTAINER, {**options, **limited, "v2_client": self.v2_client}
        if self.sandboxed:
            return SANDBOX, {"readable": self.readable, "weak_limits": self.weak_limits}
        return V2_CLIENT if self.v2_client else NATIVE, {}

    def determines(self) -> dict[str, Any]:
        """Return what of it may change a result; nothing for a native solution."""
        if self == type(self)():
            return {}
        held = asdict(replace(self, context=None, dockerfile=None))
        if not self.v2_client:
            del held["v2_client"]
        return {"hold": {**held, "contained": self.context is not None}}


@dataclass(frozen=True)
class PlannedSolution:
    """The solution of each episode: a command or an example, or a container; its files and their snapshot, by hash."""

    native: str | None
    example: str | None
    words: tuple[str, ...]
    folder: str
    files: Mapping[str, str]
    hold: Hold = Hold()
    source: tuple[str, ...] = ()
    """Globs of files that count beside those that its command leads to."""
    snapshot: str = ""


@dataclass(frozen=True)
class PlannedEpisode:
    """One unit of work. `key` is the SHA-256 of all that determines its result; `repeat` is None without repeats."""

    key: str
    label: str
    robot: str
    environment: str
    seed: int
    repeat: int | None = None
    episode: int | None = None
    settings: Mapping[str, Any] = field(default_factory=dict, hash=False)
    solution: str | None = None
    """The name of its solution, in a batch of several."""

    @property
    def name(self) -> str:
        """The name of its folder."""
        return batch_folder.episode_name(self.label, self.key)

    @cached_property
    def scene(self) -> SceneKey:
        """The scene that a simulator must have loaded for it."""
        return self.robot, self.environment, canonical(self.settings).decode()


@dataclass(frozen=True)
class Plan:
    """A batch: one task, one solution or several, many episodes.

    `hash` says which one; two of the same hash compute the same.
    """

    hash: str
    task: str
    method: str | None
    solution: PlannedSolution
    limits: Limits
    timeout_s: float | None
    record: tuple[str, ...]
    policy: Policy
    episodes: tuple[PlannedEpisode, ...]
    solutions: Mapping[str, PlannedSolution] = field(default_factory=dict)
    """The solutions of a batch of several, by name; `solution` is then the first of them."""
    secret: str = field(default="", repr=False)
    """That of all episodes (benchbot.core.randomness); empty for none."""
    device: str = AUTO
    """What to simulate on; each result says what that was."""
    grown_from: tuple[int, ...] = ()
    """The numbers of episodes that it had before more were added, when results of it could be seen already."""

    @property
    def all_solutions(self) -> "Mapping[str | None, PlannedSolution]":
        """The solutions by name; the only one of a batch without names by None."""
        named: dict[str | None, PlannedSolution] = {name: self.solutions[name] for name in self.solutions}
        return named or {None: self.solution}

    @property
    def snapshots(self) -> dict[str, None]:
        """The hashes of the snapshots that are run."""
        return dict.fromkeys(solution.snapshot for solution in self.all_solutions.values())

    @property
    def robots(self) -> list[str]:
        """The robots, in the order of the plan."""
        return list(dict.fromkeys(episode.robot for episode in self.episodes))

    @property
    def environments(self) -> list[str]:
        """The environments, in the order of the plan."""
        return list(dict.fromkeys(episode.environment for episode in self.episodes))

    def each(self) -> "dict[str | None, Plan]":
        """Return the part of each solution, by its name, as a plan of that one alone; by None when it has no name."""
        if not self.solutions:
            return {None: self}
        episodes = {name: tuple(each for each in self.episodes if each.solution == name) for name in self.solutions}
        return {
            name: replace(self, solution=solution, episodes=episodes[name], solutions={})
            for name, solution in self.solutions.items()
        }

    def request_of(self, episode: PlannedEpisode) -> RunRequest:
        """Return what is run in an episode."""
        return RunRequest(
            task=self.task,
            robot=episode.robot,
            environment=episode.environment,
            seed=episode.seed,
            episode=episode.episode,
            settings=episode.settings,
            limits=self.limits,
            secret=self.secret,
            device=self.device,
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as the JSON document that is written."""
        document = {"version": VERSION, **asdict(self)}
        if not self.secret:
            del document["secret"]
        if not self.grown_from:
            del document["grown_from"]
        return document


def plan_hash(episodes: tuple[PlannedEpisode, ...]) -> str:
    """Return the identity of a batch: what it computes. How that is scored may change."""
    return digest([episode.key for episode in episodes])


def write(path: Path, plan: Plan) -> None:
    """Write a plan atomically; raises BenchbotError when it cannot be written."""
    results.write_json(path, plan.as_dict())


def read(path: Path) -> Plan:
    """Return the plan in a batch's folder; raises BenchbotError when there is none, or it is not what was written."""
    if not path.is_file():
        raise BenchbotError(
            f"There is no batch in {path.parent}.",
            f"It has no {path.name}.",
            "Name the folder of a batch, as benchbot batch has printed it.",
        )
    document = schema.read(path)
    if document.get("version") == 1:
        raise BenchbotError(
            f"The batch in {path.parent} was begun by an older BenchBot.",
            "That one ran the solution from where it lies, and kept no snapshot of it: nobody can say which one ran.",
            "Begin it again in another folder: benchbot batch --output-location FOLDER …",
        )
    schema.check(document, "plan", path)
    episodes = tuple(PlannedEpisode(**entry) for entry in document["episodes"])
    if document["hash"] != plan_hash(episodes):
        raise BenchbotError(
            f"{path} was changed by hand.",
            "Its hash is not that of its episodes.",
            "Begin the batch again with another command: benchbot batch --output-location FOLDER …",
        )
    return Plan(
        hash=document["hash"],
        task=document["task"],
        method=document["method"],
        solution=_solution(document["solution"]),
        limits=Limits(**document["limits"]),
        timeout_s=document["timeout_s"],
        record=tuple(document["record"]),
        policy=Policy(**document["policy"]),
        episodes=episodes,
        solutions={name: _solution(one) for name, one in document.get("solutions", {}).items()},
        secret=document.get("secret", ""),
        device=document.get("device", AUTO),
        grown_from=tuple(document.get("grown_from", ())),
    )


def _solution(document: Mapping[str, Any]) -> PlannedSolution:
    solution = {"hold": asdict(Hold()), **document}
    texts = {name: tuple(solution[name]) for name in ("words", "source")}
    return PlannedSolution(**{**solution, **texts, "hold": Hold.from_dict(solution["hold"])})
