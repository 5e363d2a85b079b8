"""A feed of a batch: a thread that polls its folder and keeps the newest view of it.

The driver of batches is imported where it is needed: it imports the supervisor, and the first screen does not need it.
"""

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.core.results import read_scores
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.attempts import Finished
from benchbot.plugins.batch.counting import BatchCounter
from benchbot.plugins.batch.driver_lock import driver_lock, registered
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import PlannedEpisode
from benchbot.plugins.batch.status import BatchStatus, Monitor, RunningEpisode, Score
from benchbot.plugins.watching.batch_list import plan_stamp
from benchbot.plugins.watching.views import BatchView, EpisodeCell, WorkerRow

if TYPE_CHECKING:
    from benchbot.plugins.batch.finalization import LiveScore

PERIOD_S = 0.5
COUNT_PERIOD_S = 5.0
"""The period in which the executor counts its workers: on a cluster, that is a command."""
CLOSE_TIMEOUT_S = 1.0


class BatchFeed:
    """Keeps `view` up to date until it is closed. Commands wait, and raise BenchbotError: call them in a thread."""

    def __init__(self, folder: Path, *, period_s: float = PERIOD_S) -> None:
        self.folder = folder.absolute()
        self._folder = Folder(self.folder)
        self._view = BatchView(self.folder, alive=False, problem="Nothing is known yet.", status=None)
        self._period_s = period_s
        self._monitor: Monitor | None = None
        self._plan_stamp = ""
        self._score = _BatchScore(self._folder)
        self._counted: tuple[float, int] = (float("-inf"), -1)
        self._finished: dict[str, tuple[Finished, float | None, EpisodeCell]] = {}
        self._settings: dict[str, str] = {}
        self._shown: tuple[int, tuple[RunningEpisode, ...], object] | None = None
        """The changes, the running episodes and the scores that the view's cells are of."""
        self._wake = threading.Event()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._poll, name="benchbot-batch-feed", daemon=True)
        self._thread.start()

    @property
    def view(self) -> BatchView:
        """The newest view."""
        return self._view

    def cancel(self) -> None:
        """End the batch's workers. Finished episodes stay."""
        from benchbot.plugins.batch import driver

        driver.cancel(self._folder)
        self._begin_anew()

    def retry(self, classes: Sequence[str]) -> int:
        """Compute the episodes that failed like this once more, in a detached driver; return how many.

        Raises BenchbotError while another driver is attached to the batch.
        """
        from benchbot.plugins.batch import driver
        from benchbot.plugins.batch.worker_pool import WorkerPool

        with driver_lock(self._folder):
            count, _ = driver.retry(self._folder, ",".join(classes) or None)
        if count:
            driver.detach(self._folder, replace(WorkerPool.read(self._folder), detached=True))
        self._begin_anew()
        return count

    def close(self) -> None:
        """End the thread. The batch goes on."""
        self._closed.set()
        self._wake.set()
        self._thread.join(CLOSE_TIMEOUT_S)

    def _begin_anew(self) -> None:
        # Finished episodes may be pending again: a monitor reads each of them once.
        self._monitor = None
        self._counted = (float("-inf"), -1)
        self._wake.set()

    def _poll(self) -> None:
        while not self._closed.is_set():
            self._wake.clear()
            try:
                self._view = self._read()
            except (BenchbotError, OSError) as error:
                # It is tried again: on a shared disk, folders come and go.
                self._view = replace(self._view, alive=False, problem=str(error))
            self._wake.wait(self._period_s)

    def _read(self) -> BatchView:
        stamp = plan_stamp(self.folder)
        if stamp and stamp != self._plan_stamp:
            # Seeds can be added to a batch at any time.
            self._plan_stamp, self._monitor, self._score = stamp, None, _BatchScore(self._folder)
        monitor = self._monitor
        if monitor is None:
            if self._view.status is None:
                self._view = self._first() or self._view
            monitor = self._monitor = Monitor(self._folder, plans.read(self._folder.plan))
            self._finished, self._shown = {}, None
            self._settings = differing(monitor.plan.episodes)
        status = monitor.look(self._worker_count())
        before = self._view
        told = replace(status, score=self._score.value)
        if told != before.status:
            # The score may take a while.
            self._view = replace(before, status=told, problem=None)
        status = replace(status, score=self._score.update(monitor, status))
        entry = registered(self.folder)
        view = BatchView(
            folder=self.folder,
            alive=(entry is not None and entry.is_driven) or status.workers > 0,
            problem=None,
            status=status,
            cells=self._cells(monitor, status),
            workers=_worker_rows(monitor, status),
            scores=self._score.by_solution,
        )
        # Displays take the same object for no news.
        return self._view if view == self._view else view

    def _first(self) -> BatchView | None:
        """Return what plan and events tell at once: to read the results of ten thousand episodes takes seconds."""
        count = (counter := BatchCounter(self.folder)).look(0.0)
        if count is None:
            return None
        episodes = msgspec.json.decode(self._folder.plan.read_bytes(), type=_Episodes).episodes
        settings = differing(episodes)
        status = BatchStatus(
            folder=str(self.folder), hash="", episodes=count.episodes, finished=count.finished,
            failures=count.failures, retried=0, running=(), workers=-1, idle=(), paused=None,
            mean_s=None, rate_per_hour=None, left_s=None,
        )  # fmt: skip
        cells = tuple(
            _cell(episode, state, setting=settings.get(episode.key, ""))
            for episode, state in zip(episodes, counter.states, strict=True)
        )
        entry = registered(self.folder)
        return BatchView(self.folder, entry is not None and entry.is_driven, None, status, cells)

    def _worker_count(self) -> int:
        counted_s, count = self._counted
        if time.monotonic() - counted_s > COUNT_PERIOD_S:
            from benchbot.plugins.batch.worker_pool import count_alive

            count = count_alive(self._folder)
            self._counted = time.monotonic(), count
        return count

    def _cells(self, monitor: Monitor, status: BatchStatus) -> tuple[EpisodeCell, ...]:
        """Return the cells; the same object while no episode has changed."""
        shown = monitor.changes, status.running, self._score.by_episode
        if shown == self._shown:
            return self._view.cells
        self._shown = shown
        running = {each.episode: each for each in status.running}
        return tuple(self._cell(episode, monitor, running) for episode in monitor.plan.episodes)

    def _cell(self, episode: PlannedEpisode, monitor: Monitor, running: Mapping[str, RunningEpisode]) -> EpisodeCell:
        finished = monitor.finished.get(episode.key)
        now = running.get(episode.name)
        setting = self._settings.get(episode.key, "")
        if finished is not None:
            known, score = self._finished.get(episode.key), self._score.by_episode.get(episode.name)
            if known is None or known[0] is not finished or known[1] != score:
                cell = _cell(episode, str(finished.failure or "done"), finished.worker, setting=setting)
                log = self._folder.episode(episode.name) / "log.txt"
                cell = replace(
                    cell,
                    log=log,
                    score=score,
                    duration_s=finished.duration_s,
                    attempts=finished.attempts,
                    restarts=finished.restarts,
                )
                known = self._finished[episode.key] = finished, score, cell
            return known[2]
        if now is not None:
            cell = _cell(episode, "running", now.worker, now.since_s, setting=setting)
            return replace(cell, log=self._newest_log(episode))
        return _cell(episode, "pending", setting=setting)

    def _newest_log(self, episode: PlannedEpisode) -> Path | None:
        logs = self._folder.episode(episode.name).glob("attempt-*/log.txt")
        return max(logs, key=lambda path: (len(path.parent.name), path.parent.name), default=None)


