"""The score of a batch while it runs, kept up to date at a small share of the driver's time."""

import time
from collections.abc import Mapping
from typing import Any

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation.score import evaluate_files
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.status import Monitor, Score

SHARE = 0.05
SHORTEST_S = 5.0


class LiveScore:
    """Scores what is finished, again when there is more of it, and never for more than a twentieth of the time."""

    def __init__(self, folder: Folder, method: str | None, catalog: Catalog) -> None:
        self._folder = folder
        self._method = method
        self._catalog = catalog
        self._next_s = 0.0
        self._count = 0
        self.value: Score | None = None

    def update(self, monitor: Monitor) -> Score | None:
        """Return the score of what is finished, or of what was when there was last time for it."""
        began_s = time.monotonic()
        count = len(monitor.finished)
        if self._method is None or count == self._count or began_s < self._next_s:
            return self.value
        self._count = count
        names = [episode.name for episode in monitor.plan.episodes if episode.key in monitor.finished]
        paths = [self._folder.result(name) for name in names]
        try:
            document = evaluate_files(paths, catalog=self._catalog, method=self._method)
        except BenchbotError:
            self.value = None  # nothing to score yet; at the end it is said why
        else:
            self.value = headline(document, count) or self.value
        taken_s = time.monotonic() - began_s
        self._next_s = time.monotonic() + max(SHORTEST_S, taken_s / SHARE)
        return self.value


def headline(document: Mapping[str, Any], results: int) -> Score | None:
    """Return the score that a scores document is about, which are of so many results; None when it has none."""
    name = document["method"]["headline"]
    interval = document.get("intervals", {}).get(name) or {}
    value = document["scores"].get(name)
    return None if value is None else Score(name, value, results, interval.get("low"), interval.get("high"))
