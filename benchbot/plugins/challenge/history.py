"""What was before: each team's best so far in a phase, the leaderboard at a past moment, a submission's states."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Row, select

from benchbot.core.records import Evaluator
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import DISQUALIFIED, FAILED, QUEUED, RUNNING, SCORED, WITHDRAWN, Phase
from benchbot.plugins.challenge.tables import events, scores, submissions, teams

BECAME = {
    "submitted": QUEUED,
    "claimed": RUNNING,
    "recovered": QUEUED,
    "given back": QUEUED,
    "retried": QUEUED,
    "failed": FAILED,
    "scored": SCORED,
    "withdrew": WITHDRAWN,
    "requeued": QUEUED,
    "disqualified": DISQUALIFIED,
}
"""The state of a submission after what the log says of it."""
OF_THE_RUN = ("claimed", "recovered", "given back", "retried", "failed", "scored")
"""What happens when a run begins and ends: it tells how long a solution ran."""
EXPLAINED = ("requeued", "disqualified")
"""Whose detail the organiser has written for all to see; that of others tells of machines."""

FRAME = (52.0, 748.0, 14.0, 300.0)
"""Left, right, top and bottom of the chart in pixels; names stand beside it."""
NAMED, LINE_PX, DAY_S = 6, 18.0, 86_400.0


@dataclass(frozen=True)
class Step:
    """From a moment on (seconds since the epoch) a team's score that counts was another one, and its rank by it."""

    at: float
    team: str
    is_baseline: bool
    score: float
    rank: int


def steps(database: Database, phase: Phase, evaluator: Evaluator) -> tuple[Step, ...]:
    """Return how the leaderboard of a phase came about, the oldest step first.

    Of each team there is what counted at a time, and nothing that never did. It rests on the submissions that are
    scored now: those that were disqualified, or are computed anew, are in no past either.
    """
    lower = bool(evaluator.score(evaluator.headline).lower_is_better)
    scored = (
        select(submissions.c.team, submissions.c.number, submissions.c.ended_at, teams.c.name, teams.c.baseline)
        .add_columns(scores.c.score)
        .join(teams, teams.c.id == submissions.c.team)
        .join(scores, scores.c.submission == submissions.c.id)
        .where(submissions.c.phase == phase.name, submissions.c.state == SCORED)
        .where(submissions.c.ended_at <= phase.told_until(database.clock()))
        .order_by(submissions.c.ended_at, submissions.c.number)
    )
    counts: dict[int, tuple[float, int]] = {}  # by team: a score that is less where it is better, and its number
    found: list[Step] = []
    with database.reading() as connection:
        for row in connection.execute(scored):
            key = (row.score if lower else -row.score, row.number)
            before = counts.get(row.team)
            is_better = before is None or (row.number > before[1] if phase.counts == "last" else key < before)
            if is_better:
                counts[row.team] = key
                rank = 1 + sum(other < key for other in counts.values())
                at = phase.told_at(row.ended_at)
                found.append(Step(at, row.name, bool(row.baseline), row.score, rank))
    return tuple(found)


def standing_at(made: Sequence[Step], at: float, *, lower_is_better: bool) -> tuple[Step, ...]:
    """Return the leaderboard as it was at a moment: for each team its step that counted then, ranked."""
    counted = {step.team: (number, step) for number, step in enumerate(made) if step.at <= at}
    sign = 1 if lower_is_better else -1
    ordered = sorted(counted.values(), key=lambda item: (sign * item[1].score, item[0]))
    return tuple(
        Step(step.at, step.team, step.is_baseline, step.score, rank) for rank, (_, step) in enumerate(ordered, 1)
    )


def states(database: Database, phase: Phase | None, found: Row[Any]) -> list[dict[str, Any]]:
    """Return the states that a submission had, which was looked up: `{at, state, why}`, the oldest first.

    Where results are told at fixed moments, a run that ended is told at the one that follows, and no other moment of
    it.
    """
    held_back = phase is not None and phase.told_every_s > 0
    chosen = select(events).where(events.c.submission == found.id, events.c.action.in_(BECAME)).order_by(events.c.id)
    told: list[dict[str, Any]] = []
    with database.reading() as connection:
        rows = connection.execute(chosen).all()
    for row in rows:
        at = row.at
        if phase is not None and held_back and row.action in OF_THE_RUN:
            at = phase.told_at(row.at)
            overtaken = any(other.id > row.id and other.action in EXPLAINED and other.at < at for other in rows)
            if row.action not in ("scored", "failed") or overtaken or row.at > phase.told_until(database.clock()):
                continue
        why = row.detail if row.action in EXPLAINED else found.reason if BECAME[row.action] == found.state else ""
        told.append({"at": at, "state": BECAME[row.action], "why": why})
    return told


@dataclass(frozen=True)
class Curve:
    """A team's line in the chart: corners in pixels, and where its name stands if it is one of the best."""

    team: str
    is_baseline: bool
    points: str
    end: tuple[float, float]
    label_y: float | None


@dataclass(frozen=True)
class Chart:
    """The best so far of each team over time, as SVG shows it; ticks are positions in pixels and what they say."""

    curves: tuple[Curve, ...]
    across: tuple[tuple[float, str], ...]
    up: tuple[tuple[float, str], ...]


def chart(made: Sequence[Step], until: float, *, lower_is_better: bool) -> Chart:
    """Return the chart of steps up to a moment; the best teams are named, the best curve is the last."""
    first, best = made[0].at, standing_at(made, until, lower_is_better=lower_is_better)
    last = max(until, first + 1)
    low, high, each = _scale([step.score for step in made])
    left, right, top, bottom = FRAME

    def x(at: float) -> float:
        return left + (right - left) * (at - first) / (last - first)

    def y(score: float) -> float:
        return bottom - (bottom - top) * (score - low) / (high - low)

    labels: dict[str, float] = {}
    floor = top - LINE_PX
    for step in sorted(best[:NAMED], key=lambda step: y(step.score)):  # no name lies on another
        floor = labels[step.team] = max(y(step.score), floor + LINE_PX)
    curves = []
    for standing in reversed(best):
        own = [step for step in made if step.team == standing.team and step.at <= until]
        corners = [(x(own[0].at), y(own[0].score))]
        for step in own[1:]:
            corners += [(x(step.at), corners[-1][1]), (x(step.at), y(step.score))]
        corners.append((right, corners[-1][1]))
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in corners)
        curves.append(Curve(standing.team, standing.is_baseline, points, corners[-1], labels.get(standing.team)))
    moments = [first + (last - first) * part / 4 for part in range(5)]
    span_s = last - first
    form = "%Y-%m-%d" if span_s > 4 * DAY_S else "%m-%d %H:%M" if span_s > 4 * 60 else "%H:%M:%S"
    across = tuple((x(moment), datetime.fromtimestamp(moment, UTC).strftime(form)) for moment in moments)
    count = round((high - low) / each)
    digits = max(0, -math.floor(math.log10(each)))
    up = tuple((y(low + each * n), f"{low + each * n:.{digits}f}") for n in range(count + 1))
    return Chart(tuple(curves), across, up)


def _scale(values: Sequence[float]) -> tuple[float, float, float]:
    """Return the ends of a scale around values, and the step of its ticks: 1, 2 or 5 times a power of ten."""
    low, high = min(values), max(values)
    rough = max(high - low, abs(high) * 1e-3, 1e-6) / 4
    power = 10.0 ** math.floor(math.log10(rough))
    each = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough)
    least = math.floor(low / each) * each
    most = math.ceil(high / each) * each
    return least, most if most > least else least + each, each
