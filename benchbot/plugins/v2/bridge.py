"""The way of BenchBot v2's published client to a run: a proxy for HTTP (RFC 9110, 3.7) that knows one server only.

That client asks `http://benchbot_supervisor:10000` without a token. Its HTTP library takes the proxy that the variable
`http_proxy` names, with user and password: so it needs no entry in /etc/hosts, no fixed port, and no open run.
"""

import hmac
import json
import secrets
import socket
import subprocess
import sys
import threading
from base64 import b64encode
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

from benchbot.api.transport import Transport
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.wire.run_state import Connection

HOSTS = {"benchbot_supervisor", "localhost", "127.0.0.1"}
PORT = 10000
"""The port in the network of a container, where no other is taken."""
LOOPBACK = "127.0.0.1"
USER = "benchbot"

_LISTEN = """\
import ctypes, os, socket, sys
libc = ctypes.CDLL(None, use_errno=True)
process, port, control = map(int, sys.argv[1:])
opened = [(kind, os.open(f"/proc/{process}/ns/{kind}", os.O_RDONLY)) for kind in ("user", "net")]
for kind, handle in opened:
    if os.fstat(handle).st_ino != os.stat(f"/proc/self/ns/{kind}").st_ino and libc.setns(handle, 0):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
listener = socket.create_server(("127.0.0.1", port))
socket.send_fds(socket.socket(fileno=control), [b"."], [listener.fileno()])
"""
"""Binds a socket in the network of a process (setns(2)), and hands it over."""


@contextmanager
def listening(connection: Connection, tell: Callable[[bytes], object]) -> Iterator[dict[str, str]]:
    """Yield the variables by which v2's client finds a run, while a proxy on this machine leads there.

    `tell` is called with what went wrong, which v2's client does not say.
    """
    password = secrets.token_hex(16)
    with socket.create_server((LOOPBACK, 0)) as listener:
        port = listener.getsockname()[1]
        with _serving(listener, connection, password, tell):
            yield variables(password, port)


@contextmanager
def listening_in(
    process: int, connection: Connection, password: str, tell: Callable[[bytes], object]
) -> Iterator[None]:
    """Keep up a proxy in the network of a process, such as a container's, whose `variables` have this password.

    Raises BenchbotError when this user may not enter that network.
    """
    with _listener_in_network_of(process) as listener, _serving(listener, connection, password, tell):
        yield


def variables(password: str, port: int = PORT) -> dict[str, str]:
    """Return the variables that name a proxy."""
    return {"http_proxy": f"http://{USER}:{password}@{LOOPBACK}:{port}"}


@contextmanager
def _serving(
    listener: socket.socket, connection: Connection, password: str, tell: Callable[[bytes], object]
) -> Iterator[None]:
    proxy = _Proxy(listener, connection, password, tell)
    thread = threading.Thread(target=proxy.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    try:
        yield
    finally:
        proxy.shutdown()
        thread.join()


def _listener_in_network_of(process: int) -> socket.socket:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        words = [sys.executable, "-I", "-S", "-c", _LISTEN, str(process), str(PORT), str(theirs.fileno())]
        done = subprocess.run(words, pass_fds=[theirs.fileno()], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise BenchbotError(
                "BenchBot v2's client has no way out of the container.",
                f"Its network cannot be entered: {done.stderr.strip().rpartition(chr(10))[2]}",
                "Run the solution natively: --v2-client --native COMMAND",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            )
        _, (handle,), _, _ = socket.recv_fds(ours, 1, 1)
    return socket.socket(fileno=handle)


class _Proxy(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(
        self, listener: socket.socket, connection: Connection, password: str, tell: Callable[[bytes], object]
    ) -> None:
        super().__init__(listener.getsockname(), _Request, bind_and_activate=False)
        self.socket.close()
        self.socket = listener
        self.connection, self.tell = connection, tell
        self.authorization = f"Basic {b64encode(f'{USER}:{password}'.encode()).decode()}"


class _Request(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: _Proxy

    def setup(self) -> None:
        super().setup()
        connection = self.server.connection
        self._supervisor = Transport(connection.url, connection.socket)

    def finish(self) -> None:
        super().finish()
        self._supervisor.close()

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - as the base class has it
        """Print nothing."""

    def do_GET(self) -> None:
        """Pass a request on, with the token of the run."""
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        target = urlsplit(self.path)
        if not hmac.compare_digest(self.headers.get("Proxy-Authorization") or "", self.server.authorization):
            self._refuse(HTTPStatus.PROXY_AUTHENTICATION_REQUIRED, "It has not the password of this solution.")
        elif target.scheme != "http" or target.hostname not in HOSTS:
            why = f"It leads to the supervisor of BenchBot alone, not to '{target.hostname}': set no_proxy for that."
            self._refuse(HTTPStatus.FORBIDDEN, why)
        else:
            self._pass_on(target.path or "/", body)

    def _pass_on(self, path: str, body: bytes) -> None:
        headers = {"Authorization": f"Bearer {self.server.connection.token}"}
        if body:
            headers["Content-Type"] = self.headers.get("Content-Type") or ""
        try:
            status, content_type, content = self._supervisor.request("GET", path, body, headers)
        except BenchbotError as error:
            self._answer(HTTPStatus.BAD_GATEWAY, "application/json", json.dumps(error.as_dict()).encode())
            return
        self._answer(status, content_type, bytes(content))

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        document = {"title": "The proxy of BenchBot v2's client refused a request.", "why": why, "fix": ""}
        self._answer(status, "application/json", json.dumps(document).encode())

    def _answer(self, status: int, content_type: str, content: bytes) -> None:
        if status >= HTTPStatus.MULTIPLE_CHOICES:
            self.server.tell(f"{urlsplit(self.path).path}: {_in_words(content)}\n".encode())
        self.send_response_only(status)
        self.send_header("Content-Type", content_type)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)


def _in_words(content: bytes) -> str:
    try:
        told: Any = json.loads(content)
        return " ".join(filter(None, (told["title"], told["why"], told["fix"])))
    except (ValueError, KeyError, TypeError):
        return content[:200].decode("utf-8", "replace")
