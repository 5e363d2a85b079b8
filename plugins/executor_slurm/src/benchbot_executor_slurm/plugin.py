"""What this plug-in offers."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from benchbot.plugin import Executor, hookimpl

if TYPE_CHECKING:
    from benchbot.plugin import Workers, WorkOrder


@hookimpl
def benchbot_executors() -> Iterable[Executor]:
    """Yield `slurm`."""
    yield Executor("slurm", _launch, _attach, "An array job of a Slurm cluster; the folder must be on its shared disk.")


def _launch(order: "WorkOrder") -> "Workers":
    from benchbot_executor_slurm.submission import launch

    return launch(order)


def _attach(reference: str) -> "Workers":
    from benchbot_executor_slurm.array_job import ArrayJob

    return ArrayJob.attach(reference)
