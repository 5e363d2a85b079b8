"""What the tests of the supervisor and of its clients share."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import httpx

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.request import NO_LIMITS, Limits, RunRequest
from benchbot.core.selection import Selection, select
from benchbot.supervisor.platform.host import ChildHost
from benchbot.supervisor.run import Run

TOKEN = "the-token-of-this-run"
OPERATOR_TOKEN = "the-token-of-its-operator"


def sample_selection(
    task: str = "sample:passive",
    environment: str = "arena:1",
    robot: str = "sample_robot",
    seed: int = 0,
    limits: Limits | None = None,
    episode: int | None = None,
    secret: str = "",
) -> Selection:
    return select(
        Catalog(plugin_manager.load()),
        RunRequest(
            task=task,
            robot=robot,
            environment=environment,
            seed=seed,
            limits=limits or NO_LIMITS,
            episode=episode,
            secret=secret,
        ),
    )


@dataclass(frozen=True)
class Served:
    """A run behind a real server, and the platform processes that it has had."""

    run: Run
    url: str
    hosts: list[ChildHost]

    def http(self, token: str = TOKEN) -> httpx.Client:
        headers = {"Authorization": f"Bearer {token}", "Accept": "application/msgpack, application/json"}
        return httpx.Client(base_url=self.url, timeout=60, headers=headers)


def alive(pid: int) -> bool:
    """Say whether a process runs; a zombie, which only waits for its parent, does not."""
    try:
        os.kill(pid, 0)
        state = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[0]
    except (ProcessLookupError, FileNotFoundError):
        return False
    return state != "Z"


def children_of(pid: int) -> list[int]:
    """Return the process numbers of a process's children."""
    listed = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(number) for path in listed for number in path.read_text("utf-8").split()]


def eventually(condition: Callable[[], bool], patience_s: float = 20.0) -> bool:
    """Say whether a condition comes true, looking again and again."""
    deadline_s = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.02)
    return True
