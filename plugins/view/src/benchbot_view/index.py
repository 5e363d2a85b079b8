"""The table of all episodes: read once, kept by modification time and size, and looked at again at little cost.

Rows have a place that never changes, and a revision: a display that knows a revision asks for what is newer.
"""

import os
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path, PurePath
from typing import Any

import msgspec

from benchbot.plugin import BenchbotError
from benchbot.viewing import BatchFeed, RunState, Tail, live, one_line, registered, registered_batches, sizes
from benchbot_view.memory import Memory

PLAN, EPISODES, RESULT = "plan.json", "episodes", "result.json"
LARGEST_BYTES = 64 * 2**20
REST = 200
"""A folder is looked through again after so many times as long as it took: at most 0.5 % of a core."""
LEAST_PERIOD_S = 1.0
LIVE_PERIOD_S = 1.0
FORGOTTEN_AFTER_S = 20.0
"""The time after which a feed that nobody looks at is closed."""
LONGEST = 200

Number = int | str | None


class _Named(msgspec.Struct):
    name: str = ""
    variant: int | str = ""


class _Selection(msgspec.Struct):
    robot: str | None = None
    seed: int | None = None
    repeat: int | None = None
    episode: dict[str, Any] | None = None


class _Solution(msgspec.Struct):
    command: list[str] | None = None
    example: str | None = None


class _Provenance(msgspec.Struct):
    selection: _Selection | None = None
    solution: _Solution | None = None
    steps: int | None = None
    failure: dict[str, Any] | None = None


class _Result(msgspec.Struct):
    """The part of a result that a row tells."""

    task_details: _Named
    environment_details: list[_Named]
    results: msgspec.Raw = msgspec.Raw()
    provenance: _Provenance | None = None


class _Planned(msgspec.Struct):
    key: str
    label: str
    robot: str
    environment: str
    seed: int
    repeat: int | None = None
    episode: int | None = None
    solution: str | None = None


class _Plan(msgspec.Struct):
    task: str
    episodes: list[_Planned]


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


class Row(msgspec.Struct, array_like=True):
    """One episode; in JSON an array, in this order (`static/rows.js` names the columns)."""

    id: str
    set: str
    solution: str
    task: str
    environment: str
    robot: str
    seed: int | None = None
    repeat: int | None = None
    episode: int | None = None
    state: str = "pending"
    why: str = ""
    score_name: str = ""
    score: float | None = None
    steps: int | None = None
    pictured: bool = False
    changed_s: float = 0.0
    revision: int = 0


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
        self.paths: dict[str, Path] = {}
        """The result of each row that has one, by its id."""
        self.runs: dict[str, RunState] = {}
        """The runs that are under way, by the id of their row."""
        self._batches: dict[Path, _Batch] = {}
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
                self._memory.save()
                self.is_read = True
                took_s = time.monotonic() - now_s
                self._next_s = now_s + took_s + max(LEAST_PERIOD_S, REST * took_s)
            for batch in self._batches.values():
                batch.look()
            self._look_at_runs()

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

    def batches(self) -> list[tuple[str, Any]]:
        """Return name and status of each batch that is being driven."""
        with self._lock:
            found = [(batch.name, batch.feed.view.status) for batch in self._batches.values() if batch.feed]
        return [(name, status) for name, status in found if status is not None]

    def unscored(self) -> list[tuple[Row, Path]]:
        """Return rows and paths of results that have no score and were not tried."""
        with self._lock:
            return [
                (row, self.paths[row.id])
                for row in self._rows
                if row.score is None and row.id in self.paths and row.id not in self._scored
            ]

    def put_score(self, id_: str, name: str, value: float | None) -> None:
        """Note the score of a result; None for one that cannot be scored."""
        with self._lock:
            self._scored.add(id_)
            row = self.row(id_)
            if row is not None and value is not None:
                self._put(msgspec.structs.replace(row, score_name=one_line(name), score=value))

    # -- reading ---------------------------------------------------------------------------------------------------

    def _all_sources(self) -> list[Source]:
        if not self._everything:
            return self._sources
        known = {source.path for source in self._sources}
        batches = [each.folder for each in registered_batches()]
        return [*self._sources, *(Source(path.name, path) for path in batches if path not in known)]

    def _look_into(self, source: Source) -> None:
        if source.path.is_file():
            self._note_result(source, source.path, source.path.stat())
            return
        scores: list[Path] = []
        for entry in _files(source.path):
            path = Path(entry.path)
            if entry.name == PLAN:
                if path.parent not in self._batches:
                    self._batches[path.parent] = _Batch(self, source, path.parent)
            elif entry.name == "scores.json":
                scores.append(path)
            else:
                self._note_result(source, path, entry.stat())
        for path in scores:
            self._note_scores(path)

    def _note_result(self, source: Source, path: Path, about: os.stat_result) -> None:
        stamp = about.st_mtime_ns, about.st_size
        text = str(path)
        if self._stamps.get(text) == stamp:
            return
        self._stamps[text] = stamp
        row = self.read(path, about)
        if row is not None:
            self._put(msgspec.structs.replace(row, set=source.name), path)

    def read(self, path: Path, about: os.stat_result) -> Row | None:
        """Return the row of a result, without its set; None for a file that is none."""
        known, content = self._memory.find(path, about)
        if not known:
            content = _read(path, about)
            self._memory.put(path, about, content)
        if content is None:
            return None
        row = msgspec.convert(content, Row)
        row.id, row.pictured, row.changed_s = id_of(path), _is_pictured(path), about.st_mtime
        return row

    def _note_scores(self, path: Path) -> None:
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
        folders = (path.parent, Path.cwd())
        for scored in document.rows:
            for folder in folders if scored.source else ():
                row = self.row(id_of(folder / str(scored.source)))
                if row is not None:
                    value = scored.scores.get(document.method.headline)
                    if value is not None and row.changed_s <= about.st_mtime:
                        self._put(msgspec.structs.replace(row, score_name=headline, score=value))
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
                self._put(
                    Row(id_, "under way", one_line(state.name), state.task, state.environment, state.robot, state.seed)
                )
        for id_ in self.runs.keys() | found.keys():
            row = self.row(id_)
            now = "running" if id_ in found else "ended"
            if row is not None and row.state != now:
                self._put(msgspec.structs.replace(row, state=now, changed_s=time.time()))
        self.runs = found

    def _put(self, row: Row, path: Path | None = None) -> None:
        """Add or replace a row, where it differs."""
        place = self._places.get(row.id)
        if path is not None:
            self.paths[row.id] = path
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


