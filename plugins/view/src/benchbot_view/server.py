"""The web application: on loopback, for one user with a token, who came to it by its own name."""

import asyncio
import hmac
import json
import secrets
import socket
from collections.abc import Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from threading import Lock
from typing import Any

import msgspec
import uvicorn
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from benchbot.plugin import BenchbotError
from benchbot_view import pages
from benchbot_view.episode import Episode
from benchbot_view.index import Index
from benchbot_view.live import LiveRuns
from benchbot_view.loading import Episodes
from benchbot_view.rows import Row
from benchbot_view.scoring import Scorer

HOST = "127.0.0.1"
COOKIE = "benchbot_view"
PAGE_ROWS = 20_000
KINDS = {
    "frame": (".jpg", "image/jpeg"),
    "depth": ("-depth.png", "image/png"),
    "classes": ("-classes.png", "image/png"),
}
SCRIPTS = tuple(sorted(path.name for path in pages.STATIC.glob("*.js")))
HEADERS = {
    "content-security-policy": f"{pages.POLICY}; frame-ancestors 'self'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}
MONTH_S = 30 * 86400

Endpoint = Callable[[Request], Awaitable[Response]]


class Guard:
    """Lets only the owner in: requests by the server's own name (no other name was rebound to it), with the token."""

    def __init__(self, app: ASGIApp, token: str, hosts: tuple[str, ...]) -> None:
        self._app, self._token, self._hosts = app, token, hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *((k.encode(), v.encode()) for k, v in HEADERS.items())]
            await send(message)

        await (self._refusal(request) or self._app)(scope, receive, send_with_headers)

    def _refusal(self, request: Request) -> Response | None:
        if request.headers.get("host", "") not in self._hosts:
            return PlainTextResponse("This is not its name.\n", 400)
        if request.method not in ("GET", "HEAD"):
            return PlainTextResponse("It is only to be looked at.\n", 405)
        if request.headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            return PlainTextResponse("Another site may not ask.\n", 403)
        if "token" in request.query_params and self._is_token(request.query_params["token"]):
            answer = RedirectResponse(request.url.path, 303)
            answer.set_cookie(COOKIE, self._token, httponly=True, samesite="strict")
            return answer
        if not self._is_token(request.cookies.get(COOKIE, "")):
            return PlainTextResponse("Open the address that 'benchbot view' has printed.\n", 403)
        return None

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode("utf-8", "replace"), self._token.encode())


