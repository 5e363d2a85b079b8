"""The ASGI application of a challenge: pages, API, errors, and what browsers are told to allow."""

from collections.abc import Awaitable, Callable
from pathlib import Path

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.base import BaseHTTPMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

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
        if not isinstance(known, BenchbotError):
            raise known
        if request.url.path.startswith("/api/"):
            return JSONResponse(known.as_dict(), status)
        return pages.refusal(site, request, status, known)

    async def with_headers(request: Request, answer: Callable[[Request], Awaitable[Response]]) -> Response:
        response = await answer(request)
        for name, value in HEADERS.items():
            response.headers.setdefault(name, value)
        return response

    static = Mount("/static", StaticFiles(directory=Path(__file__).parent / "static"))
    return Starlette(
        routes=[*api.routes(site), *pages.routes(site), static],
        exception_handlers={BenchbotError: told, HttpError: told},
        middleware=[Middleware(BaseHTTPMiddleware, dispatch=with_headers)],
    )
