"""HTTP/1.1 to a supervisor on loopback or a unix socket, over one connection that is kept open.

A request is sent in one piece. An answer with a Content-Length, as the supervisor's, is parsed here, which is faster;
every other one is left to `http.client`, which knows all of HTTP.
"""

import re
import select
import socket
import struct
from collections.abc import Mapping
from urllib.parse import urlsplit

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass

CONNECT_TIMEOUT_S = 10.0
PEEKED_BYTES = 4096
_PLAIN_ANSWER = re.compile(rb"HTTP/1\.1 ([2-5][0-9]{2}) ")
_NOT_IN_A_HEADER = re.compile("[\r\n\0]")


class Transport:
    """One connection, opened at the first request. A request is never sent twice: an action must not happen twice."""

    def __init__(self, url: str | None, socket_path: str | None, answer_timeout_s: float | None = None) -> None:
        self._where = socket_path or url or ""
        self._address = None if socket_path is not None else _host_and_port(self._where)
        self._host = "localhost" if self._address is None else _authority(*self._address)
        # Usually none: an action may take as long as it takes, and the supervisor itself ends what hangs.
        self._answer_timeout_s = answer_timeout_s
        self._socket: socket.socket | None = None
        self._peeked = bytearray(PEEKED_BYTES)

    def request(
        self, method: str, path: str, body: bytes, headers: Mapping[str, str]
    ) -> tuple[int, str, bytearray | bytes]:
        """Return status, content type and body of the answer; raises BenchbotError when the supervisor is gone."""
        message = self._message(method, path, body, headers)
        try:
            connection = self._connected()
            connection.sendall(message)
            status, told, content = self._answer(connection, method)
        except OSError as error:
            self.close()
            raise self._gone(error) from error
        except BaseException:
            # Interrupted between request and answer: the next answer on this connection would be the wrong one.
            self.close()
            raise
        if told.get("connection", "").lower() == "close":
            self.close()
        return status, told.get("content-type", "").partition(";")[0].strip().lower(), content

    def close(self) -> None:
        """Close the connection; the next request opens another."""
        connection, self._socket = self._socket, None
        if connection is not None:
            connection.close()

    def _message(self, method: str, path: str, body: bytes, headers: Mapping[str, str]) -> bytes:
        told = {"Host": self._host, **headers}
        if body or method != "GET":
            told["Content-Length"] = str(len(body))
        if any(_NOT_IN_A_HEADER.search(value) for value in told.values()):
            raise BenchbotError(
                "A header of the request holds a line break.",
                "The token, or the name of the host, is not on one line.",
                "Mend BENCHBOT_TOKEN or BENCHBOT_URL.",
            )
        lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in told.items()), "\r\n"]
        return "\r\n".join(lines).encode("utf-8") + body

    def _connected(self) -> socket.socket:
        if self._socket is not None and _is_over(self._socket):
            # It was closed while nothing was under way, as by a supervisor that has too many: nothing has been sent.
            self.close()
        if self._socket is None:
            if self._address is None:
                self._socket = connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
                _connect_when_there_is_room(connection, self._where)
            else:
                self._socket = connection = socket.create_connection(self._address, CONNECT_TIMEOUT_S)
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.settimeout(self._answer_timeout_s)
        return self._socket

    def _answer(self, connection: socket.socket, method: str) -> tuple[int, Mapping[str, str], bytearray | bytes]:
        """Return status, headers by their names in lower case, and body."""
        count = connection.recv_into(self._peeked, 0, socket.MSG_PEEK)
        head_end = self._peeked.find(b"\r\n\r\n", 0, count) + 4
        plain = _PLAIN_ANSWER.match(self._peeked)
        if head_end < 4 or plain is None:
            return _any_answer(connection, method)
        told: dict[str, str] = {}
        for line in self._peeked[: head_end - 4].decode("latin-1").split("\r\n")[1:]:
            name, _, value = line.partition(":")
            told[name.strip().lower()] = value.strip()
        length = told.get("content-length", "")
        if not length.isdecimal() or "transfer-encoding" in told or plain[1] in (b"204", b"304"):
            return _any_answer(connection, method)
        _fill(connection, memoryview(self._peeked)[:head_end])
        # The arrays will be views of this memory.
        content = bytearray(int(length))
        _fill(connection, memoryview(content))
        return int(plain[1]), told, content

    def _gone(self, error: Exception) -> BenchbotError:
        return BenchbotError(
            "The BenchBot supervisor is gone.",
            f"The connection to {self._where} failed: {error or type(error).__name__}.",
            "Look at the terminal of 'benchbot run' for what happened, start it again, and run the solution again.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        )


def _any_answer(connection: socket.socket, method: str) -> tuple[int, Mapping[str, str], bytes]:
    # It takes as long to import as all else in the client, which every episode of a batch imports anew.
    import http.client

    response = http.client.HTTPResponse(connection, method=method)
    try:
        response.begin()
        content = response.read()
    except http.client.HTTPException as error:
        raise ConnectionError(f"{error or type(error).__name__}") from error
    told = {name.lower(): value for name, value in response.getheaders()}
    return response.status, {**told, **({"connection": "close"} if response.will_close else {})}, content


def _is_over(connection: socket.socket) -> bool:
    """Say whether a connection on which nothing is awaited has been closed by the other end, or brings what is not."""
    poll = select.poll()
    poll.register(connection, select.POLLIN)
    return bool(poll.poll(0))


def _connect_when_there_is_room(connection: socket.socket, path: str) -> None:
    """Connect to a unix socket; wait while others want to, too, as a socket with a time-out of Python's would not."""
    seconds = struct.pack("ll", int(CONNECT_TIMEOUT_S), 0)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, seconds)
    connection.connect(path)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, bytes(len(seconds)))


def _fill(connection: socket.socket, view: memoryview) -> None:
    while view:
        count = connection.recv_into(view)
        if count == 0:
            raise ConnectionError(f"the answer ends {len(view)} bytes too early")
        view = view[count:]


def _host_and_port(url: str) -> tuple[str, int]:
    parts = urlsplit(url if "//" in url else f"//{url}")
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if host is None or parts.scheme not in ("", "http"):
        raise BenchbotError(
            f"'{url}' is not the address of a supervisor.",
            "An address is written like this: http://127.0.0.1:10000",
            "Mend BENCHBOT_URL or the argument supervisor_address.",
        )
    return host, port or 10000


def _authority(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