class Views:
    """The endpoints."""

    def __init__(self, index: Index, title: str) -> None:
        self._index, self._title = index, title
        self._scorer = Scorer(index)
        self._episodes = Episodes(index)
        self._runs = LiveRuns(index)
        self._looking = Lock()

    def routes(self) -> list[Route]:
        """Return the routes."""
        return [
            Route("/", self._overview),
            Route("/index.html", self._overview),
            Route("/side-by-side.html", self._pair),
            Route("/episode/{id}.html", self._episode),
            Route("/live/{id}.html", self._live),
            Route("/data/rows", self._rows),
            Route("/data/evidence/{id}", self._evidence),
            Route("/data/cloud/{id}", self._cloud),
            Route("/data/live/{id}", self._live_data),
            Route("/picture/live/{id}/{kind}", self._live_picture),
            Route("/picture/{id}/{kind}/{name}", self._picture),
            Route("/static/style.css", self._style),
            Route("/static/three.js", self._three),
            Route("/static/{name}", self._script),
        ]

    def close(self) -> None:
        """End what was started."""
        self._scorer.close()
        self._episodes.close()
        self._runs.close()
        self._index.close()

    def look(self) -> None:
        """Look for what is new, unless it was done a moment ago or is being done; the first time, wait until it is."""
        if self._looking.acquire(blocking=not self._index.is_read):
            try:
                self._index.look()
            finally:
                self._looking.release()

    def rest(self) -> None:
        """Close what nobody looks at."""
        self._index.rest()
        self._runs.rest()

    async def _overview(self, request: Request) -> Response:
        return _html(pages.page("index.html", title=self._title, rows=None))

    async def _pair(self, request: Request) -> Response:
        return _html(pages.page("pair.html", title="Side by side"))

    async def _episode(self, request: Request) -> Response:
        row = await run_in_threadpool(self._row, request.path_params["id"])
        if row is None:
            return _nothing(request)
        try:
            episode = await run_in_threadpool(self._episodes.get, row.id)
        except BenchbotError as error:
            return _html(pages.page("problem.html", root="../", title=error.title, why=error.why, fix=error.fix), 404)
        document = {**about(row), **episode.document, "id": row.id}
        return _html(pages.page("episode.html", root="../", episode=document, evidence=None, cloud=None))

    async def _live(self, request: Request) -> Response:
        row = await run_in_threadpool(self._row, request.path_params["id"])
        if row is None or row.id not in self._index.runs:
            return _nothing(request)
        document = await run_in_threadpool(self._runs.describe, row.id)
        return _html(pages.page("live.html", root="../", episode={**about(row), **document, "id": row.id}))

    async def _rows(self, request: Request) -> Response:
        since, start = (_number(request, name) for name in ("since", "start"))
        return await run_in_threadpool(self._read_rows, since, start)

    def _row(self, id_: str) -> Row | None:
        """Return a row; who comes by the address of an episode may be the first, and has the folders read."""
        row = self._index.row(id_)
        if row is None:
            self.look()
            row = self._index.row(id_)
        return row

    def _read_rows(self, since: int, start: int) -> Response:
        self.look()
        count = PAGE_ROWS if since == 0 else 10**9
        revision, total, rows = self._index.rows(since=since, start=start, count=count)
        batches = [_told(name, status) for name, status in self._index.batches()]
        document = {
            "revision": revision,
            "total": total,
            "unscored": self._scorer.left,
            "batches": batches,
            "rows": rows,
        }
        return Response(
            msgspec.json.encode(document), media_type="application/json", background=BackgroundTask(self._scorer.work)
        )

    async def _evidence(self, request: Request) -> Response:
        try:
            found = await run_in_threadpool(self._episodes.evidence, request.path_params["id"])
        except BenchbotError:
            return _nothing(request)
        if found is None:
            return Response('{"ready":false}', 202, media_type="application/json")
        return Response(json.dumps(found), media_type="application/json")

    async def _cloud(self, request: Request) -> Response:
        episode = await self._known(request)
        path = None if episode is None else episode.folder / "cloud.json"
        return FileResponse(path, media_type="application/json") if path and path.is_file() else _nothing(request)

    async def _picture(self, request: Request) -> Response:
        kind, name = request.path_params["kind"], request.path_params["name"][:5]
        episode = await self._known(request)
        if episode is None or kind not in KINDS or not (name.isascii() and name.isdecimal()):
            return _nothing(request)
        path = picture_of(episode, kind, int(name))
        if path is None:
            return _nothing(request)
        return FileResponse(path, media_type=KINDS[kind][1], headers={"cache-control": "private, max-age=3600"})

    async def _known(self, request: Request) -> Episode | None:
        try:
            return await run_in_threadpool(self._episodes.get, request.path_params["id"])
        except BenchbotError:
            return None

    async def _live_data(self, request: Request) -> Response:
        found = await run_in_threadpool(self._runs.look, request.path_params["id"])
        if found is None:
            return _nothing(request)
        return Response(json.dumps(found), media_type="application/json")

    async def _live_picture(self, request: Request) -> Response:
        found = await run_in_threadpool(self._runs.picture, request.path_params["id"], request.path_params["kind"])
        return _nothing(request) if found is None else Response(found, media_type="image/png")

    async def _style(self, request: Request) -> Response:
        return Response(pages.style(), media_type="text/css")

    async def _three(self, request: Request) -> Response:
        content = await run_in_threadpool(pages.three)
        return Response(content, media_type="text/javascript", headers={"cache-control": "private, max-age=3600"})

    async def _script(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in SCRIPTS:
            return _nothing(request)
        return Response((pages.STATIC / name).read_bytes(), media_type="text/javascript")


def picture_of(episode: Episode, kind: str, number: int) -> Path | None:
    """Return the file of a picture, None where there is none; a number alone chooses it, so it leads nowhere else."""
    if kind == "frame" and number in episode.recorded.frames:
        return episode.recorded.frames[number]
    path = episode.folder / f"{number:05d}{KINDS[kind][0]}"
    return path if path.is_file() else None


def about(row: Row) -> dict[str, Any]:
    """Return what a page says of a row beside its result."""
    numbers = [("seed", row.seed), ("repeat", row.repeat), ("episode", row.episode)]
    return {
        "set": row.set,
        "solution": row.solution,
        "environment": row.environment,
        "condition": ", ".join(f"{word} {value}" for word, value in numbers if value is not None),
        "state": row.state,
        "score_name": row.score_name,
        "score": row.score,
        "steps": row.steps,
        "why": row.why,
    }


def _told(name: str, status: Any) -> dict[str, Any]:
    return {
        "name": name,
        "episodes": status.episodes,
        "finished": status.finished,
        "running": len(status.running),
        "failures": sum(status.failures.values()),
        "left_s": status.left_s,
        "score": None if status.score is None else {"name": status.score.name, "value": status.score.value},
    }


def _html(text: str, status: int = 200) -> Response:
    return Response(text, status, media_type="text/html", headers={"cache-control": "no-store"})


def _nothing(request: Request) -> Response:
    return PlainTextResponse("There is nothing here.\n", 404)


def _number(request: Request, name: str) -> int:
    text = request.query_params.get(name, "0")
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 12 else 0


def application(index: Index, title: str, token: str, port: int) -> ASGIApp:
    """Return the application that shows an index, for a server on this port of loopback."""
    views = Views(index, title)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> Any:
        async def rest() -> None:
            while True:
                await asyncio.sleep(10.0)
                await run_in_threadpool(views.rest)

        # Read while the browser is still starting.
        tasks = [asyncio.create_task(rest()), asyncio.create_task(run_in_threadpool(views.look))]
        yield
        for task in tasks:
            task.cancel()
        await run_in_threadpool(views.close)

    app = Starlette(routes=views.routes(), lifespan=lifespan)
    return Guard(app, token, (f"{HOST}:{port}", f"localhost:{port}"))


def listener(port: int) -> socket.socket:
    """Return a socket on loopback; port 0 is any free one. Raises BenchbotError for a port that cannot be used."""
    found = socket.socket()
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind((HOST, port))
    except OSError as error:
        found.close()
        raise BenchbotError(
            f"Port {port} of {HOST} cannot be used.", f"{error.strerror}.", "Leave --port out: any free one will do."
        ) from error
    return found


def serve(index: Index, title: str, port: int, tell: Callable[[str], None]) -> None:
    """Serve until SIGINT or SIGTERM; `tell` gets the address, with its token, once it answers."""
    with listener(port) as bound:
        token = secrets.token_urlsafe(24)
        number = bound.getsockname()[1]
        config = uvicorn.Config(
            application(index, title, token, number),
            log_level="critical",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=1,
        )
        bound.listen(128)
        tell(f"http://{HOST}:{number}/?token={token}")
        uvicorn.Server(config).run(sockets=[bound])
