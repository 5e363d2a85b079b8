"""The HTTP API of a challenge, version 1: JSON, a bearer token, errors as `{title, why, fix}`."""

import json
from collections.abc import AsyncIterator
from dataclasses import asdict
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge import history, people, signing, submissions
from benchbot.plugins.challenge.document import SCORED
from benchbot.plugins.challenge.web import uploads
from benchbot.plugins.challenge.web.site import HttpError, Site, require_team

MOST_JSON_BYTES = 2**14


def routes(site: Site) -> list[Route]:
    """Return the routes below /api/v1."""

    async def describe(request: Request) -> Response:
        return JSONResponse(description(site))

    async def standings(request: Request) -> Response:
        phase = site.challenge.phase(request.path_params["phase"])
        return Response(await run_in_threadpool(standings_json, site, phase.name), media_type="application/json")

    async def past(request: Request) -> Response:
        phase = site.challenge.phase(request.path_params["phase"])
        return JSONResponse([asdict(step) for step in await run_in_threadpool(site.history, phase.name)])

    async def join(request: Request) -> Response:
        given = await _json(request)
        key = given.get("key")
        if site.challenge.signed and key is None:
            raise BenchbotError("A team joins with a key here.", "Submissions are signed.", "benchbot key make FILE")
        if key is not None:
            signing.public_key(key)
        words = str(given.get("invitation", "")), str(given.get("name", ""))
        try:
            token = await run_in_threadpool(people.join, site.database, site.challenge, *words, key)
        except BenchbotError:
            site.count_attempt(request)
            raise
        return JSONResponse({"token": token, "team": people.clean_name(words[1])}, 201)

    async def own_team(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        return JSONResponse({"team": team.name, "signs": team.key is not None})

    async def submit(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        phase = site.challenge.phase(request.path_params["phase"])
        title = request.query_params.get("title", "")
        envelope = request.headers.get(signing.HEADER)
        made = await uploads.receive(site, phase, team, _body(request), title, envelope)
        return JSONResponse(_public(site, made), 201)

    async def listed(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        rows = await run_in_threadpool(submissions.of_team, site.database, team.id)
        return JSONResponse([_public(site, row._mapping) for row in rows])

    async def one(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        found = await run_in_threadpool(submissions.submission, site.database, request.path_params["id"], team.id)
        return JSONResponse(_public(site, found._mapping))

    async def states(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        found = await run_in_threadpool(submissions.submission, site.database, request.path_params["id"], team.id)
        phase = site.challenge.phases.get(found.phase)
        return JSONResponse(await run_in_threadpool(history.states, site.database, phase, found))

    async def withdraw(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        await run_in_threadpool(submissions.withdraw, site.database, request.path_params["id"], team.id)
        return Response(status_code=204)

    async def log(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        found = await run_in_threadpool(submissions.submission, site.database, request.path_params["id"], team.id)
        return own_log(site, found)

    return [
        Route("/api/v1/challenge", describe),
        Route("/api/v1/phases/{phase}/leaderboard", standings),
        Route("/api/v1/phases/{phase}/history", past),
        Route("/api/v1/phases/{phase}/submissions", submit, methods=["POST"]),
        Route("/api/v1/team", own_team),
        Route("/api/v1/join", join, methods=["POST"]),
        Route("/api/v1/submissions", listed),
        Route("/api/v1/submissions/{id}", one),
        Route("/api/v1/submissions/{id}", withdraw, methods=["DELETE"]),
        Route("/api/v1/submissions/{id}/history", states),
        Route("/api/v1/submissions/{id}/log", log),
    ]


def standings_json(site: Site, phase: str) -> bytes:
    """Return the leaderboard of a phase as JSON."""
    return site.rendered(site.board(phase), "json", lambda board: json.dumps(asdict(board)).encode())


def description(site: Site) -> dict[str, Any]:
    """Return what everybody may know of a challenge."""
    challenge = site.challenge
    return {
        "name": challenge.name,
        "title": challenge.title,
        "organiser": challenge.organiser,
        "key": site.key.public,
        "commitments": challenge.commitments(),
        "signed": challenge.signed,
        "largest_bytes": challenge.largest_bytes,
        "phases": {
            phase.name: {
                "title": phase.title,
                "opens": phase.opens and phase.opens.isoformat(),
                "closes": phase.closes and phase.closes.isoformat(),
                "hidden": phase.hidden,
                "task": phase.batch["task"],
                "robots": phase.batch["robots"],
                "environments": None if phase.hidden else phase.batch["environments"],
                "method": phase.method,
                "modes": phase.modes,
                "per_day": phase.per_day,
                "in_all": phase.in_all,
                "counts": phase.counts,
            }
            for phase in challenge.phases.values()
        },
    }


def own_log(site: Site, found: Any) -> Response:
    """Return the log of a team's own submission; in a hidden phase nobody gets one, as it could tell of the place."""
    phase = site.challenge.phases.get(found.phase)
    path = site.challenge.work / found.id / "batch.log"
    if phase is None or phase.hidden:
        raise HttpError(
            403,
            BenchbotError(
                "There is no log of this phase.",
                "Its places are hidden, and what a solution prints could tell of them.",
                "Try the solution in a visible phase, or with: benchbot submit",
            ),
        )
    if not path.is_file():
        raise HttpError(404, BenchbotError("There is no log yet.", "It has not begun.", "Wait until it runs."))
    return FileResponse(path, media_type="text/plain; charset=utf-8", headers={"content-disposition": "attachment"})


def _public(site: Site, row: Any) -> dict[str, Any]:
    """Return what a team may know of a submission of its own."""
    told = submissions.as_told(site.challenge.phases.get(row["phase"]), row, site.database.clock())
    keys = ("id", "phase", "title", "mode", "sha256", "size_bytes", "received_at", "state", "reason", "ended_at")
    shown = {key: told.get(key) for key in keys}
    shown["image"] = signing.image_in(row["envelope"])
    return {**shown, "score": told.get("score") if told["state"] == SCORED else None}


async def _body(request: Request) -> AsyncIterator[bytes]:
    try:
        async for chunk in request.stream():
            yield chunk
    except ClientDisconnect as error:
        raise HttpError(400, BenchbotError("The upload ended early.", "The client is gone.", "Again.")) from error


async def _json(request: Request) -> dict[str, Any]:
    content = b""
    async for chunk in request.stream():
        content += chunk
        if len(content) > MOST_JSON_BYTES:
            raise HttpError(413, BenchbotError("The request is too large.", "It is no such request.", "Send less."))
    try:
        document = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise BenchbotError("The request is no JSON.", str(error), "Send a JSON object.") from error
    if not isinstance(document, dict):
        raise BenchbotError("The request is no JSON object.", "It is something else.", "Send a JSON object.")
    return document
