"""Views of a run and of a batch for displays: immutable, each of one moment."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.plugins.batch.status import BatchStatus, Score
from benchbot.wire.run_state import RunState

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class FeedSnapshot:
    """The newest observation. Images may be subsampled: every n-th row and column, without averaging."""

    number: int
    """Grows with each observation of the run."""
    images: "Mapping[str, NDArray[Any]]"
    """`image_rgb` uint8 (H, W, 3), `image_depth` float32 (H, W) in metres; `image_class`, `image_instance` (H, W)."""
    laser: Mapping[str, Any] | None = None
    """The channel `laser`, as `channels` defines it."""
    poses: Mapping[str, Any] | None = None
    """The channel `poses`, as `channels` defines it: noisy where the task says so."""
    classes: Mapping[str, int] = field(default_factory=dict)
    """The numbers in `image_class`, by name."""
    stride: int = 1
    """The n of the subsampling."""


@dataclass(frozen=True)
class LogLine:
    """A line of a log, without control characters."""

    time_s: float
    """Seconds since the epoch: when it was written, or when it was read where the line does not say."""
    source: str
    """`supervisor`, `platform`, `solution` or `batch`."""
    level: str
    """`debug`, `info`, `warning` or `error`."""
    text: str
    is_exact: bool = True
    """Whether the line, or its log, tells when it was written; else `time_s` is when it was read, or guessed."""
    number: int = 0
    """Counts the lines as they were read."""


@dataclass(frozen=True)
class Usage:
    """Use by the supervisor of a run and the processes below it together; 100 % is one core.

    Of GPUs, the use by the whole machine: the share of the busiest one, and the memory of all; None without one.
    """

    cpu_percent: float
    memory_bytes: int
    gpu_percent: float | None = None
    gpu_memory_bytes: int | None = None


@dataclass(frozen=True)
class Sample:
    """A run's rates and load at one moment; None is what is not known, or means nothing of this run."""

    frames_per_s: float
    cpu_percent: float | None
    memory_bytes: int | None
    coverage: float | None
    """The share of the trajectory that has been driven, of a run that follows one."""


@dataclass(frozen=True)
class RunView:
    """A run at one moment. It holds what only the host of the run may know: it is not for solutions."""

    state: RunState
    alive: bool
    problem: str | None
    """The reason why nothing newer is known, in words."""
    session: Mapping[str, Any]
    """The description of the run, as in `GET /api/v1/session`; empty until the supervisor has answered once."""
    progress: Mapping[str, Any]
    """As in the events (docs/wire.md), with the true pose; empty until the supervisor has answered once."""
    paused: bool = False
    held: bool = False
    """Whether the solution waits at the gate."""
    driven_by_hand: int = 0
    last: Mapping[str, Any] | None = None
    """The newest action: `{action, arguments, outcome, result, by_hand}`."""
    path: tuple[tuple[float, float], ...] = ()
    """The path of the robot in this scene, x and y in metres."""
    frames_per_s: float = 0.0
    real_time_factor: float = 0.0
    usage: Usage | None = None
    history: tuple[Sample, ...] = ()
    """A sample for each second lately, oldest first."""
    snapshot: FeedSnapshot | None = None
    log: tuple[LogLine, ...] = ()
    """The newest lines, oldest first."""
    log_dropped: int = 0
    """The number of lines that were read before those."""
    result: Path | None = None
    """The file of the result, once it is written."""


@dataclass(frozen=True)
class EpisodeCell:
    """One episode of a batch."""

    name: str
    state: str
    """`pending`, `running`, `done`, or the class of its failure."""
    robot: str
    environment: str
    seed: int
    repeat: int
    worker: str | None
    since_s: float | None
    """Seconds since it was begun, while it runs."""
    log: Path | None = None
    """The output of its solution, where there is such a file."""
    solution: str = ""
    """The name of its solution, in a batch of several."""
    setting: str = ""
    """The settings, and the episode of the task, by which it differs from others of the batch."""
    score: float | None = None
    duration_s: float | None = None
    """The seconds of its last attempt, once it is finished."""
    attempts: int | None = None
    restarts: int | None = None

    @property
    def who(self) -> str:
        """The solution, if there are several, and the robot."""
        return f"{self.solution} · {self.robot}" if self.solution else self.robot


@dataclass(frozen=True)
class WorkerRow:
    """One worker of a batch."""

    name: str
    episode: str | None
    """The episode that it computes; None while it is idle."""
    since_s: float | None
    """Seconds for which it has computed that episode, or has been idle."""


@dataclass(frozen=True)
class BatchView:
    """A batch at one moment."""

    folder: Path
    alive: bool
    """Whether a driver is attached, or workers run."""
    problem: str | None
    status: BatchStatus | None
    """None until its folder has been read once."""
    cells: tuple[EpisodeCell, ...] = ()
    """All episodes, in the order of the plan."""
    workers: tuple[WorkerRow, ...] = ()
    scores: Mapping[str | None, Score] = field(default_factory=dict)
    """The score so far of each solution that has one; of a batch of one solution, by None."""


@dataclass(frozen=True)
class BatchEntry:
    """A batch of this user, as a list shows it."""

    folder: Path
    alive: bool
    begun_s: float
    """When its driver was last started, in seconds since the epoch."""
    episodes: int
    finished: int
    failures: Mapping[str, int] = field(default_factory=dict)
    """Finished episodes that did not end well, by class of failure."""
    score: Score | None = None
    """The score in its scores document, of a batch of one solution that has been scored."""
