"""The leaderboard of a phase: the score of each team that counts, ranked, and which of them luck could have ordered."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select

from benchbot.core.records import Evaluator
from benchbot.evaluation import intervals
from benchbot.evaluation.coverage import counted_rows
from benchbot.evaluation.intervals import Over
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import DISQUALIFIED, SCORED, Phase
from benchbot.plugins.challenge.tables import scores, submissions, teams
from benchbot.plugins.report import pairing, significance

DRAWS = 9_999
"""Random arrangements of a test of more places than can all be arranged: two digits of p, in milliseconds."""
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


@dataclass(frozen=True)
class Board:
    """The leaderboard of a phase, and the submissions that were taken off it, with the reasons."""

    phase: str
    score_name: str
    lower_is_better: bool
    standings: tuple[Standing, ...]
    disqualified: tuple[tuple[str, str, str], ...]
    """Team, submission, reason."""


def of(database: Database, phase: Phase, evaluator: Evaluator) -> Board:
    """Return the leaderboard of a phase, as the database is now."""
    lower = bool(evaluator.score(evaluator.headline).lower_is_better)
    chosen = (
        select(
            submissions.c.id,
            submissions.c.number,
            submissions.c.team,
            submissions.c.title,
            submissions.c.state,
            submissions.c.reason,
            submissions.c.received_at,
            teams.c.name,
            teams.c.baseline,
            scores.c.score,
        )
        .join(teams, teams.c.id == submissions.c.team)
        .join(scores, scores.c.submission == submissions.c.id, isouter=True)
        .where(submissions.c.phase == phase.name, submissions.c.state.in_((SCORED, DISQUALIFIED)))
        .order_by(submissions.c.number)
    )
    with database.reading() as connection:
        found = connection.execute(chosen).all()
        scored = [row for row in found if row.state == SCORED]
        counted = _counted(scored, lower=lower, last=phase.counts == "last")
        identifiers = [row.id for row in counted]
        those = select(scores.c.submission, scores.c.document).where(scores.c.submission.in_(identifiers))
        documents: dict[str, Document] = {row.submission: row.document for row in connection.execute(those)}
    entries: dict[int, int] = {}
    for row in scored:
        entries[row.team] = entries.get(row.team, 0) + 1
    groups = _groups([documents[row.id] for row in counted], evaluator)
    standings = []
    for place, (row, group) in enumerate(zip(counted, groups, strict=True), 1):
        interval = documents[row.id]["intervals"].get(evaluator.headline)
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
                entries=entries[row.team],
                received_at=row.received_at,
                by_environment={} if phase.hidden else _by_environment(documents[row.id], evaluator),
            )
        )
    out = tuple((row.name, row.id, row.reason) for row in found if row.state == DISQUALIFIED)
    return Board(phase.name, evaluator.headline, lower, tuple(standings), out)


def ranked(rows: Sequence[Any], *, lower: bool) -> list[Any]:
    """Return rows with `score` and `number` from the best on; of equal scores the earlier submission comes first."""
    return sorted(rows, key=lambda row: (row.score if lower else -row.score, row.number))


def _counted(scored: Sequence[Any], *, lower: bool, last: bool) -> list[Any]:
    """Return the submission of each team that counts, ranked."""
    counted: dict[int, Any] = {}
    for row in scored if last else reversed(ranked(scored, lower=lower)):
        counted[row.team] = row
    return ranked(list(counted.values()), lower=lower)


def _groups(documents: Sequence[Document], evaluator: Evaluator) -> list[int]:
    """Return for each document, from the best on, the rank of the best that it is not told apart from.

    A paired permutation test over places tells two apart, at a level of 5 %; too few places tell nobody apart.
    """
    groups: list[int] = []
    for place, document in enumerate(documents, 1):
        best = groups[-1] if groups else place
        groups.append(place if best != place and _told_apart(documents[best - 1], document, evaluator) else best)
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
    if not weighted or not any(weighted) or significance.smallest_p(weighted) >= significance.ALPHA:
        return False
    return significance.sign_flip(weighted, draws=DRAWS).p < significance.ALPHA


def _by_environment(document: Document, evaluator: Evaluator) -> dict[str, float]:
    found: dict[str, list[dict[str, float]]] = {}
    for row in _rows(document):
        found.setdefault(str(row["environment"]), []).append(row["scores"])
    return {name: evaluator.combine(parts)[evaluator.headline] for name, parts in sorted(found.items())}


def _rows(document: Document) -> list[dict[str, Any]]:
    return counted_rows(document["rows"], document["coverage"])
