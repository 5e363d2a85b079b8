"""The progress of a batch, read from its folder alone, again and again, at little cost."""

import json
import time
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field
from heapq import heappop, heappush
from typing import Any

from benchbot.plugins.batch import journal, machine
from benchbot.plugins.batch.attempts import Finished
from benchbot.plugins.batch.claims import Observer
from benchbot.plugins.batch.error_groups import ErrorGroup, grouped
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import Plan, PlannedEpisode

SHOWN_EVENTS = 20
SCAN_PERIOD_S = 20.0
AUDITED_EPISODES = 16
"""The number of finished episodes whose results are looked at again each time."""
PACED_EPISODES = 100
"""The number of episodes, the last ones, that the pace is told of."""


@dataclass(frozen=True)
class RunningEpisode:
    """An episode that a worker is computing."""

    episode: str
    worker: str
    since_s: float | None
    """Seconds since it was begun; None when that is not known."""


@dataclass(frozen=True)
class Score:
    """The score of the results that there are so far: `low` and `high` are of its interval, where that is known."""

    name: str
    value: float
    results: int
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class BatchStatus:
    """Where a batch stands. Times are seconds; what cannot be told yet is None."""

    folder: str
    hash: str
    episodes: int
    finished: int
    failures: Mapping[str, int]
    """Finished episodes that did not end well, by class of failure."""
    retried: int
    """Attempts that failed and were made again."""
    running: tuple[RunningEpisode, ...]
    workers: int
    """Workers that run or wait to run; -1 when the executor was not asked."""
    idle: tuple[str, ...]
    """Workers that wait for others to finish."""
    paused: str | None
    """Why a worker waits before it begins anything, such as a full disk."""
    mean_s: float | None
    """The mean duration of an episode."""
    rate_per_hour: float | None
    """Episodes finished per hour, lately."""
    left_s: float | None
    """The time until all are done, at the pace of now."""
    score: Score | None = None
    errors: tuple[ErrorGroup, ...] = ()
    """The errors of finished episodes that failed, equal ones together."""
    newest: tuple[Mapping[str, Any], ...] = field(default=())
    """The last events, oldest first."""
    conclusion: Mapping[str, Any] | None = None
    """Of a detached batch that is complete: `files` that were made of its results, or the `problem` why none were."""

    @property
    def pending(self) -> int:
        """The number of episodes that no worker has begun, or that are to be begun again."""
        return self.episodes - self.finished - len(self.running)

    @property
    def is_complete(self) -> bool:
        """Whether every episode has its result."""
        return self.finished == self.episodes

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {**asdict(self), "pending": self.pending, "complete": self.is_complete}


