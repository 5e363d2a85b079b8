"""The database of a challenge: SQLite in WAL mode, or PostgreSQL by URL; its transactions and its migrations.

What may happen at most once is held by the database, not by the processes around it: quotas by a lock on the team's
row, claims by a lease and an attempt number that later writes must name, scores by their primary key, statements by
the digest of what was signed.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, func, insert, select, text, update
from sqlalchemy.exc import OperationalError

from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.challenge.document import Challenge
from benchbot.plugins.challenge.tables import events, settings

FILE = "challenge.db"
MIGRATING, NUMBERING = 0x62656E6368, 0x62656E6369
"""Keys of advisory locks of PostgreSQL."""


class Database:
    """The database of one challenge. All methods may be called from any thread and process."""

    def __init__(self, url: str, clock: Callable[[], float] = time.time) -> None:
        """Open a database, make or migrate its tables; raises BenchbotError when it cannot be reached."""
        self.engine = _engine(url)
        self.clock = clock
        try:
            _migrate(self.engine)
        except OperationalError as error:
            raise unreachable(error) from error

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """Yield a connection that sees one state of the database."""
        with self.engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """Yield a connection in a transaction that is committed on leaving, or undone after an error."""
        with self.engine.connect().execution_options(writes=True) as connection, connection.begin():
            yield connection

    def tell(
        self,
        connection: Connection,
        actor: str,
        action: str,
        submission: str | None = None,
        team: int | None = None,
        detail: str = "",
    ) -> None:
        """Write into the log who did what, as part of the transaction that does it."""
        told = {"at": self.clock(), "actor": actor[:200], "action": action, "submission": submission, "team": team}
        connection.execute(insert(events).values(**told, detail=detail[:2000]))

    def setting(self, connection: Connection, name: str) -> str | None:
        """Return a setting, None for one that is not set."""
        return connection.scalar(select(settings.c.value).where(settings.c.name == name))

    def changed(self, connection: Connection) -> None:
        """Note, as part of a transaction, that a leaderboard may be another one after it."""
        # The number of the newest event: unique, and written by the same transaction.
        number = str((connection.scalar(select(func.max(events.c.id))) or 0) + 1)
        if connection.execute(update(settings).where(settings.c.name == "changes").values(value=number)).rowcount == 0:
            connection.execute(insert(settings).values(name="changes", value=number))

    def changes(self) -> int:
        """Return a number that is another one whenever a leaderboard may be."""
        with self.reading() as connection:
            return int(self.setting(connection, "changes") or 0)

    def number_next(self, connection: Connection) -> None:
        """Be alone until the transaction ends in drawing the next number of something."""
        if connection.dialect.name == "postgresql":  # SQLite has one writer at a time
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": NUMBERING})


def url_of(challenge: Challenge, database: str | None) -> str:
    """Return the URL of a challenge's database: what was named, or the SQLite file in its folder."""
    if database is None:
        return f"sqlite:///{challenge.folder / FILE}"
    for prefix in ("postgresql://", "postgres://"):
        if database.startswith(prefix):
            return f"postgresql+psycopg://{database.removeprefix(prefix)}"
    return database if "://" in database else f"sqlite:///{Path(database).resolve()}"


def unreachable(error: OperationalError) -> BenchbotError:
    """Return the error of a database that cannot be reached; it quotes no URL, which may hold a password."""
    return BenchbotError(
        "The challenge's database cannot be reached.",
        str(error.orig).splitlines()[0][:300],
        "Start it, or name another with --database.",
        exit_code=ExitCode.INTERNAL,
    )


def _engine(url: str) -> Engine:
    try:
        engine = create_engine(url, pool_pre_ping=True, pool_size=10, max_overflow=30)
    except (ImportError, ValueError) as error:
        raise BenchbotError(
            "The challenge's database cannot be opened.",
            f"{type(error).__name__}: {error}"[:300],
            "Name a file, or postgresql://USER@HOST/NAME with 'pip install benchbot[challenge]'.",
        ) from error
    if engine.dialect.name == "sqlite":

        @event.listens_for(engine, "connect")
        def prepare(connection: Any, _record: object) -> None:
            connection.isolation_level = None  # `begin` below says how a transaction begins
            for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON", "busy_timeout=30000"):
                connection.execute(f"PRAGMA {pragma}")

        @event.listens_for(engine, "begin")
        def begin(connection: Connection) -> None:
            # A transaction that reads first and writes then could not be repeated: it takes the lock at once.
            writes = connection.get_execution_options().get("writes", False)
            connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _migrate(engine: Engine) -> None:
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    with engine.connect().execution_options(writes=True) as connection, connection.begin():
        if engine.dialect.name == "postgresql":  # of several servers that start at once, one migrates
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": MIGRATING})
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
