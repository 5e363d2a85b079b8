"""Backup and restore: the whole of a challenge in one file that only its owner may read.

The database is kept as rows, one JSON list a line, so that a backup of SQLite can be restored into PostgreSQL. What
workers have computed is not in it: it is computed again.
"""

import json
import os
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sqlalchemy import func, insert, select

from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge.database import Database
from benchbot.plugins.challenge.document import FILE, QUEUED, RUNNING
from benchbot.plugins.challenge.tables import events, metadata, submissions, teams

ROWS = "database.jsonl"
LEFT_OUT = ("work", "challenge.db", "challenge.db-wal", "challenge.db-shm", "uploads/.partial")


def write(folder: Path, database: Database, target: Path) -> None:
    """Write a backup of a challenge into a new file; raises BenchbotError where there is one."""
    try:
        handle = os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError as error:
        raise BenchbotError(f"Cannot write {target}.", error.strerror or str(error), "Name a new file.") from error
    with os.fdopen(handle, "wb") as file, tarfile.open(fileobj=file, mode="w:gz") as archive:
        with tempfile.NamedTemporaryFile("w", encoding="utf-8") as rows:
            rows.writelines(f"{json.dumps(line)}\n" for line in _lines(database))
            rows.flush()
            archive.add(rows.name, ROWS)
        # After the rows: a submission that came in between has a file too many, never one too few.
        for path in sorted(folder.rglob("*")):
            name = path.relative_to(folder).as_posix()
            if path.is_file() and not any(name == out or name.startswith(f"{out}/") for out in LEFT_OUT):
                archive.add(path, name, recursive=False)
        file.flush()
        os.fsync(file.fileno())


def restore(source: Path, folder: Path, database_url: str | None) -> None:
    """Make a challenge of a backup, in a new folder and an empty database.

    What was running when the backup was made waits in the queue. Raises BenchbotError where there is something already.
    """
    from benchbot.plugins.challenge.database import url_of
    from benchbot.plugins.challenge.document import read

    if folder.exists() and any(folder.iterdir()):
        raise BenchbotError(f"{folder} is not empty.", "A challenge is restored whole.", "Name a new folder.")
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with tarfile.open(source) as archive:
            archive.extractall(folder, filter="data")
    except (OSError, tarfile.TarError) as error:
        raise BenchbotError(
            f"{source} is no backup of a challenge.", str(error), "Name what 'backup' wrote."
        ) from error
    rows = folder / ROWS
    if not rows.is_file() or not (folder / FILE).is_file():
        raise BenchbotError(f"{source} is no backup of a challenge.", f"It lacks {ROWS}.", "Name what 'backup' wrote.")
    database = Database(url_of(read(folder), database_url))
    with database.writing() as connection:
        if connection.execute(select(teams.c.id).limit(1)).first() is not None:
            raise BenchbotError("The database is not empty.", "Teams are in it.", "Name an empty one with --database.")
        with rows.open(encoding="utf-8") as lines:
            for line in lines:
                name, values = json.loads(line)
                connection.execute(insert(metadata.tables[name]).values(values))
        waiting = {"state": QUEUED, "worker": "", "lease_until": 0.0}
        connection.execute(submissions.update().where(submissions.c.state == RUNNING).values(waiting))
        connection.execute(teams.update().values(running=0))
        if connection.dialect.name == "postgresql":  # rows came with their numbers; new ones follow
            for table in (teams, events):
                counter = func.pg_get_serial_sequence(table.name, "id")
                connection.execute(select(func.setval(counter, select(func.max(table.c.id)).scalar_subquery())))
    rows.unlink()


def _lines(database: Database) -> Iterator[list[Any]]:
    with database.reading() as connection:
        for table in metadata.sorted_tables:
            if table.name != "sessions":
                for row in connection.execute(select(table)).mappings():
                    yield [table.name, dict(row)]
