"""The resources and options of a work order, as options of `sbatch`."""

import math
from collections.abc import Iterator

from benchbot.plugin import BenchbotError, Resources, WorkOrder, did_you_mean

WARNING_S = 60
"""A worker is told to end so long before its time is over."""
SHORTEST_MIN = 3
"""Slurm may send the warning a minute early, so there is no use in less."""
PASSED_ON = (
    "account",
    "begin",
    "comment",
    "constraint",
    "exclude",
    "gres",
    "licenses",
    "mail-type",
    "mail-user",
    "nice",
    "nodelist",
    "partition",
    "qos",
    "reservation",
    "tmp",
    "wckey",
)
"""The options of `sbatch` that a person may choose."""
SETUP = "setup"
"""The option that names a file which each worker's shell reads first, such as one that loads modules."""


def check(order: WorkOrder) -> None:
    """Raise BenchbotError for an option that there is not."""
    known = [*PASSED_ON, SETUP]
    for name in order.options:
        if name not in known:
            raise BenchbotError(
                f"Slurm's executor has no option {name}.",
                f"It knows {', '.join(sorted(known))}.{did_you_mean(name, known)}",
                "Correct --executor-option. Cores, GPUs, memory and time have options of their own: see benchbot batch "
                "--help.",
            )


def flags(order: WorkOrder) -> Iterator[str]:
    """Yield the options that the order's resources and options amount to."""
    yield from _resources(order.resources, own_gres="gres" in order.options)
    for name, value in order.options.items():
        if name != SETUP:
            yield f"--{name}={value}"


def _resources(resources: Resources, *, own_gres: bool) -> Iterator[str]:
    yield f"--cpus-per-task={resources.cpus}"
    if resources.memory_bytes is not None:
        yield f"--mem={math.ceil(resources.memory_bytes / 2**20)}M"
    if resources.gpus and not own_gres:
        yield f"--gres=gpu:{resources.gpus}"
    if resources.time_s is not None:
        yield f"--time={max(SHORTEST_MIN, math.ceil(resources.time_s / 60))}"
