"""The episodes that are looked at: the newest few are kept, and their recordings are worked out one after the other."""

from collections import OrderedDict
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Lock
from typing import Any

from benchbot.plugin import BenchbotError, Catalog
from benchbot_view.episode import Episode, catalog, load
from benchbot_view.evidence import prepare, prepared
from benchbot_view.index import Index

KEPT = 12


class Episodes:
    """Loads episodes of an index by their ids; safe to use from several threads."""

    def __init__(self, index: Index) -> None:
        self._index = index
        self._kept: OrderedDict[str, tuple[object, Episode]] = OrderedDict()
        self._lock = Lock()
        self._catalog: Catalog | None = None
        self._worker = ThreadPoolExecutor(1, "benchbot-evidence")
        self._under_way: dict[str, Future[Any]] = {}

    def get(self, id_: str) -> Episode:
        """Return an episode; raises BenchbotError when it has no result that can be read."""
        path = self._index.path(id_)
        if path is None:
            raise BenchbotError(
                "This episode has no result yet.",
                "It is still to be computed, or its file was removed.",
                "Come back when it is finished.",
            )
        try:
            about = path.stat()
        except OSError as error:
            raise BenchbotError(
                "The result of this episode is gone.", f"{error.strerror}.", "Look at the folder."
            ) from error
        stamp = about.st_mtime_ns, about.st_size
        with self._lock:
            known = self._kept.get(id_)
            if known is not None and known[0] == stamp:
                self._kept.move_to_end(id_)
                return known[1]
            if self._catalog is None:
                self._catalog = catalog()
            episode = load(path, self._catalog)
            self._kept[id_] = stamp, episode
            while len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return episode

    def evidence(self, id_: str) -> dict[str, Any] | None:
        """Return what a recording shows; None while that is being worked out."""
        episode = self.get(id_)
        found = prepared(episode.recorded, episode.looked)
        if found is not None:
            return episode.told(found)
        with self._lock:
            future = self._under_way.get(id_)
            if future is None:
                self._under_way[id_] = self._worker.submit(prepare, episode.recorded, episode.view, episode.looked)
                return None
        if future.done():
            with self._lock:
                self._under_way.pop(id_, None)
            # What could not be worked out is told once, and tried again when it is asked for again.
            return episode.told(future.result())
        return None

    def close(self) -> None:
        """Leave out what was not begun."""
        self._worker.shutdown(wait=False, cancel_futures=True)
