"""Uploads: streamed to disk under limits, checked there, and accepted as submissions."""

import base64
import fcntl
import hashlib
import json
import os
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from sqlalchemy import Row, func, select
from starlette.concurrency import run_in_threadpool

from benchbot.core.errors import BenchbotError
from benchbot.core.text import one_line
from benchbot.plugins.challenge import intake, signing, submissions
from benchbot.plugins.challenge.document import Phase
from benchbot.plugins.challenge.submissions import Record
from benchbot.plugins.challenge.tables import submissions as table
from benchbot.plugins.challenge.web.site import HttpError, Site, new_identifier

PARTIAL = ".partial"
MOST_STATEMENT_BYTES = 2**14
ORPHAN_S = 3600.0
"""So old is an archive without a row when it is removed: one that is being accepted has none for a moment."""


async def receive(
    site: Site, phase: Phase, team: Row[Any], chunks: AsyncIterator[bytes], title: str, envelope: str | None
) -> Record:
    """Take an archive in, check it, and put it into the queue; nothing of it stays when it is refused.

    `envelope` is the team's signed statement about it (DSSE, JSON in base64). Raises HttpError (413, 429) for what is
    too large, BenchbotError for what is not sound, not signed, not open, or over quota.
    """
    await run_in_threadpool(submissions.require_room, site.database, phase, team)
    room = await run_in_threadpool(_room, site, team)
    site.begin_upload(team.id)
    try:
        with partial(site) as file:
            sha256 = await _stream(chunks, file, min(site.challenge.largest_bytes, room))
            return await run_in_threadpool(accept, site, phase, team, Path(file.name), sha256, title, envelope)
    finally:
        site.end_upload(team.id)


@contextmanager
def partial(site: Site) -> Iterator[BinaryIO]:
    """Yield a new file for an upload, locked, under a submission's identifier; it is gone afterwards unless moved."""
    folder = site.challenge.uploads / PARTIAL
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / new_identifier()).open("xb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX)
            yield file
        finally:
            Path(file.name).unlink(missing_ok=True)


def sweep(site: Site) -> None:
    """Remove what servers that were killed have left: uploads that nobody receives, or that became no submission."""
    for path in (site.challenge.uploads / PARTIAL).glob("*"):
        with suppress(OSError), path.open("rb") as file:  # another server is at it, or was faster
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
    with site.database.reading() as connection:
        known = set(connection.scalars(select(table.c.id)))
    for path in site.challenge.uploads.glob("*.zip"):
        if path.stem not in known and time.time() - path.stat().st_mtime > ORPHAN_S:
            path.unlink(missing_ok=True)


async def _stream(chunks: AsyncIterator[bytes], file: BinaryIO, most_bytes: int) -> str:
    digest, size = hashlib.sha256(), 0
    async for chunk in chunks:
        size += len(chunk)
        if size > most_bytes:
            raise HttpError(
                413,
                BenchbotError(
                    "The submission is too large.",
                    f"{most_bytes >> 20} MiB are the most that may be uploaded now.",
                    "Leave out what can be made again.",
                ),
            )
        digest.update(chunk)
        await run_in_threadpool(file.write, chunk)
    await run_in_threadpool(_synchronise, file)
    return digest.hexdigest()


def _synchronise(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())


def accept(
    site: Site, phase: Phase, team: Row[Any], received: Path, sha256: str, title: str, envelope: str | None
) -> Record:
    """Check an archive that has been received whole, and put it into the queue; it is moved to where uploads are."""
    solution = intake.check(received, site.challenge, phase)
    title = one_line(title)[:120]
    about = signing.about(site.challenge.name, phase.name, team.name, solution.image)
    stated, digest = _statement(site, team, about, sha256, title, envelope)
    record = {
        "id": received.name,
        "title": title,
        "mode": solution.mode,
        "sha256": sha256,
        "size_bytes": received.stat().st_size,
        "envelope": stated,
        "statement": digest,
    }
    # The file is there before the row: a row whose file is missing could never be computed.
    upload = site.challenge.uploads / f"{received.name}.zip"
    received.rename(upload)
    try:
        return submissions.accept(site.database, phase, team, record)
    except BenchbotError:
        upload.unlink()
        raise


def _statement(
    site: Site, team: Row[Any], about: Record, sha256: str, title: str, envelope: str | None
) -> tuple[dict[str, Any], str]:
    """Return the signed statement of a submission and its digest: the team's, or one of ours on its behalf."""
    if envelope is None:
        if (site.challenge.signed and not team.baseline) or team.key is not None:
            raise BenchbotError(
                "The submission is not signed.",
                "This team has joined with a key; what is not signed with it could be anybody's.",
                "Submit with: benchbot challenge submit --key FILE",
            )
        more = {"title": title, "nonce": new_identifier() + new_identifier(), "by": "organiser"}
        stated = site.key.sign(signing.SUBMISSION, sha256, {**about, **more})
        return stated, signing.digest(stated)
    try:
        given = json.loads(base64.b64decode(envelope[:MOST_STATEMENT_BYTES], validate=True))
    except ValueError as error:
        raise BenchbotError("The statement cannot be read.", str(error), "Submit with benchbot's client.") from error
    if team.key is None:
        raise BenchbotError(
            "The statement is of no known key.", "The team joined without one.", "Submit without --key."
        )
    found = signing.opened(given, signing.public_key(team.key), signing.SUBMISSION)
    if found.sha256 != sha256 or not signing.is_about(found.predicate, about):
        raise BenchbotError(
            "The statement is about something else.",
            "It names another archive, image, challenge, phase or team.",
            "Sign this submission: benchbot challenge submit --key FILE",
        )
    return given, found.digest


def _room(site: Site, team: Row[Any]) -> int:
    kept = select(func.coalesce(func.sum(table.c.size_bytes), 0)).where(table.c.team == team.id)
    with site.database.reading() as connection:
        return max(site.challenge.kept_bytes - int(connection.scalar(kept) or 0), 0)
