"""The table of all episodes: read once, kept by modification time and size, and looked at again at little cost.

Rows have a place that never changes, and a revision: a display that knows a revision asks for what is newer.
"""

import os
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from benchbot.plugin import BenchbotError
from benchbot.viewing import RunState, live, one_line, registered_batches
from benchbot_view.batches import REST, BatchRows
from benchbot_view.memory import Memory
from benchbot_view.rows import LARGEST_BYTES, PLAN, Row, id_of, json_files, read_result

LEAST_PERIOD_S = 1.0
FORGOTTEN_AFTER_S = 20.0
"""The time after which a feed that nobody looks at is closed."""


class _ScoredRow(msgspec.Struct):
    source: str | None
    scores: dict[str, float]


class _Method(msgspec.Struct):
    name: str
    headline: str


class _Scores(msgspec.Struct):
    """The part of a scores document that rows tell."""

    method: _Method
    rows: list[_ScoredRow]


@dataclass(frozen=True)
class Source:
    """A folder (or a single result) to be shown, and what it is called."""

    name: str
    path: Path

    @classmethod
    def of(cls, text: str) -> "Source":
        """Return the source that `PATH` or `NAME=PATH` names; raises BenchbotError when there is no such path."""
        name, separator, rest = text.partition("=")
        if separator and name and "/" not in name and not Path(text).exists():
            path = Path(rest)
        else:
            path, name = Path(text), ""
        if not path.exists():
            raise BenchbotError(
                f"There is no {path}.", "It is neither a file nor a folder.", "Name a folder of results or of a batch."
            )
        return cls(one_line(name or path.resolve().name), path.resolve())


