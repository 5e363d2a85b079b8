"""The actor that holds one worker: it begins when a node has room for it, and anew elsewhere when its node is lost."""

import os
import socket
import subprocess
import sys
import time
import uuid
from dataclasses import dataclass
from pathlib import Path

import ray

PATIENCE_S = 20.0
"""So long a worker may take to end in order."""
PROBLEM_KEPT_S = 120.0
"""So long an actor that cannot work stays to be asked why."""


@dataclass(frozen=True)
class Work:
    """The worker process that an actor runs: its command, environment variables, time limit and working folder."""

    plan: Path
    logs: Path
    command: tuple[str, ...]
    environment: dict[str, str]
    time_s: float | None
    working_folder: Path


class WorkerActor:
    """An actor that runs one worker and ends with it."""

    def __init__(self, work: Work) -> None:
        self._work = work
        self._problem = _problem(work)
        self._process = None if self._problem else _start(work)
        # The actor waits in a task that it gives itself, since whoever made it may be gone by then.
        ray.get_runtime_context().current_actor.run.remote()

    def problem(self) -> str | None:
        """Return why the worker cannot run on this node, or None."""
        return self._problem

    def run(self) -> None:
        """Wait for the worker's end, then give the node's resources back."""
        if self._process is None:
            time.sleep(PROBLEM_KEPT_S)
        else:
            try:
                self._process.wait(self._work.time_s)
            except subprocess.TimeoutExpired:
                self.stop()
        ray.actor.exit_actor()  # type: ignore[no-untyped-call]

    def stop(self) -> None:
        """End the worker, in order first; returns when it has ended."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()
            self._process.wait()


def _problem(work: Work) -> str | None:
    node = socket.gethostname()
    if not work.plan.exists():
        return f"The node {node} has no {work.plan}: the batch's folder is not on a disk that it shares."
    if not Path(work.command[0]).exists():
        return f"The node {node} has no {work.command[0]}: BenchBot is not installed there in the same place."
    return None


def _start(work: Work) -> "subprocess.Popen[bytes]":
    name = f"{socket.gethostname()}-{uuid.uuid4().hex[:8]}"
    work.logs.mkdir(parents=True, exist_ok=True)
    with (work.logs / f"{name}.log").open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "benchbot_executor_ray.guard", str(PATIENCE_S), *work.command, "--name", name],
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=log,
            env={**os.environ, **work.environment},
            cwd=work.working_folder if work.working_folder.is_dir() else None,
            start_new_session=True,
        )
