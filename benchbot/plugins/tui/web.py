"""Serves the screens to a browser with textual-serve: on loopback, with a token; no process outlives the server."""

import asyncio
import hmac
import os
import secrets
import signal
import socket
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from aiohttp import web
from textual_serve.app_service import AppService
from textual_serve.server import Server

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError, ExitCode

COOKIE = "benchbot_tui"
HOST = "127.0.0.1"
END_TIMEOUT_S = 5.0
WIDEST, HIGHEST = 1000, 500

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


def serve(words: Sequence[str], port: int, variables: Mapping[str, str]) -> None:
    """Serve `benchbot WORDS…`, with these variables, to browsers of this machine until SIGINT or SIGTERM.

    Raises BenchbotError for a port that cannot be used.
    """
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((HOST, port))
        except OSError as error:
            raise BenchbotError(
                f"Port {port} of {HOST} cannot be used.",
                f"{error.strerror}.",
                "Leave --port out: any free one will do.",
            ) from error
        # Signals end the server's loop, which ends the children in order.
        asyncio.run(_Web(words, listener, variables).run())
    raise SystemExit(ExitCode.INTERRUPTED)


class _Web(Server):
    """Textual's server with authentication by token, and without a shell between it and its children."""

    def __init__(self, words: Sequence[str], listener: socket.socket, variables: Mapping[str, str]) -> None:
        url = f"http://{HOST}:{listener.getsockname()[1]}"
        templates = str(Path(__file__).parent / "pages")
        super().__init__("benchbot tui", HOST, title="BenchBot", public_url=url, templates_path=templates)
        self.token = secrets.token_urlsafe(24)
        self._words, self._listener, self._variables = list(words), listener, variables
        self._children: set[_Child] = set()

    async def run(self) -> None:
        """Serve until a signal ends it; no child is left then."""
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, ended.set)
        runner = web.AppRunner(await self._make_app(), shutdown_timeout=1.0)
        await runner.setup()
        try:
            await web.SockSite(runner, self._listener).start()
            console.note("In a browser of this machine (Ctrl-C ends it; what was started goes on):")
            console.data(f"{self.public_url}/?token={self.token}")
            await ended.wait()
        finally:
            await asyncio.gather(*(child.end() for child in self._children))
            await runner.cleanup()

    async def on_startup(self, app: web.Application) -> None:
        """Require the token. The base class would print what is served."""
        app.middlewares.append(self._authenticate)

    async def handle_websocket(self, request: web.Request) -> web.WebSocketResponse:
        """Run a process for a page, until either ends."""
        connection = web.WebSocketResponse(heartbeat=15)
        await connection.prepare(request)
        child = _Child(
            "",
            write_bytes=connection.send_bytes,
            write_str=connection.send_str,
            close=_closing(connection),
            download_manager=self.download_manager,
        )
        child.words, child.variables = self._words, self._variables
        self._children.add(child)
        try:
            await child.start(_size(request, "width", 80, WIDEST), _size(request, "height", 24, HIGHEST))
            await self._process_messages(connection, child)
        finally:
            await child.end()
            self._children.discard(child)
        return connection

    @web.middleware
    async def _authenticate(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        shown = request.query.get("token", "")
        if request.path == "/" and self._is_token(shown):
            answer = web.HTTPSeeOther("/")
            answer.set_cookie(COOKIE, self.token, httponly=True, samesite="Strict")
            raise answer
        if not self._is_token(request.cookies.get(COOKIE, "")):
            raise web.HTTPForbidden(text="Open the address that 'benchbot tui --web' has printed.\n")
        return await handler(request)

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(), self.token.encode())


class _Child(AppService):
    """The process of a page, in a process group of its own, which is ended with the page."""

    words: Sequence[str]
    variables: Mapping[str, str]

    async def end(self) -> None:
        """End it politely, then by force; safe to call twice."""
        with suppress(TimeoutError, OSError, ValueError):
            async with asyncio.timeout(END_TIMEOUT_S):
                await self.stop()
        process = self._process
        if process is not None:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            await process.wait()

    async def _open_app_process(self, width: int = 80, height: int = 24) -> Process:
        self._process = process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "benchbot", *self.words),
            stdin=PIPE,
            stdout=PIPE,
            stderr=PIPE,
            env={**self._build_environment(width=width, height=height), **self.variables},
            process_group=0,
        )
        self._stdin = process.stdin
        return process


def _closing(connection: web.WebSocketResponse) -> Callable[[], Awaitable[None]]:
    async def close() -> None:
        await connection.close()

    return close


def _size(request: web.Request, name: str, default: int, most: int) -> int:
    text = request.query.get(name, "")
    return min(int(text), most) if text.isascii() and text.isdigit() and int(text) > 0 else default
