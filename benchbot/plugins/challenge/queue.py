"""The queue: workers claim submissions for a lease, and end each once, fair among teams."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Row, insert, select, update

from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import FAILED, QUEUED, RUNNING, SCORED
from benchbot.plugins.challenge.tables import scores, submissions, teams

Record = Mapping[str, Any]

LEASE_S = 60.0
"""A worker that has not extended its lease for so long is lost; its submission goes back to the queue."""
MOST_FAILURES = 3
"""So often may machine or simulator fail before the organiser has to look."""
NOT_THE_TEAMS = "Machine or simulator failed; the organiser's log says how."
"""What a team is told of it: the log could tell of a hidden place."""


@dataclass(frozen=True)
class Claim:
    """A submission that a worker has the lease of, for one attempt."""

    submission: str
    attempt: int
    phase: str
    mode: str
    sha256: str


def claim(database: Database, worker: str) -> Claim | None:
    """Take the next submission, or None when nothing waits or the queue is paused.

    It is of the team that has the fewest running, of these the one that was served longest ago, and of that
    team's the oldest. Submissions whose worker is lost are back in the queue first.
    """
    now = database.clock()
    waits = select(submissions.c.id).where(submissions.c.team == teams.c.id, submissions.c.state == QUEUED).exists()
    next_team = (
        select(teams.c.id)
        .where(teams.c.blocked.is_(None), waits)
        .order_by(teams.c.running, teams.c.served_at, teams.c.id)
        .limit(1)
        .with_for_update(skip_locked=True)
    )
    with database.reading() as connection:  # most polls find nothing, and need no lock
        lost = select(submissions.c.id).where(submissions.c.state == RUNNING, submissions.c.lease_until < now)
        some = select(submissions.c.id).where(submissions.c.state == QUEUED).limit(1)
        if connection.scalar(lost.limit(1)) is None and connection.scalar(some) is None:
            return None
    with database.writing() as connection:
        _recover(database, connection, now)
        if database.setting(connection, "paused") is not None:
            return None
        team = connection.scalar(next_team)
        of_team = select(submissions).where(submissions.c.team == team, submissions.c.state == QUEUED)
        oldest = of_team.order_by(submissions.c.number).limit(1).with_for_update()
        found = None if team is None else connection.execute(oldest).first()
        if found is None:
            return None
        attempt = found.attempt + 1
        lease = {"state": RUNNING, "attempt": attempt, "worker": worker[:200], "lease_until": now + LEASE_S}
        connection.execute(update(submissions).where(submissions.c.id == found.id).values(lease))
        served = update(teams).where(teams.c.id == found.team)
        connection.execute(served.values(running=teams.c.running + 1, served_at=now))
        database.tell(connection, worker, "claimed", found.id, found.team, f"attempt {attempt}")
        return Claim(found.id, attempt, found.phase, found.mode, found.sha256)


def extend(database: Database, claim: Claim) -> bool:
    """Extend the lease of a claim; return whether it still has one."""
    with database.writing() as connection:
        extended = update(submissions).where(*_held(claim)).values(lease_until=database.clock() + LEASE_S)
        return connection.execute(extended).rowcount == 1


def finish(database: Database, claim: Claim, score: float, document: Record, envelope: Record) -> bool:
    """Keep the score of a claim, once; return whether the claim still had its lease, and so whether it counts."""
    with database.writing() as connection:
        if not end_attempt(database, connection, claim, SCORED, ""):
            return False
        connection.execute(
            insert(scores).values(
                submission=claim.submission,
                phase=claim.phase,
                score=score,
                document=document,
                envelope=envelope,
                scored_at=database.clock(),
            )
        )
        database.changed(connection)
        database.tell(connection, "queue", "scored", claim.submission, detail=repr(score))
        return True


def fail(database: Database, claim: Claim, why: str, told: str | None = None) -> bool:
    """Give a claim back because machine or simulator failed; after `MOST_FAILURES` the submission fails.

    It fails at once when the team is `told` a reason, which is then its own.
    """
    with database.writing() as connection:
        count = connection.scalar(select(submissions.c.failures).where(submissions.c.id == claim.submission)) or 0
        state = FAILED if told is not None or count + 1 >= MOST_FAILURES else QUEUED
        held = end_attempt(database, connection, claim, state, (told or NOT_THE_TEAMS) if state == FAILED else "")
        if held:
            again = update(submissions).where(submissions.c.id == claim.submission)
            connection.execute(again.values(failures=count + 1))
            action = "failed" if state == FAILED else "retried"
            database.tell(connection, "queue", action, claim.submission, detail=why)
        return held


def give_back(database: Database, claim: Claim) -> bool:
    """Put a claim back into the queue that its worker, which ends, has not finished."""
    with database.writing() as connection:
        held = end_attempt(database, connection, claim, QUEUED, "")
        if held:
            database.tell(connection, "queue", "given back", claim.submission)
        return held


def give_back_of(database: Database, worker: str) -> None:
    """Put what a worker has claimed back into the queue at once: whoever calls this has seen it die."""
    with database.writing() as connection:
        died = select(submissions).where(submissions.c.state == RUNNING, submissions.c.worker == worker)
        _give_back(database, connection, connection.execute(died.with_for_update()).all())


def _recover(database: Database, connection: Connection, now: float) -> None:
    lost = select(submissions).where(submissions.c.state == RUNNING, submissions.c.lease_until < now)
    _give_back(database, connection, connection.execute(lost.with_for_update(skip_locked=True)).all())


def _give_back(database: Database, connection: Connection, lost: Sequence[Row[Any]]) -> None:
    for found in lost:
        claim = Claim(found.id, found.attempt, found.phase, found.mode, found.sha256)
        if end_attempt(database, connection, claim, QUEUED, ""):
            database.tell(connection, "queue", "recovered", found.id, found.team, f"{found.worker} is lost")


def end_attempt(database: Database, connection: Connection, claim: Claim, state: str, reason: str) -> bool:
    """End an attempt; nothing changes, and it returns False, when the claim has lost its lease."""
    ended = {"state": state, "reason": reason, "ended_at": None if state == QUEUED else database.clock(), "worker": ""}
    if connection.execute(update(submissions).where(*_held(claim)).values(ended)).rowcount == 0:
        return False
    owner = select(submissions.c.team).where(submissions.c.id == claim.submission).scalar_subquery()
    connection.execute(update(teams).where(teams.c.id == owner).values(running=teams.c.running - 1))
    return True


def _held(claim: Claim) -> tuple[Any, ...]:
    return (
        submissions.c.id == claim.submission,
        submissions.c.attempt == claim.attempt,
        submissions.c.state == RUNNING,
    )
