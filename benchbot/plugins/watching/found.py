"""What there is to watch: the runs and batches of this user, started anywhere on this machine."""

from functools import lru_cache
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.driver_lock import REGISTER_LIMIT, registered_batches
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.watching.views import BatchEntry
from benchbot.wire import run_state
from benchbot.wire.run_state import RunState


def runs() -> list[RunState]:
    """Return the runs that are alive, newest first."""
    return run_state.live()


def batches() -> list[BatchEntry]:
    """Return the batches whose folders are still there, the one that was driven last first."""
    found = []
    for entry in registered_batches():
        folder = Folder(entry.folder)
        try:
            names = _episodes(folder.plan, folder.plan.stat().st_mtime_ns)
        except (BenchbotError, OSError):
            continue
        finished = sum(folder.result(name).is_file() for name in names)
        found.append(BatchEntry(entry.folder, entry.is_driven, entry.begun_s, len(names), finished))
    return found


@lru_cache(maxsize=REGISTER_LIMIT)
def _episodes(plan: Path, _changed_ns: int) -> tuple[str, ...]:
    """Return the names of a plan's episodes; a plan is long, and checked when it is read."""
    return tuple(episode.name for episode in plans.read(plan).episodes)
