"""The rows of a batch: those of its plan, with the results that there are; while it is driven, by its feed."""

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from benchbot.viewing import BatchFeed, Tail, registered, sizes
from benchbot_view.rows import PLAN, Row, id_of, shown

if TYPE_CHECKING:
    from benchbot_view.index import Index

EPISODES, RESULT = "episodes", "result.json"
REST = 200
"""Files are looked through again after so many times as long as it took: at most 0.5 % of a core."""
LIVE_PERIOD_S = 1.0
OF_THE_PLAN = ("set", "solution", "task", "robot", "seed", "repeat", "episode")
"""The columns that the plan tells, of which results tell something else."""


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


class BatchRows:
    """Keeps the rows of a batch in an index; look again and again."""

    def __init__(self, index: "Index", name: str, folder: Path) -> None:
        self.folder, self.name = folder, name
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
        """Close the feed."""
        if self.feed is not None:
            self.feed.close()
            self.feed = self._cells = None

    def _read_plan(self) -> None:
        try:
            plan = msgspec.json.decode((self.folder / PLAN).read_bytes(), type=_Plan)
        except (OSError, msgspec.DecodeError):
            return
        self._told()
        task, batch = shown(plan.task), shown(self.name)
        for each in plan.episodes:
            name = f"{each.label}-{each.key[:8]}"
            path = f"{self.folder}/{EPISODES}/{name}/{RESULT}"
            id_ = id_of(path)
            self._episodes[each.key], self._names[name] = (id_, path), each.key
            row = Row(
                id_,
                batch,
                shown(each.solution or self.name),
                task,
                shown(each.environment),
                shown(each.robot),
                each.seed,
                each.repeat,
                each.episode,
            )
            finished = self._finished(row, path)
            self._index.put(finished or row, path if finished else None)

    def _check(self, key: str) -> None:
        id_, path = self._episodes[key]
        row = self._index.row(id_)
        finished = None if row is None else self._finished(row, path)
        if finished is not None:
            self._index.put(finished, path)
        elif row is not None and self._index.path(id_) is not None:
            self._index.forget(id_)
            self._index.put(msgspec.structs.replace(row, state="pending", score=None))

    def _finished(self, row: Row, path: str) -> Row | None:
        """Return the row of an episode by its result; None while there is none."""
        try:
            about = os.stat(path)  # noqa: PTH116 - as text, see rows.py
        except OSError:
            return None
        found = self._index.read(path, about, row.id)
        if found is not None:
            for name in OF_THE_PLAN:
                setattr(found, name, getattr(row, name))
        return found

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
            self._index.note_scores(path)

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
                if row.state != cell.state and self._index.path(row.id) is None:
                    self._index.put(msgspec.structs.replace(row, state=cell.state))
            elif row.state in ("pending", "running"):
                self._check(key)