class _Batch:
    """A batch's rows: those of its plan, with the results that there are; while it is driven, by its feed."""

    def __init__(self, index: Index, source: Source, folder: Path) -> None:
        self.folder = folder
        self.name = source.name if source.path == folder else f"{source.name}/{folder.relative_to(source.path)}"
        self.feed: BatchFeed | None = None
        self._index = index
        self._tails: dict[str, tuple[Tail, int]] = {}
        self._plan_stamp: object = None
        self._episodes: dict[str, tuple[str, str]] = {}
        """Id and folder of each episode, by its key."""
        self._cells: object = None
        self._names: dict[str, str] = {}
        self._looked_s = 0.0
        self._asked_s = float("-inf")

    def look(self) -> None:
        """Look at what events name, and at what the feed tells."""
        now_s = time.monotonic()
        if now_s < self._looked_s:
            return
        try:
            about = (self.folder / PLAN).stat()
        except OSError:
            return
        stamp = about.st_mtime_ns, about.st_size
        if stamp != self._plan_stamp:
            self._plan_stamp = stamp
            self._read_plan()
        else:
            for key in self._told():
                self._check(key)
        self._note_scores()
        self._follow()
        took_s = time.monotonic() - now_s
        self._looked_s = now_s + took_s + max(LIVE_PERIOD_S, REST * took_s if self.feed is None else 5 * took_s)

    def close(self) -> None:
        if self.feed is not None:
            self.feed.close()
            self.feed = self._cells = None

    def _read_plan(self) -> None:
        try:
            plan = msgspec.json.decode((self.folder / PLAN).read_bytes(), type=_Plan)
        except (OSError, msgspec.DecodeError):
            return
        self._told()
        for each in plan.episodes:
            name = f"{each.label}-{each.key[:8]}"
            result = f"{self.folder}/{EPISODES}/{name}/{RESULT}"
            id_ = id_of(Path(result))
            self._episodes[each.key], self._names[name] = (id_, result), each.key
            row = Row(
                id_,
                one_line(self.name),
                one_line(each.solution or self.name),
                one_line(plan.task),
                one_line(each.environment),
                one_line(each.robot),
                each.seed,
                each.repeat,
                each.episode,
            )
            self._index._put(row)
            self._check(each.key)

    def _check(self, key: str) -> None:
        id_, result = self._episodes[key]
        row = self._index.row(id_)
        if row is None:
            return
        path = Path(result)
        try:
            about = path.stat()
        except OSError:
            if row.state != "pending" and id_ in self._index.paths:
                self._index.paths.pop(id_)
                self._index._put(msgspec.structs.replace(row, state="pending", score=None))
            return
        if row.state not in ("pending", "running") and row.changed_s == about.st_mtime:
            return
        found = self._index.read(path, about)
        if found is not None:
            told = ("solution", "set", "task", "robot", "seed", "repeat", "episode")
            kept = {name: getattr(row, name) for name in told}
            self._index._put(msgspec.structs.replace(found, **kept), path)

    def _told(self) -> set[str]:
        keys = set()
        for name, size in sizes(self.folder / "events"):
            tail, seen = self._tails.get(name) or (Tail(self.folder / "events" / name), 0)
            if size != seen:
                self._tails[name] = tail, size
                keys |= {str(event.get("key")) for event in tail.read()}
        return keys & self._episodes.keys()

    def _note_scores(self) -> None:
        for path in (self.folder / "scores.json", *sorted(self.folder.glob("scores/*/scores.json"))):
            self._index._note_scores(path)

    def _follow(self) -> None:
        """Open a feed while the batch is driven, and note what runs."""
        now_s = time.monotonic()
        if now_s - self._asked_s > 2 * LIVE_PERIOD_S:
            self._asked_s = now_s
            entry = registered(self.folder)
            if entry is None or not entry.is_driven:
                self.close()
            elif self.feed is None:
                self.feed = BatchFeed(self.folder, period_s=LIVE_PERIOD_S)
        cells = () if self.feed is None else self.feed.view.cells
        if cells is self._cells:
            return
        self._cells = cells
        for cell in cells:
            key = self._names.get(cell.name)
            row = None if key is None else self._index.row(self._episodes[key][0])
            if row is None or key is None:
                continue
            if cell.state in ("pending", "running"):
                if row.state != cell.state and row.id not in self._index.paths:
                    self._index._put(msgspec.structs.replace(row, state=cell.state))
            elif row.state in ("pending", "running"):
                self._check(key)


