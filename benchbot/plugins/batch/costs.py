"""The costs of each solution of a batch: wall time, processor time and GPUs; what is not measured is None."""

import math
import resource
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import Plan

MEASURED = ("native", "v2-client", "sandbox", "sandbox-landlock")
"""The modes whose solutions are children of the worker; an engine starts containers, not the worker."""


@dataclass(frozen=True)
class Cost:
    """The costs of one solution in hours, over all attempts, those that failed among them.

    Wall time is that of whole attempts, simulator included; CPU is that of the solution's own processes. GPU hours are
    those of GPUs that workers were given, used or not: what a program takes beside is not known. Attempts whose worker
    was lost or ended have no duration: they are counted as `cut_off`, and are not in the sums.
    """

    solution: str | None
    wall_hours: float
    cpu_hours: float | None
    gpu_hours: float | None
    attempts: int
    cut_off: int

    def __str__(self) -> str:
        """Return it as a line."""
        cut_off = f", {self.cut_off} more cut off and not counted" if self.cut_off else ""
        wall, cpu, gpus = (_hours(hours) for hours in (self.wall_hours, self.cpu_hours, self.gpu_hours))
        costs = f"wall time {wall}, CPU of the solution {cpu}, GPUs held {gpus}"
        return f"{self.solution or 'Costs'}: {costs}; {self.attempts - self.cut_off} attempts{cut_off}"


@contextmanager
def measured(mode: str, noted: dict[str, Any]) -> Iterator[None]:
    """Note as `cpu_s` the processor time of the children that have ended meanwhile, and of theirs; None: not known."""
    before_s = _children_cpu_s()
    try:
        yield
    finally:
        noted["cpu_s"] = round(_children_cpu_s() - before_s, 3) if mode in MEASURED else None


def _children_cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def of_batch(folder: Folder, plan: Plan) -> list[Cost]:
    """Return the costs of each solution so far, in the order of the plan."""
    found = []
    for name, alone in plan.each().items():
        entries = [folder.attempts(episode).entries() for episode in alone.episodes]
        ended = [entry for journal in entries for entry in journal if "duration_s" in entry]
        began = sum(bool(entry.get("began")) for journal in entries for entry in journal)
        gpu_s = [entry["gpus"] * entry["duration_s"] for entry in ended if entry.get("gpus")]
        found.append(
            Cost(
                solution=name,
                wall_hours=_sum_hours(entry["duration_s"] for entry in ended),
                cpu_hours=_sum_hours(entry["cpu_s"] for entry in ended)
                if ended and all(entry.get("cpu_s") is not None for entry in ended)
                else None,
                gpu_hours=_sum_hours(gpu_s) if len(gpu_s) == len(ended) > 0 else None,
                attempts=began,
                cut_off=max(0, began - len(ended)),
            )
        )
    return found


def _sum_hours(seconds: Iterable[float]) -> float:
    return math.fsum(seconds) / 3600


def _hours(hours: float | None) -> str:
    if hours is None:
        return "not measured"
    return f"{hours:.2f} h" if hours >= 1 else f"{hours * 60:.1f} min" if hours >= 1 / 60 else f"{hours * 3600:.1f} s"