class Index:
    """The rows of some folders; safe to use from several threads."""

    def __init__(self, sources: Sequence[Source], *, everything: bool = False) -> None:
        self._sources = list(sources)
        self._everything = everything
        """Whether batches and runs of this user are shown, too."""
        self._lock = threading.RLock()
        self._memory = Memory()
        self.revision = 0
        self._rows: list[Row] = []
        self._places: dict[str, int] = {}
        self._paths: dict[str, str] = {}
        """The result of each row that has one, by its id."""
        self.runs: dict[str, RunState] = {}
        """The runs that are under way, by the id of their row."""
        self._batches: dict[Path, BatchRows] = {}
        self._stamps: dict[str, object] = {}
        self._next_s = 0.0
        self._looked_s = float("-inf")
        self._scored: set[str] = set()
        self.is_read = False

    def __len__(self) -> int:
        return len(self._rows)

    def look(self) -> None:
        """Look for what has changed, as far as it is time to."""
        with self._lock:
            now_s = time.monotonic()
            self._looked_s = now_s
            if now_s >= self._next_s:
                for source in self._all_sources():
                    self._look_into(source)
                took_s = time.monotonic() - now_s
                self._next_s = now_s + took_s + max(LEAST_PERIOD_S, REST * took_s)
            for batch in self._batches.values():
                batch.look()
            self._memory.save()
            self._look_at_runs()
            self.is_read = True

    def rest(self) -> None:
        """Close the feeds when nobody has looked for a while."""
        with self._lock:
            if time.monotonic() - self._looked_s > FORGOTTEN_AFTER_S:
                self.close()

    def close(self) -> None:
        """Close all feeds."""
        for batch in self._batches.values():
            batch.close()

    def rows(self, *, since: int = 0, start: int = 0, count: int = 10**9) -> tuple[int, int, list[Row]]:
        """Return the revision, the number of all rows, and rows of a page that are newer than a revision."""
        with self._lock:
            page = self._rows[start : start + count]
            return self.revision, len(self._rows), [row for row in page if row.revision > since]

    def row(self, id_: str) -> Row | None:
        """Return the row with this id."""
        with self._lock:
            place = self._places.get(id_)
            return None if place is None else self._rows[place]

    def path(self, id_: str) -> Path | None:
        """Return the result of a row, None while there is none."""
        with self._lock:
            path = self._paths.get(id_)
            return None if path is None else Path(path)

    def batches(self) -> list[tuple[str, Any]]:
        """Return name and status of each batch that is being driven."""
        with self._lock:
            found = [(batch.name, batch.feed.view.status) for batch in self._batches.values() if batch.feed]
        return [(name, status) for name, status in found if status is not None]

    def unscored(self) -> list[tuple[Row, Path]]:
        """Return rows and paths of results that have no score and were not tried."""
        with self._lock:
            return [
                (row, Path(self._paths[row.id]))
                for row in self._rows
                if row.score is None and row.id in self._paths and row.id not in self._scored
            ]

    def put_score(self, id_: str, name: str, value: float | None) -> None:
        """Note the score of a result; None for one that cannot be scored."""
        with self._lock:
            self._scored.add(id_)
            row = self.row(id_)
            if row is not None and value is not None:
                self.put(msgspec.structs.replace(row, score_name=one_line(name), score=value))

    # -- reading ---------------------------------------------------------------------------------------------------

    def _all_sources(self) -> list[Source]:
        if not self._everything:
            return self._sources
        known = {source.path for source in self._sources}
        batches = [each.folder for each in registered_batches()]
        return [*self._sources, *(Source(path.name, path) for path in batches if path not in known)]

    def _look_into(self, source: Source) -> None:
        if source.path.is_file():
            self._note_result(source, str(source.path), source.path.stat())
            return
        scores: list[Path] = []
        for entry in json_files(str(source.path)):
            if entry.name == PLAN:
                folder = Path(entry.path).parent
                if folder not in self._batches:
                    inside = "" if folder == source.path else f"/{folder.relative_to(source.path)}"
                    self._batches[folder] = BatchRows(self, f"{source.name}{inside}", folder)
            elif entry.name == "scores.json":
                scores.append(Path(entry.path))
            else:
                self._note_result(source, entry.path, entry.stat())
        for path in scores:
            self.note_scores(path)

    def _note_result(self, source: Source, path: str, about: os.stat_result) -> None:
        stamp = about.st_mtime_ns, about.st_size
        if self._stamps.get(path) == stamp:
            return
        self._stamps[path] = stamp
        row = self.read(path, about, id_of(path))
        if row is not None:
            row.set = source.name
            self.put(row, path)

    def read(self, path: str, about: os.stat_result, id_: str) -> Row | None:
        """Return the row of a result, without its set; None for a file that is none."""
        known, row = self._memory.find(path, about, type_=Row | None)
        if not known:
            row = read_result(path, about)
            self._memory.put(path, about, row)
        if row is not None:
            row.id, row.changed_s = id_, about.st_mtime
        return row  # type: ignore[no-any-return]

    def note_scores(self, path: Path) -> None:
        """Take the scores of a scores document for those of the results that it names, unless these are newer."""
        try:
            about = path.stat()
            stamp = about.st_mtime_ns, about.st_size
            if self._stamps.get(str(path)) == stamp or about.st_size > LARGEST_BYTES:
                return
            document = msgspec.json.decode(path.read_bytes(), type=_Scores)
        except (OSError, msgspec.DecodeError, ValueError):
            return
        self._stamps[str(path)] = stamp
        headline = one_line(document.method.headline)
        folders = (str(path.parent), str(Path.cwd()))
        for scored in document.rows:
            for folder in folders if scored.source else ():
                row = self.row(id_of(os.path.join(folder, str(scored.source))))  # noqa: PTH118 - see rows.py
                if row is not None:
                    value = scored.scores.get(document.method.headline)
                    if value is not None and row.changed_s <= about.st_mtime:
                        self.put(msgspec.structs.replace(row, score_name=headline, score=value))
                    break

    def _look_at_runs(self) -> None:
        if not self._everything:
            return
        found = {}
        for state in live():
            if state.owner.startswith("benchbot batch"):
                continue
            id_ = sha256(state.folder.encode()).hexdigest()[:12]
            found[id_] = state
            if id_ not in self.runs:
                self.put(
                    Row(id_, "under way", one_line(state.name), state.task, state.environment, state.robot, state.seed)
                )
        for id_ in self.runs.keys() | found.keys():
            row = self.row(id_)
            now = "running" if id_ in found else "ended"
            if row is not None and row.state != now:
                self.put(msgspec.structs.replace(row, state=now, changed_s=time.time()))
        self.runs = found

    def forget(self, id_: str) -> None:
        """Note that the result of a row is gone."""
        self._paths.pop(id_, None)

    def put(self, row: Row, path: str | None = None) -> None:
        """Add or replace a row, where it differs."""
        place = self._places.get(row.id)
        if path is not None:
            self._paths[row.id] = path
        if place is None:
            self._places[row.id] = len(self._rows)
            self.revision += 1
            row.revision = self.revision
            self._rows.append(row)
            return
        before = self._rows[place]
        if path is not None and row.changed_s == before.changed_s and row.score is None:
            row.score, row.score_name = before.score, before.score_name
        row.revision = before.revision
        if row != before:
            self.revision += 1
            row.revision = self.revision
            self._rows[place] = row
            if path is not None and row.changed_s != before.changed_s:
                self._scored.discard(row.id)