def id_of(path: Path) -> str:
    """Return what a result is called in addresses: it says nothing of where it lies."""
    return sha256(os.path.abspath(path).encode("utf-8", "surrogateescape")).hexdigest()[:12]  # noqa: PTH100 - quicker


def _files(folder: Path) -> Iterator[os.DirEntry[str]]:
    """Yield the JSON files in a folder, sorted, hidden ones and those of recordings left out; of a batch the plan."""
    try:
        with os.scandir(folder) as found:
            entries = sorted(found, key=lambda entry: entry.name)
    except OSError:
        return
    plan = next((entry for entry in entries if entry.name == PLAN), None)
    if plan is not None:
        yield plan
        return
    for entry in entries:
        if entry.name.startswith("."):
            continue
        if entry.is_dir(follow_symlinks=False):
            if not entry.name.endswith(("-recordings", ".frames")):
                yield from _files(Path(entry.path))
        elif entry.name.endswith(".json") and entry.is_file():
            yield entry


def _read(path: Path, about: os.stat_result) -> list[Any] | None:
    """Return what a row tells of a result, as JSON; None for a file that is none."""
    if about.st_size > LARGEST_BYTES:
        return None
    try:
        found = msgspec.json.decode(path.read_bytes(), type=_Result)
    except (OSError, msgspec.DecodeError, RecursionError):
        return None
    if not found.environment_details or not found.task_details.name:
        return None
    provenance = found.provenance or _Provenance()
    selection, solution = provenance.selection or _Selection(), provenance.solution or _Solution()
    failure: Mapping[str, Any] = provenance.failure or {}
    scenes = found.environment_details
    episode = (selection.episode or {}).get("number")
    missing = not bytes(found.results)
    return msgspec.to_builtins(  # type: ignore[no-any-return]
        Row(
            id="",
            set="",
            solution=_short(solution.example or _command(solution.command) or path.parent.name),
            task=_short(found.task_details.name),
            environment=_short(":".join([scenes[0].name, *(str(scene.variant) for scene in scenes)])),
            robot=_short(selection.robot or ""),
            seed=selection.seed,
            repeat=selection.repeat,
            episode=episode if isinstance(episode, int) else None,
            state=_short(str(failure.get("class") or ("no results" if missing else "done"))),
            why=_short(str(failure.get("why") or "")),
            steps=provenance.steps,
        )
    )


def _command(words: Sequence[str] | None) -> str:
    """Return what a command runs: its script, else its program."""
    named = [PurePath(word).stem for word in words or () if word.endswith(".py")]
    return named[0] if named else PurePath(words[0]).name if words else ""


def _short(text: str) -> str:
    shown = one_line(text)
    return shown if len(shown) <= LONGEST else f"{shown[: LONGEST - 1]}…"


def _is_pictured(path: Path) -> bool:
    stem = str(path)[: -len(".json")]
    return os.path.isdir(f"{stem}-recordings") or os.path.isdir(f"{stem}.frames")  # noqa: PTH112 - quicker
