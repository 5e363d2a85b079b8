"""What a display is given: views of a run and of a batch, each of one moment, that nobody changes any more."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from benchbot.plugins.batch.status import BatchStatus
from benchbot.wire.run_state import RunState


@dataclass(frozen=True)
class Look:
    """The newest observation. Images may have been thinned out: every n-th row and column, nothing in between."""

    number: int
    """Grows with each observation of the run."""
    images: Mapping[str, NDArray[Any]]
    """`image_rgb` uint8 (H, W, 3), `image_depth` float32 (H, W) in metres; `image_class`, `image_instance` (H, W)."""
    laser: Mapping[str, Any] | None = None
    """The channel `laser`, as `channels` defines it."""
    poses: Mapping[str, Any] | None = None
    """The channel `poses`, as `channels` defines it: noisy where the task says so."""
    classes: Mapping[str, int] = field(default_factory=dict)
    """The names of the numbers in `image_class`."""
    stride: int = 1
    """Which n that was."""


@dataclass(frozen=True)
class LogLine:
    """A line that somebody wrote, without control characters."""

    time_s: float
    """Seconds since the epoch: when it was written, or where that is not told, when it was read."""
    source: str
    """`supervisor`, `platform`, `solution` or `batch`."""
    level: str
    """`debug`, `info`, `warning` or `error`."""
    text: str


@dataclass(frozen=True)
class Usage:
    """What the supervisor of a run and the processes below it use together; 100 % is one core.

    Of GPUs, what the whole machine uses: the share of the busiest one, and the memory of all; None without one.
    """

    cpu_percent: float
    memory_bytes: int
    gpu_percent: float | None = None
    gpu_memory_bytes: int | None = None


@dataclass(frozen=True)
class RunView:
    """A run at one moment. What its host may know is in it: it is not for solutions."""

    state: RunState
    alive: bool
    problem: str | None
    """Why nothing newer is known, in words."""
    session: Mapping[str, Any]
    """What is run, as `GET /api/v1/session` tells it; empty until the supervisor has answered once."""
    progress: Mapping[str, Any]
    """As the events tell it (docs/wire.md), with the true pose; empty until the supervisor has answered once."""
    paused: bool = False
    held: bool = False
    """Whether the solution waits at the gate."""
    driven_by_hand: int = 0
    last: Mapping[str, Any] | None = None
    """The newest action: `{action, arguments, outcome, result, by_hand}`."""
    path: tuple[tuple[float, float], ...] = ()
    """Where the robot has been in this scene, x and y in metres."""
    frames_per_s: float = 0.0
    real_time_factor: float = 0.0
    usage: Usage | None = None
    look: Look | None = None
    log: tuple[LogLine, ...] = ()
    """The newest lines, oldest first."""
    log_dropped: int = 0
    """How many lines were read that came before those."""
    result: Path | None = None
    """Where the result is, once it is written."""


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
    """What its solution printed, where there is such a file."""


@dataclass(frozen=True)
class WorkerRow:
    """One worker of a batch."""

    name: str
    episode: str | None
    """What it computes; None while it computes nothing."""
    since_s: float | None
    """For how long it has done so, or has been idle."""


@dataclass(frozen=True)
class BatchView:
    """A batch at one moment."""

    folder: Path
    alive: bool
    """Whether somebody drives it, or workers run."""
    problem: str | None
    status: BatchStatus | None
    """None until its folder has been read once."""
    cells: tuple[EpisodeCell, ...] = ()
    """All episodes, in the order of the plan."""
    workers: tuple[WorkerRow, ...] = ()


@dataclass(frozen=True)
class BatchEntry:
    """A batch of this user, as a list shows it."""

    folder: Path
    alive: bool
    begun_s: float
    """When somebody last began to drive it, in seconds since the epoch."""
    episodes: int
    finished: int
