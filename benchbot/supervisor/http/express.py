"""Requests that use the robot, read from the bytes of a connection at once and answered in a thread.

Only what is plainly right is read here: a whole request in one piece, with the token and with the usual headers. All
else, and so every refusal of a head or a body, is left to the HTTP server, which takes a millisecond longer.
"""

import hmac
import re
from collections.abc import Callable
from dataclasses import dataclass

from starlette.responses import Response

from benchbot.core.errors import BenchbotError
from benchbot.supervisor.http import bodies, observing
from benchbot.supervisor.run import Caller, Run
from benchbot.wire import encoding

MAX_HEAD_BYTES = 4096
MAX_BODY_BYTES = 65536
_START = re.compile(rb"POST /api/v1/(reset|step|next_scene) HTTP/1\.1\r\n")
_HEADERS = re.compile(rb"(?:[A-Za-z-]+:[\t\x20-\x7e]*\r\n)+\r\n")
_ARENA = encoding.ARENA_HEADER.lower()
# Others may change what a request means: where it ends, or what becomes of the connection.
_HARMLESS = {
    "accept",
    "accept-encoding",
    "authorization",
    "content-length",
    "content-type",
    "host",
    "user-agent",
    _ARENA,
}


@dataclass(frozen=True)
class Express:
    """A request that has been read and found right.

    `answer` blocks, `hang_up` says that nobody waits for it, and `settle` does what its answer does not wait for.
    """

    answer: Callable[[Caller], Response]
    hang_up: Callable[[Caller], None]
    settle: Callable[[], None]


@dataclass(frozen=True)
class Head:
    """What comes before the body of a request that is plainly right."""

    route: str
    content_type: str
    content_length: int
    opened: str | None


class Reader:
    """Reads the requests of one run. A client sends the same head again and again: the last one is remembered."""

    def __init__(self, run: Run, token: str) -> None:
        self._run = run
        self._token = token
        self._last: tuple[bytes, Head] = b"", Head("", "", 0, None)

    def read(self, data: bytes) -> Express | None:
        """Return the one whole request that the bytes are, or None when it is not here that it is to be answered."""
        end = data.find(b"\r\n\r\n", 0, MAX_HEAD_BYTES) + 4
        if end < 4:
            return None
        told = data[:end]
        last, head = self._last
        # A head holds the token: how long the comparison takes must not tell how much of it is right.
        if not hmac.compare_digest(told, last):
            new = read_head(told, self._token)
            if new is None:
                return None
            head = new
            self._last = told, head
        body = data[end:]
        if len(body) != head.content_length:
            return None
        try:
            path = f"/api/v1/{head.route}"
            request = bodies.decoded(body, head.content_type, observing.BODIES[head.route], path)
        except BenchbotError:
            return None

        def answer(caller: Caller) -> Response:
            try:
                return bodies.encoded(observing.answer(self._run, head.route, request, head.opened, caller))
            except BenchbotError as error:
                return bodies.respond_error(error)

        return Express(answer, self._run.hang_up, self._run.settle)


def read_head(told: bytes, token: str) -> Head | None:
    """Return what the bytes up to the body say, or None when anything about them is unusual, or not right."""
    start = _START.match(told)
    if start is None or _HEADERS.fullmatch(told, start.end()) is None:
        return None
    headers: dict[str, str] = {}
    for line in told[start.end() : -4].decode("ascii").split("\r\n"):
        name, _, value = line.partition(":")
        name, value = name.lower(), value.strip(" \t")
        if name in headers or not (name in _HARMLESS or (name == "connection" and value.lower() == "keep-alive")):
            return None
        headers[name] = value
    length = headers.get("content-length", "0")
    if "host" not in headers or not length.isdecimal() or len(length) > 9 or int(length) > MAX_BODY_BYTES:
        return None
    if not hmac.compare_digest(headers.get("authorization", ""), f"Bearer {token}"):
        return None
    if not bodies.accepted(headers.get("accept", "*/*"), bodies.MSGPACK):
        return None
    content_type = bodies.media_type(headers.get("content-type", ""))
    return Head(start[1].decode("ascii"), content_type, int(length), headers.get(_ARENA))