class _BatchScore:
    """The score of a batch: the final one once it is written, else that of the finished episodes."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder
        self._live: LiveScore | None = None
        self._read: dict[Path, tuple[int, int]] = {}
        self.value: Score | None = None
        """The newest score, of a batch of one solution."""
        self.by_solution: Mapping[str | None, Score] = {}
        self.by_episode: Mapping[str, float] = {}

    def update(self, monitor: Monitor, status: BatchStatus) -> Score | None:
        """Update the score, which may take a while; return it."""
        from benchbot.plugins.batch.finalization import LiveScore

        if status.is_complete and self._read_final(monitor):
            return self.value
        if monitor.plan.method is not None and status.finished:
            if self._live is None:
                self._live = LiveScore(self._folder, monitor.plan.method, Catalog(load()), each=True)
            self.value = self._live.update(monitor)
            self.by_solution, self.by_episode = self._live.by_solution, self._live.by_episode
        return self.value

    def _read_final(self, monitor: Monitor) -> bool:
        """Read the scores documents of the whole batch; return whether they are there."""
        from benchbot.plugins.batch.finalization import episode_scores, headline

        by_solution: dict[str | None, Score] = dict(self.by_solution)
        by_episode = dict(self.by_episode)
        news = False
        for name in monitor.plan.all_solutions:
            place = self._folder.path if name is None else self._folder.path / "scores" / name
            path = place / "scores.json"
            try:
                about = path.stat()
                version = about.st_mtime_ns, about.st_size
                if version == self._read.get(path):
                    continue
                document = read_scores(path)
            except (OSError, BenchbotError):
                return False
            count = sum(each.solution == name for each in monitor.plan.episodes)
            found = headline(document, count)
            by_solution |= {name: found} if found is not None else {}
            by_episode |= episode_scores(document)
            self._read[path], news = version, True
        if news:
            self.by_solution, self.by_episode, self.value = by_solution, by_episode, by_solution.get(None)
        return True


class _Episodes(msgspec.Struct):
    """The episodes of a plan, without checking all of it."""

    episodes: list[PlannedEpisode]


def differing(episodes: Sequence[PlannedEpisode]) -> dict[str, str]:
    """Return the settings and episodes of the task by which the episodes of a plan differ, in words, by their keys."""
    every = [{**each.settings, **({} if each.episode is None else {"episode": each.episode})} for each in episodes]
    names = {name: None for settings in every for name in settings}
    varied = [name for name in names if len({repr(settings.get(name)) for settings in every}) > 1]
    if not varied:
        return {}
    return {
        each.key: ", ".join(f"{name} {settings[name]}" for name in varied if name in settings)
        for each, settings in zip(episodes, every, strict=True)
    }


def _cell(
    episode: PlannedEpisode, state: str, worker: str | None = None, since_s: float | None = None, *, setting: str = ""
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
        solution=episode.solution or "",
        setting=setting,
    )


def _worker_rows(monitor: Monitor, status: BatchStatus) -> tuple[WorkerRow, ...]:
    busy = [WorkerRow(each.worker, each.episode, each.since_s) for each in status.running]
    idle = [WorkerRow(name, None, monitor.since_last_event_s(name)) for name in status.idle if not status.is_complete]
    return tuple(sorted([*busy, *idle], key=lambda row: row.name))