class Monitor:
    """Reads a batch's folder: finished episodes once, the logs of events as they grow.

    A finished episode is read again when an event names it, or when its result is found changed or gone: some results
    are looked at in turn each time.
    """

    def __init__(self, folder: Folder, plan: Plan) -> None:
        self.plan = plan
        self._folder = folder
        self._observer = Observer(folder.claims, plan.policy.stale_s)
        self._planned: dict[str, PlannedEpisode] = {episode.key: episode for episode in plan.episodes}
        self._left = dict(self._planned)
        self.finished: dict[str, Finished] = {}
        """The finished episodes, by key."""
        self.changes = 0
        """Grows whenever an episode finishes or is finished no more."""
        self._tails: dict[str, tuple[journal.Tail, int]] = {}
        self._newest: list[dict[str, Any]] = []
        self._last: dict[str, dict[str, Any]] = {}
        self._began: dict[str, float] = {}
        self._retried = 0
        self._failures: Counter[str] = Counter()
        self._lately: list[tuple[float, float]] = []
        """Of the episodes that ended last: their ends, which are those of a heap, and their durations."""
        self._groups: tuple[ErrorGroup, ...] = ()
        self._grouped_of = 0
        self._scanned_s = float("-inf")
        self._audited = 0

    def look(self, workers: int = -1, score: Score | None = None) -> BatchStatus:
        """Return where the batch stands now; `workers` is how many run, as the executor says."""
        told = self._read_events()
        for key in (told & self.finished.keys()) | self._audit():
            self._check_again(key)
        claimed = dict(self._observer.claims())
        now_s = time.monotonic()
        if now_s - self._scanned_s > SCAN_PERIOD_S:
            self._scanned_s = now_s
            told = set(self._left)
        for key in (told - claimed.keys()) & self._left.keys():
            self._check(key)
        if len(self._left) <= len(claimed):  # the end is near, or a claim was left behind
            for key in list(self._left):
                self._check(key)
        running = tuple(
            RunningEpisode(self._left[key].name, claim.worker, _age_s(self._began.get(key)))
            for key, claim in claimed.items()
            if key in self._left and not claim.process.is_dead
        )
        mean_s, rate_per_hour = self._pace()
        left = len(self._left)
        at_once = max(len(running), 1)
        return BatchStatus(
            folder=str(self._folder.path),
            hash=self.plan.hash,
            episodes=len(self.plan.episodes),
            finished=len(self.finished),
            failures=dict(sorted(self._failures.items())),
            retried=self._retried,
            running=running,
            workers=workers,
            idle=self._idle() if workers and left else (),
            paused=self._paused({each.worker for each in running}) if left else None,
            mean_s=mean_s,
            rate_per_hour=rate_per_hour,
            left_s=None if mean_s is None else left * mean_s / at_once,
            score=score,
            errors=self._errors(),
            newest=tuple(self._newest),
            conclusion=None if self._left else self._conclusion(),
        )

    def since_last_event_s(self, who: str) -> float | None:
        """Return the time since the last event of a worker or driver; None for one that is not known."""
        return _age_s(self._last.get(who, {}).get("time_s"))

    def _conclusion(self) -> Mapping[str, Any] | None:
        try:
            document: Mapping[str, Any] = json.loads(self._folder.conclusion.read_bytes())
        except (OSError, ValueError):
            return None
        return document

    def _idle(self) -> tuple[str, ...]:
        return tuple(sorted(name for name, event in self._last.items() if event["what"] == "idle"))

    def _paused(self, running: Collection[str]) -> str | None:
        """Return why nothing begins: there is no room in the folder, or a worker that lives has said that it waits."""
        last = (event for name, event in self._last.items() if name in running)
        said = (str(event["why"]) for event in last if event["what"] == "paused")
        return machine.shortage(self._folder.path, self.plan.policy.minimum_free_bytes) or next(said, None)

    def _errors(self) -> tuple[ErrorGroup, ...]:
        if len(self.finished) != self._grouped_of:
            self._grouped_of = len(self.finished)
            failed = {key: each for key, each in self.finished.items() if each.failure is not None}
            names = {episode.key: episode.name for episode in self.plan.episodes if episode.key in failed}
            self._groups = grouped((str(each.failure), each.error, names[key]) for key, each in failed.items())
        return self._groups

    def _check(self, key: str) -> None:
        episode = self._left[key]
        finished = self._folder.finished(episode)
        if finished is not None:
            self.finished[key] = finished
            self.changes += 1
            del self._left[key]
            self._failures.update([str(finished.failure)] if finished.failure else [])
            heappush(self._lately, (finished.ended_s, finished.duration_s))
            if len(self._lately) > PACED_EPISODES:
                heappop(self._lately)

    def _check_again(self, key: str) -> None:
        """Forget a finished episode that was begun anew, or whose result was changed or deleted."""
        known, episode = self.finished[key], self._planned[key]
        if self._folder.finished(episode) == known:
            return
        del self.finished[key]
        self.changes += 1
        self._left[key] = episode
        self._grouped_of = -1
        if known.failure:
            self._failures -= Counter([str(known.failure)])
        self._check(key)

    def _audit(self) -> set[str]:
        """Return the next few of the finished episodes, in turn: what people do to results is no event."""
        episodes = self.plan.episodes
        turn = [(self._audited + step) % len(episodes) for step in range(min(AUDITED_EPISODES, len(episodes)))]
        self._audited += len(turn)
        return {episodes[place].key for place in turn} & self.finished.keys()

    def _read_events(self) -> set[str]:
        """Read new events; return the keys of the episodes that they call finished or retried."""
        told: set[str] = set()
        events = []
        for name, size in journal.sizes(self._folder.events):
            tail, seen = self._tails.get(name) or (journal.Tail(self._folder.events / name), 0)
            if size != seen:
                self._tails[name] = tail, size
                events += tail.read()
        for event in sorted(events, key=lambda event: float(event.get("time_s", 0.0))):
            what, key = event.get("what"), event.get("key")
            if what in ("finished", "retried"):
                told.add(str(key))
            elif what == "failed":
                self._retried += 1
            elif what == "began":
                self._began[str(key)] = float(event["time_s"])
            self._last[str(event.get("who"))] = event
        self._newest = [*self._newest, *events][-SHOWN_EVENTS:]
        return told

    def _pace(self) -> tuple[float | None, float | None]:
        """Return the mean of the last episodes' seconds, and how many are finished per hour."""
        lately = self._lately
        if not lately:
            return None, None
        mean_s = sum(duration_s for _, duration_s in lately) / len(lately)
        passed_s = max(lately)[0] - lately[0][0]
        rate = (len(lately) - 1) / passed_s * 3600 if len(lately) > 1 and passed_s > 0 else None
        return mean_s, rate


def _age_s(time_s: float | None) -> float | None:
    return None if time_s is None else max(0.0, time.time() - float(time_s))
