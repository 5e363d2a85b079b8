"""Sockets on loopback or in the file system, uvicorn in a thread behind them, and clients that disconnect."""

import asyncio
import errno
import ipaddress
import os
import socket
import stat
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import uvicorn
from starlette.requests import Request
from starlette.types import ASGIApp

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.supervisor import Caller
from benchbot.supervisor.http.access import SOLUTION
from benchbot.supervisor.http.connections import BACKLOG, BoundedProtocol
from benchbot.supervisor.run import Run
from benchbot.wire.run_state import is_listening, live

# A solution may think for hours between two steps: its connection stays open.
KEEP_ALIVE_S = 24 * 3600
SHUTDOWN_S = 3
SEND_BUFFER_BYTES = 4 * 2**20
# A client on another machine is gone when the network is: after so many probes, one a second, without an answer.
PROBES = 3
KEEP_IDLE = getattr(socket, "TCP_KEEPIDLE", 0x10)
"""On macOS it is TCP_KEEPALIVE (tcp(4))."""

# A step takes a twentieth less than with the thread pool of Starlette, whose tasks and context are not needed here.
_REQUEST_THREADS = ThreadPoolExecutor(40, "benchbot-request")

T = TypeVar("T")


def bind_tcp(host: str, port: int, *, allow_remote: bool = False) -> socket.socket:
    """Return a bound TCP socket; port 0 is any free port.

    Raises BenchbotError when the address is not on loopback (unless `allow_remote`), not of this machine, or taken.
    """
    if not allow_remote and not _is_loopback(host):
        raise BenchbotError(
            f"'{host}' can be reached from other machines.",
            "Everybody on the network could then talk to the supervisor, protected by a token alone.",
            "Leave --host away to listen on 127.0.0.1 only.",
        )
    try:
        address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        # Named, so that asyncio knows it for TCP and sends what is small at once (TCP_NODELAY).
        listener = socket.socket(address[0], socket.SOCK_STREAM, socket.IPPROTO_TCP)
    except OSError as error:
        raise _cannot_listen(f"{host}:{port}", error) from error
    try:
        # Without it, a port stays taken for a minute after a run has ended (TIME_WAIT).
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        _keep_alive(listener)
        listener.bind(address[4])
        listener.listen()
    except OSError as error:
        listener.close()
        raise _cannot_listen(f"{host}:{port}", error) from error
    return listener


def bind_unix(path: Path) -> socket.socket:
    """Return a socket bound to `path` (0600); a missing folder is made (0700), a dead supervisor's socket replaced.

    Raises BenchbotError when something else is there, or somebody still listens.
    """
    listener = _BufferedListener(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        _remove_dead(path)
        mask = os.umask(0o177)
        try:
            listener.bind(str(path))
        finally:
            os.umask(mask)
        listener.listen()
    except OSError as error:
        listener.close()
        raise _cannot_listen(str(path), error) from error
    return listener


def url_of(listener: socket.socket) -> str:
    """Return the base URL of a bound TCP socket."""
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


class Server:
    """An application served in a background thread for as long as the context lasts."""

    def __init__(self, app: ASGIApp, listeners: list[socket.socket]) -> None:
        self._listeners = listeners
        self._ready = threading.Event()
        self._uvicorn = _Uvicorn(
            uvicorn.Config(
                app,
                loop="asyncio",
                http=BoundedProtocol,
                ws="none",
                lifespan="off",
                log_config=None,
                access_log=False,
                server_header=False,
                proxy_headers=False,
                backlog=BACKLOG,
                timeout_keep_alive=KEEP_ALIVE_S,
                timeout_graceful_shutdown=SHUTDOWN_S,
            ),
            self._ready,
        )
        self._thread = threading.Thread(target=self._serve, name="benchbot-server", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        self._ready.wait()
        self.check()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._uvicorn.should_exit = True
        self._thread.join(2 * SHUTDOWN_S)

    def check(self) -> None:
        """Raise BenchbotError when the server has ended by itself."""
        if not self._thread.is_alive():
            raise BenchbotError(
                "The supervisor's server ended.",
                "Its thread stopped by itself.",
                "Report it, with what was printed before.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            )

    def _serve(self) -> None:
        try:
            asyncio.run(self._uvicorn.serve(self._listeners))
        finally:
            self._ready.set()


async def in_thread(call: Callable[..., T], *arguments: Any) -> T:
    """Return the value of a blocking call, made in one of the threads of the requests."""
    return await asyncio.get_running_loop().run_in_executor(_REQUEST_THREADS, call, *arguments)


async def while_connected(request: Request, run: Run, call: Callable[[Caller], T]) -> T:
    """Return the value of a blocking call that may move the robot; tell the run if the client disconnects meanwhile."""
    where = request.client
    caller = Caller(getattr(request.state, SOLUTION, ""), where.port if where and not where.host else None)

    async def watch() -> None:
        while (await request.receive())["type"] != "http.disconnect":
            pass
        # Not among the threads of the requests: those may all be waiting for their turn.
        await asyncio.to_thread(run.hang_up, caller)

    watching = asyncio.create_task(watch())
    try:
        return await in_thread(call, caller)
    finally:
        watching.cancel()


class _Uvicorn(uvicorn.Server):
    """A uvicorn server that sets an event when it listens."""

    def __init__(self, config: uvicorn.Config, ready: threading.Event) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self._ready.set()


class _BufferedListener(socket.socket):
    """A listener whose connections hold a whole observation; Linux lets the buffers of TCP grow, but not of others."""

    def accept(self) -> tuple[socket.socket, Any]:
        connection, address = super().accept()
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        return connection, address


def _keep_alive(listener: socket.socket) -> None:
    """Enable TCP keep-alive, which detects that the other end of a connection has vanished (tcp(7))."""
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    listener.setsockopt(socket.IPPROTO_TCP, KEEP_IDLE, 1)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 1)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, PROBES)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _remove_dead(path: Path) -> None:
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise FileExistsError(errno.EEXIST, "Something that is not a socket is there")
    if is_listening(path):
        raise OSError(errno.EADDRINUSE, "Another supervisor listens there")
    path.unlink()


def _cannot_listen(where: str, error: OSError) -> BenchbotError:
    fix = "Choose another address with --port or --unix-socket."
    if error.errno == errno.EADDRINUSE:
        ours = [run.name for run in live() if run.connection.url == f"http://{where}" or run.connection.socket == where]
        end = f"End your run that has it: benchbot stop --run {ours[0]}" if ours else "Another program has it"
        fix = f"{end}; or take any free port: --port 0"
    return BenchbotError(f"Cannot listen on {where}.", f"{error.strerror or error}.", fix)
