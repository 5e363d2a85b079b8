"""Teams, their tokens and sessions, and the invitations by which they join.

Tokens are 256 random bits and kept as SHA-256 alone: nothing in the database, or in its backup, lets anybody in.
"""

import hashlib
import secrets
import unicodedata
from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, Row, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from benchbot.core.errors import BenchbotError
from benchbot.core.text import one_line
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import Challenge
from benchbot.plugins.challenge.tables import invitations, sessions, teams

Record = Mapping[str, Any]

SESSION_S = 12 * 3600.0


def invite(database: Database, note: str = "") -> str:
    """Return a new invitation, good for one team."""
    token = new_token()
    with database.writing() as connection:
        connection.execute(insert(invitations).values(token=digest(token), note=note[:200], made_at=database.clock()))
        database.tell(connection, "organiser", "invited", detail=note)
    return token


def join(database: Database, challenge: Challenge, invitation: str, name: str, key: Record | None = None) -> str:
    """Return the token of a new team; raises BenchbotError for a used invitation or a name that is taken."""
    team, token = clean_name(name), new_token()
    with database.writing() as connection:
        chosen = select(invitations.c.team).where(invitations.c.token == digest(invitation)).with_for_update()
        invited = connection.execute(chosen).first()
        if invited is None or invited.team is not None:
            raise BenchbotError(
                "This invitation cannot be used.",
                "It is unknown, or a team has joined with it.",
                "Ask the organiser for one.",
            )
        joined = connection.scalar(select(func.count()).select_from(teams).where(teams.c.baseline == 0)) or 0
        if challenge.most_teams is not None and joined >= challenge.most_teams:
            raise BenchbotError(
                "No more teams can join.", f"{joined} have, and no more may.", "Ask the organiser for more room."
            )
        number = _add_team(database, connection, team, token, key)
        used = update(invitations).where(invitations.c.token == digest(invitation))
        connection.execute(used.values(team=number))
        database.tell(connection, f"team {number}", "joined", team=number, detail=team)
    return token


def add_baseline(database: Database, name: str) -> Row[Any]:
    """Return the team that stands for a baseline of the organiser's, made if it is not there."""
    with database.writing() as connection:
        database.number_next(connection)  # alone, so that of two servers only one makes it
        chosen = select(teams).where(teams.c.folded == folded(name))
        found = connection.execute(chosen).first()
        if found is None:
            _add_team(database, connection, name, new_token(), None, baseline=1)
            found = connection.execute(chosen).one()
        return found


def team_of(database: Database, token: str) -> Row[Any] | None:
    """Return the team that has a token, None for a token that nobody has."""
    with database.reading() as connection:
        return connection.execute(select(teams).where(teams.c.token == digest(token))).first()


def team(database: Database, number: int) -> Row[Any] | None:
    """Return a team by number."""
    with database.reading() as connection:
        return connection.execute(select(teams).where(teams.c.id == number)).first()


def renew_token(database: Database, name: str) -> str:
    """Return a new token for a team, whose old one and whose sessions end; raises BenchbotError for no such team."""
    token = new_token()
    with database.writing() as connection:
        number = connection.scalar(select(teams.c.id).where(teams.c.folded == folded(name)))
        if number is None:
            raise BenchbotError(f"There is no team '{one_line(name)}'.", "Nobody has joined by it.", "See: teams")
        connection.execute(update(teams).where(teams.c.id == number).values(token=digest(token)))
        connection.execute(sessions.delete().where(sessions.c.team == number))
        database.tell(connection, "organiser", "renewed the token", team=number)
    return token


def all_teams(database: Database) -> Sequence[Row[Any]]:
    """Return the teams in the order in which they joined."""
    with database.reading() as connection:
        return connection.execute(select(teams).order_by(teams.c.id)).all()


def begin_session(database: Database, team: int | None) -> str:
    """Return the token of a new session in a browser: a team's, or the organiser's."""
    token = new_token()
    with database.writing() as connection:
        connection.execute(sessions.delete().where(sessions.c.expires_at < database.clock()))
        made = {"token": digest(token), "team": team, "expires_at": database.clock() + SESSION_S}
        connection.execute(insert(sessions).values(made))
    return token


def session(database: Database, token: str) -> Row[Any] | None:
    """Return a session that has not expired."""
    chosen = select(sessions).where(sessions.c.token == digest(token), sessions.c.expires_at >= database.clock())
    with database.reading() as connection:
        return connection.execute(chosen).first()


def end_session(database: Database, token: str) -> None:
    """End a session."""
    with database.writing() as connection:
        connection.execute(sessions.delete().where(sessions.c.token == digest(token)))


def _add_team(
    database: Database, connection: Connection, name: str, token: str, key: Record | None, *, baseline: int = 0
) -> int:
    values = {
        "name": name,
        "folded": folded(name),
        "token": digest(token),
        "key": key,
        "baseline": baseline,
        "joined_at": database.clock(),
    }
    try:
        return int(connection.execute(insert(teams).values(values)).inserted_primary_key[0])  # type: ignore[index]
    except IntegrityError as error:
        raise BenchbotError(
            f"The name '{name}' is taken.", "Another team has it, or one that looks like it.", "Choose another."
        ) from error


def new_token() -> str:
    """Return 256 random bits in hexadecimal digits: no command takes them for an option."""
    return secrets.token_hex(32)


def digest(token: str) -> str:
    """Return what is kept of a token: it has too many bits to be guessed, so that no slow hash is needed."""
    return hashlib.sha256(token.encode("utf-8", "replace")).hexdigest()


def folded(name: str) -> str:
    """Return a name so that two that look alike are the same: compatibility forms, case and spaces folded."""
    return "".join(unicodedata.normalize("NFKC", name).casefold().split())[:200]


def clean_name(name: str) -> str:
    """Return a team's name as it is kept: one visible line; raises BenchbotError for none, or too much."""
    kept = " ".join(name.split())
    if not kept or len(kept) > 60 or one_line(kept) != kept:
        raise BenchbotError(
            "This cannot be a team's name.",
            "It has no letter, more than 60, or one that cannot be seen.",
            "Choose one of 1 to 60 letters.",
        )
    return kept
