"""Calls of Slurm's command-line tools."""

import shutil
import subprocess
from dataclasses import dataclass

from benchbot.plugin import BenchbotError

PATIENCE_S = 60.0


@dataclass(frozen=True)
class Answer:
    """The outcome of a command: its exit code (None: it did not answer), stdout and stderr."""

    code: int | None
    said: str
    complaint: str


def ask(*words: str) -> Answer:
    """Run one of Slurm's commands."""
    try:
        ended = subprocess.run(
            words, check=False, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=PATIENCE_S
        )
    except OSError as error:
        return Answer(None, "", f"{words[0]} cannot be run: {error.strerror}")
    except subprocess.TimeoutExpired:
        return Answer(None, "", f"{words[0]} did not answer within {PATIENCE_S:g} s")
    return Answer(ended.returncode, ended.stdout.strip(), ended.stderr.strip())


def check_here() -> None:
    """Raise BenchbotError on a machine that cannot submit anything."""
    if shutil.which("sbatch") is None:
        raise BenchbotError(
            "There is no Slurm here.",
            "No command sbatch is on PATH.",
            "Run this on a login node of the cluster, load the module that brings Slurm's commands, or leave "
            "--executor away to run the batch on this machine.",
        )
