"""Where things are in the folder of a batch. The folder is the truth: whoever drives or works can die at any moment.

plan.json             what is to be computed (schema `plan`), written first
episodes/LABEL-KEY8/  result.json (there: done), log.txt, recordings, attempts.jsonl, attempt-N/ (what failed)
claims/KEY            who works on an episode just now
events/WORKER.jsonl   what happened, a file per worker
workers/WORKER.log    what the process of a worker has printed
crew.json             how the workers are launched: which executor, how many, what each needs
executor.json         which workers run, for drivers that come later
cancelled             a word to the driver: end all of them
driver.lock           held by who drives the batch; driver.log is what a detached driver has printed
conclusion.json       of a detached batch: what was made of the results at its end
results/, scores.json, report.html, junit.xml, results.zip    what `benchbot batch` makes of them at the end
"""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Folder:
    """The paths in a batch's folder."""

    path: Path

    @property
    def plan(self) -> Path:
        """The plan."""
        return self.path / "plan.json"

    @property
    def claims(self) -> Path:
        """The folder of claims."""
        return self.path / "claims"

    @property
    def events(self) -> Path:
        """The folder of event logs."""
        return self.path / "events"

    @property
    def workers(self) -> Path:
        """The folder of what workers print."""
        return self.path / "workers"

    @property
    def crew(self) -> Path:
        """How the workers are launched."""
        return self.path / "crew.json"

    @property
    def cancelled(self) -> Path:
        """There when the batch is to be ended."""
        return self.path / "cancelled"

    @property
    def executor(self) -> Path:
        """Which workers run."""
        return self.path / "executor.json"

    @property
    def driver_lock(self) -> Path:
        """Held by who drives the batch on this machine."""
        return self.path / "driver.lock"

    @property
    def driver_log(self) -> Path:
        """What a detached driver has printed."""
        return self.path / "driver.log"

    @property
    def conclusion(self) -> Path:
        """What a detached batch's results were made into, or why they could not be."""
        return self.path / "conclusion.json"

    @property
    def episodes(self) -> Path:
        """The folder of episodes."""
        return self.path / "episodes"

    def episode(self, name: str) -> Path:
        """The folder of one episode."""
        return self.episodes / name

    def result(self, name: str) -> Path:
        """The result of one episode: where it is, the episode is done."""
        return self.episode(name) / "result.json"
