"""The leaderboard of a phase: the score of each team that counts, ranked, and which of them luck could have ordered."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import func, select

from benchbot.core.records import Evaluator
from benchbot.evaluation import intervals
from benchbot.evaluation.coverage import counted_rows
from benchbot.evaluation.intervals import Over
from benchbot.plugins.challenge import pictures
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import DISQUALIFIED, SCORED, Challenge, Phase
from benchbot.plugins.challenge.tables import scores, submissions, teams
from benchbot.plugins.report import pairing, significance

DRAWS = 9_999
"""Random arrangements of a test of more places than can all be arranged: two digits of p, in milliseconds."""
MOST_VALUES = 500
"""So many submissions are asked for at once: databases limit the values of a statement."""
Document = Mapping[str, Any]


@dataclass(frozen=True)
class Standing:
    """One row: a team's submission that counts, its rank, and the group of those that are not told apart from its best.

    `group` is the rank of the group's best. `by_environment` holds mean headline scores, in visible phases.
    """

    rank: int
    group: int
    submission: str
    number: int
    team: str
    is_baseline: bool
    title: str
    score: float
    interval: tuple[float, float] | None
    entries: int
    """How many submissions of the team have been scored."""
    received_at: float
    by_environment: Mapping[str, float]
    pictures: tuple[Document, ...] = ()
    """Of what it found in a place that everybody may see (benchbot.plugins.challenge.pictures)."""


@dataclass(frozen=True)
class Board:
    """The leaderboard of a phase, and the submissions that were taken off it, with the reasons."""

    phase: str
    score_name: str
    lower_is_better: bool
    standings: tuple[Standing, ...]
    disqualified: tuple[tuple[str, str, str], ...]
    """Team, submission, reason."""


@dataclass
class Memory:
    """The documents of the board of before, by submission and time of its score, and what was worked out of them.

    `by_environment` are their scores in each place, `told_apart` says which of them were.
    """

    documents: dict[tuple[str, float], Document] = field(default_factory=dict)
    by_environment: dict[tuple[str, float], Mapping[str, float]] = field(default_factory=dict)
    told_apart: dict[tuple[tuple[str, float], tuple[str, float]], bool] = field(default_factory=dict)


def of(
    database: Database, challenge: Challenge, phase: Phase, evaluator: Evaluator, memory: Memory | None = None
) -> Board:
    """Return the leaderboard of a phase, as the database is now; of equal scores the earlier submission is first."""
    memory = memory or Memory()
    lower = bool(evaluator.score(evaluator.headline).lower_is_better)
    best = scores.c.score.asc() if lower else scores.c.score.desc()
    first = (submissions.c.number.desc(),) if phase.counts == "last" else (best, submissions.c.number)
    scored = (
        select(
            submissions.c.id,
            submissions.c.number,
            submissions.c.title,
            submissions.c.received_at,
            teams.c.name,
            teams.c.baseline,
            scores.c.score,
            scores.c.scored_at,
            func.row_number().over(partition_by=submissions.c.team, order_by=first).label("place"),
            func.count().over(partition_by=submissions.c.team).label("entries"),
        )
        .join(teams, teams.c.id == submissions.c.team)
        .join(scores, scores.c.submission == submissions.c.id)
        .where(submissions.c.phase == phase.name, submissions.c.state == SCORED)
        .where(submissions.c.ended_at <= phase.told_until(database.clock()))
        .subquery()
    )
    order = (scored.c.score.asc() if lower else scored.c.score.desc(), scored.c.number)
    counted_in = select(scored).where(scored.c.place == 1).order_by(*order)
    taken_off = (
        select(teams.c.name, submissions.c.id, submissions.c.reason)
        .join(teams, teams.c.id == submissions.c.team)
        .where(submissions.c.phase == phase.name, submissions.c.state == DISQUALIFIED)
        .order_by(submissions.c.number)
    )
    with database.reading() as connection:
        counted = connection.execute(counted_in).all()
        out = tuple(tuple(row) for row in connection.execute(taken_off))
        new = [row.id for row in counted if (row.id, row.scored_at) not in memory.documents]
        found = select(scores.c.submission, scores.c.scored_at, scores.c.document)
        for start in range(0, len(new), MOST_VALUES):
            for row in connection.execute(found.where(scores.c.submission.in_(new[start : start + MOST_VALUES]))):
                memory.documents[row.submission, row.scored_at] = row.document
    keys = [(row.id, row.scored_at) for row in counted]
    memory.documents = {key: memory.documents[key] for key in keys}
    memory.by_environment = {
        key: memory.by_environment.get(key) or by_environment(document, evaluator)
        for key, document in memory.documents.items()
        if not phase.hidden
    }
    groups = _groups(keys, evaluator, memory)
    standings = []
    for place, (row, key, group) in enumerate(zip(counted, keys, groups, strict=True), 1):
        document = memory.documents[key]
        interval = document["intervals"].get(evaluator.headline)
        standings.append(
            Standing(
                rank=place,
                group=group,
                submission=row.id,
                number=row.number,
                team=row.name,
                is_baseline=bool(row.baseline),
                title=row.title,
                score=row.score,
                interval=None if interval is None else (interval["low"], interval["high"]),
                entries=row.entries,
                received_at=row.received_at,
                by_environment=memory.by_environment.get(key, {}),
                pictures=pictures.shown(challenge, phase, document),
            )
        )
    return Board(phase.name, evaluator.headline, lower, tuple(standings), out)


def _groups(keys: Sequence[tuple[str, float]], evaluator: Evaluator, memory: Memory) -> list[int]:
    """Return for each document, from the best on, the rank of the best that it is not told apart from.

    A paired permutation test over places tells two apart, at a level of 5 %; too few places tell nobody apart.
    """
    groups: list[int] = []
    tested = {}
    for place, key in enumerate(keys, 1):
        best = groups[-1] if groups else place
        is_apart = False
        if best != place:
            pair = keys[best - 1], key
            is_apart = (
                memory.told_apart[pair]
                if pair in memory.told_apart
                else _told_apart(memory.documents[pair[0]], memory.documents[key], evaluator)
            )
            tested[pair] = is_apart
        groups.append(place if is_apart else best)
    memory.told_apart = tested
    return groups


def _told_apart(a: Document, b: Document, evaluator: Evaluator) -> bool:
    found = pairing.pair(_rows(a), _rows(b)).pairs
    weighted = []
    for cluster in intervals.grouped(found, lambda pair: pair.environment, Over.PLACES):
        first, second = (
            evaluator.combine([getattr(pair, side)["scores"] for pair in cluster])[evaluator.headline]
            for side in ("a", "b")
        )
        weighted.append((first - second) * len(cluster))
    return is_more_than_luck(weighted)


def is_more_than_luck(differences: Sequence[float]) -> bool:
    """Say whether a permutation test tells two apart by their differences over places; too few places tell nobody."""
    if not any(differences) or significance.smallest_p(differences) >= significance.ALPHA:
        return False
    return significance.sign_flip(differences, draws=DRAWS).p < significance.ALPHA


def by_environment(document: Document, evaluator: Evaluator) -> dict[str, float]:
    """Return the headline score in each environment of a scores document."""
    found: dict[str, list[dict[str, float]]] = {}
    for row in _rows(document):
        found.setdefault(str(row["environment"]), []).append(row["scores"])
    return {name: evaluator.combine(parts)[evaluator.headline] for name, parts in sorted(found.items())}


def _rows(document: Document) -> list[dict[str, Any]]:
    return counted_rows(document["rows"], document["coverage"])
