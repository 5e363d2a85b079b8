"""What there is of this user on this machine: runs, batches, and what was started from these screens."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from benchbot.plugins.tui import jobs, result_rows
from benchbot.plugins.tui.jobs import Job
from benchbot.plugins.watching import found
from benchbot.plugins.watching.views import BatchEntry
from benchbot.wire.run_state import RunState

RUNNING, WELL, BADLY = "running", "well", "badly"


@dataclass(frozen=True)
class Started:
    """A job, how it is (`running`, ended `well` or `badly`), and what came of it in a few words."""

    job: Job
    state: str
    said: str

    @property
    def title(self) -> str:
        """What was submitted, or run, and where."""
        options = dict(word.removeprefix("--").split("=", 1) for word in self.job.words if "=" in word)
        what = options.get("example") or options.get("native") or self.job.words[0]
        return "  ".join(filter(None, [what, options.get("env"), options.get("robot")]))

    @property
    def command(self) -> str:
        """The command, as it can be typed."""
        return shlex.join(["benchbot", *self.job.words])


@dataclass(frozen=True)
class Alive:
    """All of it, at one moment; the newest first."""

    runs: tuple[RunState, ...] = ()
    batches: tuple[BatchEntry, ...] = ()
    started: tuple[Started, ...] = ()


def look() -> Alive:
    """Return what there is now. It reads some small files, and takes some milliseconds."""
    return Alive(tuple(found.runs()), tuple(found.batches()), tuple(started(job) for job in jobs.jobs() if _worth(job)))


def run_named(text: str, runs: tuple[RunState, ...]) -> RunState | None:
    """Return the run that a part of its folder's name means, None unless it is exactly one."""
    fitting = [state for state in runs if text in Path(state.folder).name]
    return fitting[0] if len(fitting) == 1 else None


def _worth(job: Job) -> bool:
    """Runs and batches are listed as themselves; as jobs only when they could not begin."""
    if job.words[0] == "submit":
        return True
    log = jobs.log_of(job)
    return not job.alive and ("Error: " in log if job.words[0] == "batch" else "Ready." not in log)


def started(job: Job) -> Started:
    """Return how a job is, and what came of it."""
    if job.alive:
        return Started(job, RUNNING, "running")
    outcome = jobs.outcome_of(job)
    error = outcome.get("error")
    if error:
        return Started(job, BADLY, str(error["title"]))
    if "scores_path" in outcome:
        return Started(job, WELL, result_rows.headline_of(Path(outcome["scores_path"])) or "scored")
    if outcome.get("result_path"):
        return Started(job, WELL, "not scored")
    return Started(job, BADLY, last_error(jobs.log_of(job)))


def last_error(log: str) -> str:
    """Return the title of the last error in a log, or its last line."""
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    errors = [line.removeprefix("Error: ") for line in lines if line.startswith("Error: ")]
    return (errors or lines or ["it was ended"])[-1]
