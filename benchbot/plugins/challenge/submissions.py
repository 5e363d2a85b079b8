"""Submissions: accepted within quotas and once, looked up, withdrawn."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import Connection, Row, and_, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import FAILED, QUEUED, RUNNING, SCORED, WITHDRAWN, Phase
from benchbot.plugins.challenge.tables import scores, submissions, teams

Record = Mapping[str, Any]


def require_room(database: Database, phase: Phase, team: Row[Any]) -> None:
    """Raise BenchbotError when a team could not submit now: told before anything is uploaded."""
    with database.reading() as connection:
        _require_room(database, connection, phase, team)


def accept(database: Database, phase: Phase, team: Row[Any], received: Record) -> Record:
    """Put a checked submission into the queue, and return it; raises BenchbotError over quota or for a replay.

    The team's row is locked meanwhile, so that of submissions at the same moment no more are taken than may be.
    """
    with database.writing() as connection:
        connection.execute(select(teams.c.id).where(teams.c.id == team.id).with_for_update()).one()
        _require_room(database, connection, phase, team)
        number = _next_number(database, connection)
        values = {
            **received,
            "number": number,
            "team": team.id,
            "phase": phase.name,
            "received_at": database.clock(),
            "state": QUEUED,
        }
        try:
            connection.execute(insert(submissions).values(values))
        except IntegrityError as error:
            raise BenchbotError(
                "This submission has been handed in already.",
                "Its signed statement was accepted before, and counts once.",
                "Sign it anew: benchbot challenge submit",
            ) from error
        database.tell(connection, f"team {team.id}", "submitted", received["id"], team.id, received["sha256"])
        return {**values, "reason": "", "attempt": 0}


def withdraw(database: Database, identifier: str, team: int) -> None:
    """Take a submission back that has not begun; raises BenchbotError for one that has, or is another team's."""
    with database.writing() as connection:
        own = and_(submissions.c.id == identifier, submissions.c.team == team)
        changed = connection.execute(
            update(submissions)
            .where(own, submissions.c.state == QUEUED)
            .values(state=WITHDRAWN, ended_at=database.clock())
        )
        if changed.rowcount == 0:
            state = connection.scalar(select(submissions.c.state).where(own))
            raise (
                no_submission(identifier)
                if state is None
                else BenchbotError(
                    f"Submission {identifier} cannot be withdrawn.",
                    "It has begun, or has ended; only what waits in the queue can be.",
                    "Ask the organiser.",
                )
            )
        database.tell(connection, f"team {team}", "withdrew", identifier, team)


def submission(database: Database, identifier: str, team: int | None = None) -> Row[Any]:
    """Return a submission with its score, of a team if one is named; raises BenchbotError when there is none."""
    chosen = (
        select(submissions, teams.c.name.label("team_name"), scores.c.score)
        .join(teams, teams.c.id == submissions.c.team)
        .join(scores, scores.c.submission == submissions.c.id, isouter=True)
        .where(submissions.c.id == identifier)
    )
    if team is not None:
        chosen = chosen.where(submissions.c.team == team)
    with database.reading() as connection:
        found = connection.execute(chosen).first()
    if found is None:
        raise no_submission(identifier)
    return found


def of_team(database: Database, team: int, most: int = 200) -> Sequence[Row[Any]]:
    """Return a team's submissions with their scores, the newest first."""
    chosen = (
        select(submissions, scores.c.score)
        .join(scores, scores.c.submission == submissions.c.id, isouter=True)
        .where(submissions.c.team == team)
        .order_by(submissions.c.number.desc())
        .limit(most)
    )
    with database.reading() as connection:
        return connection.execute(chosen).all()


def as_told(phase: Phase | None, row: Record, now: float) -> dict[str, Any]:
    """Return a submission as its team is told of it: what may wait in a phase tells neither when it began nor ended.

    A solution could say by the length of its run what it has seen in a hidden place.
    """
    told = dict(row)
    if phase is None or not phase.told_every_s or row["state"] not in (RUNNING, SCORED, FAILED):
        return told
    if row["state"] == RUNNING or row["ended_at"] > phase.told_until(now):
        return {**told, "state": QUEUED, "reason": "", "score": None, "ended_at": None}
    return {**told, "ended_at": phase.told_at(row["ended_at"])}


def _require_room(database: Database, connection: Connection, phase: Phase, team: Row[Any]) -> None:
    now = database.clock()
    blocked = connection.scalar(select(teams.c.blocked).where(teams.c.id == team.id))
    closed = phase.closed_because(datetime.fromtimestamp(now, UTC))
    if blocked or (closed and not team.baseline):
        raise BenchbotError(
            f"Nothing can be submitted to {phase.title} now.",
            str(blocked or closed),
            "Ask the organiser." if blocked else "Submit while it is open.",
        )
    counted = select(func.count()).where(
        submissions.c.team == team.id, submissions.c.phase == phase.name, submissions.c.state != WITHDRAWN
    )
    midnight = now - now % 86_400
    today = counted.where(submissions.c.received_at >= midnight)
    in_all = 1 if team.baseline else phase.in_all
    for most, chosen, when in ((phase.per_day, today, "today (UTC)"), (in_all, counted, "in this phase")):
        if most is not None and (connection.scalar(chosen) or 0) >= most:
            raise BenchbotError(
                f"{team.name} has used up its submissions to {phase.title}.",
                f"{most} may be submitted {when}.",
                "Wait until midnight, UTC." if when != "in this phase" else "Nothing more can be submitted.",
            )


def _next_number(database: Database, connection: Connection) -> int:
    database.number_next(connection)
    return (connection.scalar(select(func.max(submissions.c.number))) or 0) + 1


def no_submission(identifier: str) -> BenchbotError:
    """Return the error of a submission that is not there, or that is not for this team to see."""
    return BenchbotError(
        f"There is no submission {identifier[:40]!r}.", "Nobody has handed it in.", "See: benchbot challenge status"
    )
