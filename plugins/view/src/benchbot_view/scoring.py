"""Scores of results that have none yet, worked out in a process beside the server and kept in the user's cache."""

import os
import threading
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from hashlib import sha256
from multiprocessing import get_context, parent_process
from pathlib import Path

from benchbot.plugin import BenchbotError, Catalog, installed_plugins, load_plugins
from benchbot.viewing import score_files
from benchbot_view.index import Index
from benchbot_view.memory import Memory
from benchbot_view.rows import Row

FIRST, MOST = 20, 250
"""The number of results that are scored together: few at first, so that there is something to see."""
NICENESS = 10

Scored = list[tuple[str, float | None]]


class Scorer:
    """Scores what an index has no score of, step by step; call `work` again and again."""

    def __init__(self, index: Index) -> None:
        self._index = index
        self._memory = Memory()
        self._pool: ProcessPoolExecutor | None = None
        self._lock = threading.Lock()
        self._under_way: tuple[list[tuple[str, Path]], Future[Scored]] | None = None
        self._count = FIRST
        self._kind = ""
        self._is_closed = False
        self.left = 0
        """The number of results without a score."""

    def work(self) -> None:
        """Take what was scored, and begin with the next results."""
        with self._lock:
            if self._is_closed:
                return
            self._take()
            if self._under_way is not None:
                return
            waiting = self._unknown(self._index.unscored())
            self.left = len(waiting)
            if not waiting:
                self._end()
                return
            batch = together(waiting, self._count)
            if batch:
                self._count = min(2 * self._count, MOST)
                if self._pool is None:
                    context = get_context("spawn")
                    self._pool = ProcessPoolExecutor(1, context, initializer=begin)
                self._under_way = batch, self._pool.submit(scores_of, [path for _, path in batch])

    def recall(self) -> None:
        """Take the scores that are known from before."""
        self._unknown(self._index.unscored())

    def close(self) -> None:
        """End the process; no other one is started, also not for an answer that is on its way."""
        with self._lock:
            self._is_closed = True
            self._end()

    def _end(self) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None

    def _take(self) -> None:
        if self._under_way is None or not self._under_way[1].done():
            return
        (batch, future), self._under_way = self._under_way, None
        try:
            scored = future.result()
        except BrokenProcessPool:
            self._pool = None
            scored = [("", None)] * len(batch)
        for (id_, path), (name, value) in zip(batch, scored, strict=True):
            self._index.put_score(id_, name, value)
            try:
                self._memory.put(path, path.stat(), [name, value], self._key())
            except OSError:
                continue
        self._memory.save()

    def _unknown(self, waiting: Sequence[tuple[Row, Path]]) -> list[tuple[Row, Path]]:
        """Take the scores that are known from before; return the others."""
        unknown = []
        for row, path in waiting:
            try:
                known, found = self._memory.find(path, path.stat(), self._key())
            except OSError:
                known, found = True, ["", None]
            if known:
                self._index.put_score(row.id, *found)
            else:
                unknown.append((row, path))
        return unknown

    def _key(self) -> str:
        """Return what scores depend on beside the results: methods, their versions, and the ground truths."""
        if not self._kind:
            catalog = Catalog(load_plugins())
            truths = [(str(path), path.stat().st_mtime_ns, path.stat().st_size) for path in catalog.ground_truth_files]
            versions = sorted((info.name, info.version) for info in installed_plugins())
            self._kind = f"score {sha256(repr((truths, versions)).encode()).hexdigest()[:16]}"
        return self._kind


def begin() -> None:
    """Prepare the process: let others go first, and end with the server, also one that is killed."""
    os.nice(NICENESS)
    threading.Thread(target=_end_with_server, daemon=True).start()


def _end_with_server() -> None:
    server = parent_process()
    if server is not None:
        server.join()
        os._exit(1)


def together(waiting: Sequence[tuple[Row, Path]], count: int) -> list[tuple[str, Path]]:
    """Return ids and paths of results that may be scored together: of one task, and no two of the same episode."""
    chosen: dict[object, tuple[str, Path]] = {}
    for row, path in waiting:
        if row.task == waiting[0][0].task and len(chosen) < count:
            chosen.setdefault((row.environment, row.robot, row.seed, row.repeat, row.episode), (row.id, path))
    return list(chosen.values())


def scores_of(paths: Sequence[Path]) -> Scored:
    """Return name and value of the headline score of results of one task; no value for those that have none."""
    try:
        document = score_files(paths, catalog=Catalog(load_plugins())).document
    except BenchbotError:
        return [("", None)] * len(paths)
    name = str(document["method"]["headline"])
    values = {row["source"]: row["scores"].get(name) for row in document["rows"]}
    return [(name, values.get(str(path))) for path in paths]
