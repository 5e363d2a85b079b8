"""The score of a batch for those who look on: the final one where it is made, else that of what is finished."""

from contextlib import suppress
from pathlib import Path

from benchbot.core import scores
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.plugins.batch.finalization import LiveScore, headline
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.status import BatchStatus, Monitor, Score


class BatchScore:
    """Kept up to date by `update`, which may take a while; `value` is the newest."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        self._live: LiveScore | None = None
        self._read: tuple[int, int] | None = None
        self.value: Score | None = None

    def update(self, monitor: Monitor, status: BatchStatus) -> Score | None:
        """Return the score of what is finished."""
        if status.is_complete and self._final(self._folder.path / "scores.json", status.finished):
            return self.value
        if monitor.plan.method is not None and status.finished:
            if self._live is None:
                self._live = LiveScore(self._folder, monitor.plan.method, Catalog(load()))
            self.value = self._live.update(monitor)
        return self.value

    def _final(self, path: Path, count: int) -> bool:
        """Read the scores that were made at the end; say whether there are some."""
        with suppress(OSError, BenchbotError):
            about = path.stat()
            version = about.st_mtime_ns, about.st_size
            if version != self._read:
                self.value, self._read = headline(scores.read(path), count), version
            return True
        return False
