"""The organiser's acts on the queue: pausing, computing anew, disqualifying; and the log of all acts."""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, Row, Select, func, insert, select, update

from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import DISQUALIFIED, QUEUED, RUNNING
from benchbot.plugins.challenge.queue import Claim, end_attempt
from benchbot.plugins.challenge.submissions import no_submission
from benchbot.plugins.challenge.tables import events, scores, settings, submissions

Record = Mapping[str, Any]


def pause(database: Database, why: str | None) -> None:
    """Let no worker begin anything, for a reason; None lets them again."""
    with database.writing() as connection:
        connection.execute(settings.delete().where(settings.c.name == "paused"))
        if why is not None:
            connection.execute(insert(settings).values(name="paused", value=why))
        database.tell(connection, "organiser", "resumed" if why is None else "paused", detail=why or "")


def paused(database: Database) -> str | None:
    """Return why the queue is paused, None when it is not."""
    with database.reading() as connection:
        return database.setting(connection, "paused")


def requeue(database: Database, identifier: str, why: str) -> None:
    """Compute a submission anew, whatever became of it; its score goes, and what it was stays in the log."""
    with database.writing() as connection:
        found = _locked(database, connection, identifier)
        if found.state == RUNNING:
            end_attempt(
                database, connection, Claim(found.id, found.attempt, found.phase, found.mode, found.sha256), QUEUED, ""
            )
        before = connection.scalar(select(scores.c.score).where(scores.c.submission == identifier))
        connection.execute(scores.delete().where(scores.c.submission == identifier))
        again = {"state": QUEUED, "reason": "", "failures": 0, "ended_at": None}
        connection.execute(update(submissions).where(submissions.c.id == identifier).values(again))
        database.changed(connection)
        if before is not None:  # an event of its own: the team is told why, but maybe not yet its score
            database.tell(connection, "organiser", "took back", identifier, found.team, f"its score was {before!r}")
        database.tell(connection, "organiser", "requeued", identifier, found.team, why)


def disqualify(database: Database, identifier: str, why: str) -> None:
    """Take a submission off the leaderboard; the reason stays visible."""
    with database.writing() as connection:
        found = _locked(database, connection, identifier)
        if found.state == RUNNING:
            claim = Claim(found.id, found.attempt, found.phase, found.mode, found.sha256)
            end_attempt(database, connection, claim, DISQUALIFIED, why)
        out = {"state": DISQUALIFIED, "reason": why, "ended_at": database.clock()}
        connection.execute(update(submissions).where(submissions.c.id == identifier).values(out))
        database.changed(connection)
        database.tell(connection, "organiser", "disqualified", identifier, found.team, why)


def log(database: Database, most: int = 200, submission: str | None = None) -> Sequence[Row[Any]]:
    """Return what happened, the newest first."""
    chosen: Select[Any] = select(events).order_by(events.c.id.desc()).limit(most)
    if submission is not None:
        chosen = chosen.where(events.c.submission == submission)
    with database.reading() as connection:
        return connection.execute(chosen).all()


def counts(database: Database) -> dict[str, int]:
    """Return how many submissions are in each state."""
    chosen = select(submissions.c.state, func.count()).group_by(submissions.c.state)
    with database.reading() as connection:
        return {state: count for state, count in connection.execute(chosen)}  # noqa: C416 - rows are no tuples


def _locked(database: Database, connection: Connection, identifier: str) -> Row[Any]:
    found = connection.execute(select(submissions).where(submissions.c.id == identifier).with_for_update()).first()
    if found is None:
        raise no_submission(identifier)
    return found
