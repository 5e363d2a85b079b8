"""Uploads: streamed to disk under limits, checked there, and accepted as submissions."""

import base64
import hashlib
import json
import os
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

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
    identifier = new_identifier()
    partial = site.challenge.uploads / PARTIAL / identifier
    try:
        partial.parent.mkdir(parents=True, exist_ok=True)
        sha256 = await _stream(chunks, partial, min(site.challenge.largest_bytes, room))
        return await run_in_threadpool(_accept, site, phase, team, partial, sha256, title, envelope)
    finally:
        partial.unlink(missing_ok=True)
        site.end_upload(team.id)


async def _stream(chunks: AsyncIterator[bytes], path: Path, most_bytes: int) -> str:
    digest, size = hashlib.sha256(), 0
    with path.open("xb") as file:
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


def _synchronise(file: Any) -> None:
    file.flush()
    os.fsync(file.fileno())


def _accept(
    site: Site, phase: Phase, team: Row[Any], partial: Path, sha256: str, title: str, envelope: str | None
) -> Record:
    solution = intake.check(partial, site.challenge, phase)
    title = one_line(title)[:120]
    stated, digest = _statement(site, phase, team, sha256, title, envelope)
    received = {
        "id": partial.name,
        "title": title,
        "mode": solution.mode,
        "sha256": sha256,
        "size_bytes": partial.stat().st_size,
        "envelope": stated,
        "statement": digest,
    }
    # The file is there before the row: a row whose file is missing could never be computed.
    upload = site.challenge.uploads / f"{partial.name}.zip"
    partial.rename(upload)
    try:
        return submissions.accept(site.database, phase, team, received)
    except BenchbotError:
        upload.unlink()
        raise


def _statement(
    site: Site, phase: Phase, team: Row[Any], sha256: str, title: str, envelope: str | None
) -> tuple[dict[str, Any], str]:
    """Return the signed statement of a submission and its digest: the team's, or one of ours on its behalf."""
    if envelope is None:
        if site.challenge.signed or team.key is not None:
            raise BenchbotError(
                "The submission is not signed.",
                "This team has joined with a key; what is not signed with it could be anybody's.",
                "Submit with: benchbot challenge submit --key FILE",
            )
        stated = site.key.sign(
            signing.SUBMISSION,
            sha256,
            {
                "challenge": site.challenge.name,
                "phase": phase.name,
                "team": team.name,
                "title": title,
                "nonce": new_identifier() + new_identifier(),
                "by": "organiser",
            },
        )
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
    expected = {"challenge": site.challenge.name, "phase": phase.name, "team": team.name}
    if found.sha256 != sha256 or any(found.predicate.get(key) != value for key, value in expected.items()):
        raise BenchbotError(
            "The statement is about something else.",
            "It names another archive, challenge, phase or team.",
            "Sign this submission: benchbot challenge submit --key FILE",
        )
    return given, found.digest


def _room(site: Site, team: Row[Any]) -> int:
    kept = select(func.coalesce(func.sum(table.c.size_bytes), 0)).where(table.c.team == team.id)
    with site.database.reading() as connection:
        return max(site.challenge.kept_bytes - int(connection.scalar(kept) or 0), 0)
