"""A feed of a batch: a thread that reads its folder again and again, and keeps the newest view of it."""

import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import driver
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.driver_lock import driver_lock, registered
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import PlannedEpisode
from benchbot.plugins.batch.status import BatchStatus, Monitor
from benchbot.plugins.batch.worker_pool import WorkerPool, count_alive
from benchbot.plugins.watching.batch_score import BatchScore
from benchbot.plugins.watching.views import BatchView, EpisodeCell, WorkerRow

PERIOD_S = 0.5
COUNT_PERIOD_S = 5.0
"""How often the executor is asked for its workers: on a cluster, that is a command."""
CLOSE_TIMEOUT_S = 1.0


class BatchFeed:
    """Keeps `view` up to date until it is closed. Commands wait, and raise BenchbotError: call them in a thread."""

    def __init__(self, folder: Path, *, period_s: float = PERIOD_S) -> None:
        self.folder = folder.absolute()
        self._folder = Folder(self.folder)
        self._view = BatchView(self.folder, alive=False, problem="Nothing is known yet.", status=None)
        self._period_s = period_s
        self._monitor: Monitor | None = None
        self._score = BatchScore(self._folder)
        self._counted: tuple[float, int] = (float("-inf"), -1)
        self._done: dict[str, EpisodeCell] = {}
        self._wake = threading.Event()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._keep_up, name="benchbot-batch-feed", daemon=True)
        self._thread.start()

    @property
    def view(self) -> BatchView:
        """The newest view."""
        return self._view

    def cancel(self) -> None:
        """End the batch's workers. What is finished stays."""
        driver.cancel(self._folder)
        self._look_anew()

    def retry(self, classes: Sequence[str]) -> int:
        """Have episodes that failed like this computed once more, with nobody looking on; return how many.

        Raises BenchbotError while somebody drives the batch.
        """
        with driver_lock(self._folder):
            count = driver.retry(self._folder, ",".join(classes) or None)
        if count:
            driver.detach(self._folder, replace(WorkerPool.read(self._folder), detached=True))
        self._look_anew()
        return count

    def close(self) -> None:
        """End the thread. The batch goes on."""
        self._closed.set()
        self._wake.set()
        self._thread.join(CLOSE_TIMEOUT_S)

    def _look_anew(self) -> None:
        # What was finished may be pending again: a monitor reads it once.
        self._monitor = None
        self._counted = (float("-inf"), -1)
        self._wake.set()

    def _keep_up(self) -> None:
        while not self._closed.is_set():
            self._wake.clear()
            try:
                self._view = self._seen()
            except (BenchbotError, OSError) as error:
                # It may be there again: on a shared disk, folders come and go.
                self._view = replace(self._view, alive=False, problem=str(error))
            self._wake.wait(self._period_s)

    def _seen(self) -> BatchView:
        monitor = self._monitor
        if monitor is None:
            monitor = self._monitor = Monitor(self._folder, plans.read(self._folder.plan))
            self._done = {}
        status = monitor.look(self._workers())
        self._view = replace(self._view, status=replace(status, score=self._score.value), problem=None)
        status = replace(status, score=self._score.update(monitor, status))
        entry = registered(self.folder)
        return BatchView(
            folder=self.folder,
            alive=(entry is not None and entry.is_driven) or status.workers > 0,
            problem=None,
            status=status,
            cells=self._cells(monitor, status),
            workers=_workers(monitor, status),
        )

    def _workers(self) -> int:
        counted_s, count = self._counted
        if time.monotonic() - counted_s > COUNT_PERIOD_S:
            count = count_alive(self._folder)
            self._counted = time.monotonic(), count
        return count

    def _cells(self, monitor: Monitor, status: BatchStatus) -> tuple[EpisodeCell, ...]:
        running = {each.episode: each for each in status.running}
        cells = []
        for episode in monitor.plan.episodes:
            cell = self._done.get(episode.key)
            finished = monitor.finished.get(episode.key)
            if cell is None and finished is not None:
                log = self._folder.episode(episode.name) / "log.txt"
                cell = _cell(episode, str(finished.failure or "done"), finished.worker, None, log)
                self._done[episode.key] = cell
            elif cell is None and episode.name in running:
                now = running[episode.name]
                cell = _cell(episode, "running", now.worker, now.since_s, self._newest_log(episode))
            cells.append(cell or _cell(episode, "pending", None, None, None))
        return tuple(cells)

    def _newest_log(self, episode: PlannedEpisode) -> Path | None:
        logs = self._folder.episode(episode.name).glob("attempt-*/log.txt")
        return max(logs, key=lambda path: (len(path.parent.name), path.parent.name), default=None)


def _cell(
    episode: PlannedEpisode, state: str, worker: str | None, since_s: float | None, log: Path | None
) -> EpisodeCell:
    return EpisodeCell(
        name=episode.name,
        state=state,
        robot=episode.robot,
        environment=episode.environment,
        seed=episode.seed,
        repeat=episode.repeat or 0,
        worker=worker,
        since_s=since_s,
        log=log,
    )


def _workers(monitor: Monitor, status: BatchStatus) -> tuple[WorkerRow, ...]:
    busy = [WorkerRow(each.worker, each.episode, each.since_s) for each in status.running]
    idle = [WorkerRow(name, None, monitor.since_last_event_s(name)) for name in status.idle if not status.is_complete]
    return tuple(sorted([*busy, *idle], key=lambda row: row.name))
