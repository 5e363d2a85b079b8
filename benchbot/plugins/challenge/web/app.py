"""The ASGI application of a challenge: pages, API, errors, and what browsers are told to allow."""

from pathlib import Path

from sqlalchemy.exc import DBAPIError
from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge.web import api, pages
from benchbot.plugins.challenge.web.site import HttpError, Site

HEADERS = {
    # No script at all: nothing that a team writes can run in another's browser.
    "content-security-policy": "default-src 'none'; style-src 'self'; img-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "cache-control": "no-store",
}


def create_app(site: Site) -> Starlette:
    """Return the application that serves a challenge."""

    async def told(request: Request, error: Exception) -> Response:
        status, known = (error.status, error.error) if isinstance(error, HttpError) else (400, error)
        if isinstance(error, DBAPIError):  # nothing of it is told: it could quote what was asked
            status, known = 503, _AWAY
        if not isinstance(known, BenchbotError):
            raise known
        if request.url.path.startswith("/api/"):
            return JSONResponse(known.as_dict(), status)
        return pages.refusal(site, request, status, known)

    static = Mount("/static", StaticFiles(directory=Path(__file__).parent / "static"))
    return Starlette(
        routes=[*api.routes(site), *pages.routes(site), static],
        exception_handlers={BenchbotError: told, HttpError: told, DBAPIError: told},
        middleware=[Middleware(_WithHeaders)],
    )


class _WithHeaders:
    """Adds the headers that every answer has, unless it has its own."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, sent)


_AWAY = BenchbotError("The challenge's database is away.", "It does not answer.", "Try it again in a moment.")
