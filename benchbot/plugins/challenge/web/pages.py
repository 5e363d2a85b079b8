"""The pages of a challenge, for people: rules, leaderboards, a team's own submissions, and the organiser's queue."""

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.routing import Route
from starlette.types import Message

from benchbot.core.errors import BenchbotError
from benchbot.core.text import visible
from benchbot.plugins.challenge import history, organiser, people, submissions
from benchbot.plugins.challenge.document import Phase, written
from benchbot.plugins.challenge.leaderboard import Board
from benchbot.plugins.challenge.people import SESSION_S
from benchbot.plugins.challenge.web import uploads
from benchbot.plugins.challenge.web.api import own_log
from benchbot.plugins.challenge.web.site import COOKIE, Caller, HttpError, Site, require_form, require_team

TEMPLATES = Path(__file__).parent / "templates"
CHUNK_BYTES = 2**20
FORM_BYTES = 2**16
SHOWN_EVENTS = 200
MOST_STEPS = 200
PICTURE_CACHE = "public, max-age=600"
STANDINGS = b"<!-- standings -->"
"""Where in the page of a leaderboard its tables come; no team can write it, since what teams write is escaped."""


def routes(site: Site) -> list[Route]:
    """Return the routes of the pages."""

    async def index(request: Request) -> Response:
        return await shown(request, "index.html", rules=rules_html(site.challenge.rules))

    async def board(request: Request) -> Response:
        phase = site.challenge.phase(request.path_params["phase"])
        caller = await run_in_threadpool(site.caller, request)
        content = await run_in_threadpool(board_page, site, phase, caller=caller, path=request.url.path)
        return HTMLResponse(content)

    async def picture(request: Request) -> Response:
        phase = site.challenge.phase(request.path_params["phase"])
        path = await run_in_threadpool(site.picture, phase.name, request.path_params["name"])
        # Its name is the sum of its bytes; not for long, since it may be taken off with its row.
        return FileResponse(path, headers={"cache-control": PICTURE_CACHE})

    async def past(request: Request) -> Response:
        phase = site.challenge.phase(request.path_params["phase"])
        caller, day = await run_in_threadpool(site.caller, request), request.query_params.get("day") or None
        content = await run_in_threadpool(history_page, site, phase, day, caller=caller, path=request.url.path)
        return HTMLResponse(content)

    async def states(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        found = await run_in_threadpool(submissions.submission, site.database, request.path_params["id"], team.id)
        phase = site.challenge.phases.get(found.phase)
        told = await run_in_threadpool(history.states, site.database, phase, found)
        return await shown(request, "states.html", submission=found, states=told)

    async def enter(request: Request) -> Response:
        caller = await run_in_threadpool(site.caller, request)
        if request.method == "GET":
            return await shown(request, "enter.html")
        form = await _form(request, FORM_BYTES)
        require_form(caller, request, form.get("form"))
        if form.get("invitation"):
            return await joined(request, form)
        known = await run_in_threadpool(site.known, str(form.get("token", "")).strip())
        if known is None:
            site.count_attempt(request)
            raise HttpError(
                401, BenchbotError("Nobody has this token.", "It is mistyped, or was renewed.", "Look again.")
            )
        return await begun(known)

    async def joined(request: Request, form: FormData) -> Response:
        words = str(form.get("invitation", "")).strip(), str(form.get("name", ""))
        if site.challenge.signed:
            raise BenchbotError(
                "A team joins with a key here.",
                "Submissions are signed, which a browser cannot do.",
                "Join with: benchbot challenge join URL",
            )
        try:
            token = await run_in_threadpool(people.join, site.database, site.challenge, *words)
        except BenchbotError:
            site.count_attempt(request)
            raise
        return await shown(request, "joined.html", token=token, team=people.clean_name(words[1]))

    async def begun(known: Caller) -> Response:
        number = None if known.team is None else known.team.id
        token = await run_in_threadpool(people.begin_session, site.database, number)
        response = RedirectResponse("/queue" if known.is_organiser else "/mine", 303)
        response.set_cookie(COOKIE, token, max_age=int(SESSION_S), httponly=True, samesite="strict", secure=site.secure)
        return response

    async def leave(request: Request) -> Response:
        caller = await run_in_threadpool(site.caller, request)
        require_form(caller, request, (await _form(request, FORM_BYTES)).get("form"))
        await run_in_threadpool(people.end_session, site.database, caller.session or "")
        response = RedirectResponse("/", 303)
        response.delete_cookie(COOKIE)
        return response

    async def mine(request: Request) -> Response:
        caller = await run_in_threadpool(site.caller, request)
        if caller.team is None:
            return RedirectResponse("/enter", 303)
        own = await run_in_threadpool(submissions.of_team, site.database, caller.team.id)
        now, phases = site.database.clock(), site.challenge.phases
        told = [submissions.as_told(phases.get(row.phase), dict(row._mapping), now) for row in own]
        return await shown(request, "mine.html", own=told)

    async def submit(request: Request) -> Response:
        caller = await run_in_threadpool(site.caller, request)
        team = require_team(caller)
        form = await _form(request, site.challenge.largest_bytes + FORM_BYTES)
        require_form(caller, request, form.get("form"))
        phase = site.challenge.phase(str(form.get("phase", "")))
        file = form.get("archive")
        if not isinstance(file, UploadFile) or not file.filename:
            raise BenchbotError("No archive was chosen.", "A submission is a file.", "benchbot challenge pack FOLDER")
        made = await uploads.receive(site, phase, team, _chunks(file), str(form.get("title", "")), None)
        return RedirectResponse(f"/mine#{made['id']}", 303)

    async def withdraw(request: Request) -> Response:
        caller = await run_in_threadpool(site.caller, request)
        team = require_team(caller)
        require_form(caller, request, (await _form(request, FORM_BYTES)).get("form"))
        await run_in_threadpool(submissions.withdraw, site.database, request.path_params["id"], team.id)
        return RedirectResponse("/mine", 303)

    async def log(request: Request) -> Response:
        team = require_team(await run_in_threadpool(site.caller, request))
        found = await run_in_threadpool(submissions.submission, site.database, request.path_params["id"], team.id)
        return own_log(site, found)

    async def queue(request: Request) -> Response:
        if not (await run_in_threadpool(site.caller, request)).is_organiser:
            raise HttpError(
                403, BenchbotError("This page is the organiser's.", "You are not.", "Enter with its token.")
            )
        counts = await run_in_threadpool(organiser.counts, site.database)
        events = await run_in_threadpool(organiser.log, site.database, SHOWN_EVENTS)
        paused = await run_in_threadpool(organiser.paused, site.database)
        return await shown(request, "queue.html", counts=counts, events=events, paused=paused)

    async def shown(request: Request, name: str, **values: Any) -> Response:
        caller = await run_in_threadpool(site.caller, request)
        return page(site, name, caller=caller, path=request.url.path, **values)

    return [
        Route("/", index),
        Route("/phases/{phase}", board),
        Route("/phases/{phase}/history", past),
        Route("/phases/{phase}/pictures/{name}", picture),
        Route("/enter", enter, methods=["GET", "POST"]),
        Route("/leave", leave, methods=["POST"]),
        Route("/mine", mine),
        Route("/mine", submit, methods=["POST"]),
        Route("/mine/{id}/withdraw", withdraw, methods=["POST"]),
        Route("/mine/{id}", states),
        Route("/mine/{id}/log", log),
        Route("/queue", queue),
    ]


def page(site: Site, name: str, status: int = 200, *, static: bool = False, **values: Any) -> Response:
    """Return a page, or one of a folder of files (`static`); nothing in it is unseen, or turns text round."""
    text = (
        templates()
        .get_template(name)
        .render(
            challenge=site.challenge,
            key=site.key.public,
            commitments=site.challenge.commitments(),
            static=static,
            **values,
        )
    )
    return HTMLResponse(visible(text), status)


def board_page(site: Site, phase: Phase, *, caller: Caller, path: str, static: bool = False) -> bytes:
    """Return the page of a leaderboard: its tables are the same for everybody, and are made once."""
    board = site.board(phase.name)
    folder = "pictures" if static else f"/phases/{phase.name}/pictures"

    def render(board: Board) -> bytes:
        template = templates().get_template("standings.html")
        return visible(template.render(phase=phase, board=board, pictures=folder)).encode()

    around = page(site, "board.html", caller=caller, path=path, static=static, phase=phase)
    return bytes(around.body).replace(STANDINGS, site.rendered(board, "static" if static else "html", render))


def history_page(
    site: Site, phase: Phase, day: str | None, *, caller: Caller, path: str, static: bool = False
) -> bytes:
    """Return the page of a leaderboard's past, with the leaderboard at the end of a day (YYYY-MM-DD, UTC) or now."""
    made, now, lower = site.history(phase.name), site.database.clock(), site.board(phase.name).lower_is_better
    until = now
    if day is not None:
        try:
            until = min(datetime.fromisoformat(f"{day}T00:00:00+00:00").timestamp() + history.DAY_S - 1, now)
        except ValueError as error:
            raise BenchbotError(f"'{day[:20]}' is no day.", str(error)[:80], "Such as: 2027-03-01") from error
    values: dict[str, Any] = {
        "standings": history.standing_at(made, until, lower_is_better=lower),
        "chart": history.chart(made, until, lower_is_better=lower) if made and made[0].at <= until else None,
        "steps": made[: -MOST_STEPS - 1 : -1],
        "until": until,
        "day": day,
        "frame": history.FRAME,
    }
    return bytes(page(site, "history.html", caller=caller, path=path, static=static, phase=phase, **values).body)


def refusal(site: Site, request: Request, status: int, error: BenchbotError) -> Response:
    """Return the page of a request that was refused."""
    return page(site, "refusal.html", status, caller=Caller(), path=request.url.path, error=error)


def rules_html(text: str) -> Markup:
    """Return rules in Markdown as HTML; HTML in them is shown as text."""
    from markdown_it import MarkdownIt

    return Markup(MarkdownIt("js-default", {"html": False}).render(text))  # noqa: S704 - it escapes what is given


@cache
def templates() -> Environment:
    """Return the templates, of which each value is escaped."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "moment": lambda seconds: Markup("<time>{}</time>").format(written(datetime.fromtimestamp(seconds, UTC))),
        "written": written,
        "score": lambda value: f"{value:.4f}",
    }
    return environment


async def _form(request: Request, most_bytes: int) -> FormData:
    """Return a form; raises HttpError (413) as soon as it is larger than it may be."""
    size = 0
    receive = request.receive

    async def limited() -> Message:
        nonlocal size
        message = await receive()
        size += len(message.get("body", b""))
        if size > most_bytes:
            raise HttpError(413, BenchbotError("The form is too large.", f"{most_bytes} bytes are the most.", "Less."))
        return message

    return await Request(request.scope, limited).form(max_files=1, max_fields=8, max_part_size=FORM_BYTES)


async def _chunks(file: UploadFile) -> AsyncIterator[bytes]:
    while chunk := await file.read(CHUNK_BYTES):
        yield chunk
