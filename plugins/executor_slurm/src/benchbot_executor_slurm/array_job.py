"""An array job of workers: how many are left, and how to end it."""

import json
import time
from typing import Self

from benchbot.plugin import BenchbotError
from benchbot_executor_slurm import nodes
from benchbot_executor_slurm.commands import ask

BROKEN_NODE = (
    "A node could not start them, as its slurmd says in its log: leave the node out by --executor-option exclude=NODE, "
    "and tell those who run the cluster. Then run the same command again."
)
ASK_AGAIN_S = 5.0
"""Slurm's controller serves a whole cluster, so it is not asked more often."""
UNKNOWN = "Invalid job id"
LAUNCH_FAILED = "launch failed requeued held"
NEVER = frozenset(
    {
        "AccountNotAllowed",
        "BadConstraints",
        "InvalidAccount",
        "InvalidQOS",
        "PartitionConfig",
        "PartitionNodeLimit",
        "PartitionTimeLimit",
        "QOSNotAllowed",
        LAUNCH_FAILED,
    }
)
"""Why a task that waits will wait until a person helps. Some sites refuse such a job at once, others queue it."""


class ArrayJob:
    """The workers of one submission."""

    def __init__(self, job: str, count: int) -> None:
        self.job = job
        self._count = count
        self._asked_s: float | None = None

    @classmethod
    def attach(cls, reference: str) -> Self:
        """Return the workers of a reference."""
        document = json.loads(reference)
        return cls(document["job"], document["count"])

    @property
    def reference(self) -> str:
        """The number of the job, and how many workers it had."""
        return json.dumps({"job": self.job, "count": self._count})

    def alive(self) -> int:
        """Return how many workers run or wait; as many as before while the controller does not answer.

        Raises BenchbotError, and cancels the job, when all that is left waits for what will never be.
        """
        if self._asked_s is None or time.monotonic() - self._asked_s >= ASK_AGAIN_S:
            answer = ask("squeue", "--noheader", "--array", f"--jobs={self.job}", "--format=%T|%r")
            # The controller forgets a job some minutes after its end.
            if answer.code == 0 or UNKNOWN in answer.complaint:
                tasks = [line.split("|") for line in answer.said.splitlines()]
                hopeless = [reason for state, reason in tasks if state == "PENDING" and reason in NEVER]
                self._count = len(tasks) - len(hopeless)
                if hopeless and not self._count:
                    self.stop()
                    raise BenchbotError(
                        "Slurm will never run the batch's workers.",
                        f"They waited for its reason {hopeless[0]}, and have been cancelled.",
                        BROKEN_NODE if hopeless[0] == LAUNCH_FAILED else f"{nodes.ADVICE} {nodes.offer()}",
                    )
            self._asked_s = time.monotonic()
        return self._count

    def stop(self) -> None:
        """Cancel the job: Slurm sends SIGTERM, and SIGKILL to what is left after its KillWait."""
        answer = ask("scancel", self.job)
        if answer.code != 0 and UNKNOWN not in answer.complaint:
            raise BenchbotError(
                f"Slurm's job {self.job} could not be cancelled.",
                answer.complaint or "scancel does not say why.",
                f"Try again, or: scancel {self.job}",
            )
        self._asked_s = None
