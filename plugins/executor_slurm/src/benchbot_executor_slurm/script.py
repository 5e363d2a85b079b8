"""The script that each task of the array job runs."""

import shlex
from pathlib import Path

from benchbot.plugin import WorkOrder

NAME = '"$SLURMD_NODENAME-$SLURM_ARRAY_JOB_ID-$SLURM_ARRAY_TASK_ID-${SLURM_RESTART_COUNT:-0}"'
"""A worker's name: node, job, task and how often Slurm has begun it anew, so that no two are ever the same."""


def text(order: WorkOrder, setup: Path | None) -> str:
    """Return the script's text; `setup` is read by its shell first."""
    log = f'{shlex.quote(str(order.logs))}/"$name".log'
    lines = [
        "#!/bin/bash",
        f"name={NAME}",
        f"exec >>{log} 2>&1",
        *([] if setup is None else [f"source {shlex.quote(str(setup))}"]),
        # In the shell's own place, so that the warning which Slurm gives to the shell reaches the worker.
        f'exec {shlex.join(order.command)} --name "$name"',
    ]
    return "\n".join(lines) + "\n"
