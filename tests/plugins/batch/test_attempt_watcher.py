"""What a worker sees to while a solution runs."""

import os
from pathlib import Path

from benchbot.core.errors import FailureClass
from benchbot.plugins.batch.attempt_watcher import AttemptWatcher
from benchbot.plugins.batch.memory import MemoryWatch

PROGRESS = {"state": "dirty", "frames": 1, "steps": 1, "waiting_for": None, "paused": False}


def test_a_solution_that_stands_still_is_stuck_unless_somebody_holds_it(tmp_path: Path) -> None:
    memory = MemoryWatch(os.getpid())
    memory.begin()
    with AttemptWatcher(tmp_path, 1e-9, lambda: True, memory) as watcher:
        assert watcher.look(PROGRESS, 1) is None
        assert all(watcher.look({**PROGRESS, "paused": True}, 1) is None for _ in range(3))
        stuck = watcher.look(PROGRESS, 1)
    assert stuck is not None
    assert stuck.failure is FailureClass.TIMEOUT
