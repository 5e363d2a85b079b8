"""What this plug-in offers."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from benchbot.plugin import Executor, hookimpl

if TYPE_CHECKING:
    from benchbot.plugin import Workers, WorkOrder


@hookimpl
def benchbot_executors() -> Iterable[Executor]:
    """Yield `ray`."""
    yield Executor(
        "ray", _launch, _attach, "Actors of a Ray cluster; the folder must be on a disk that all nodes share."
    )


def _launch(order: "WorkOrder") -> "Workers":
    from benchbot_executor_ray.workers import launch

    return launch(order)


def _attach(reference: str) -> "Workers":
    from benchbot_executor_ray.workers import RayWorkers

    return RayWorkers(reference)
