"""Requests of every kind at every route: the supervisor neither fails nor leaks nor hangs.

A few seconds; a minute in CI, with `test_fuzz_bytes`. BENCHBOT_FUZZ_MINUTES=10 goes on for ten minutes:
BENCHBOT_FUZZ_MINUTES=10 pytest -n 0 -s tests/supervisor/http/test_fuzz.py tests/supervisor/http/test_fuzz_bytes.py
"""

import http.client
import itertools
import json
import os
import secrets
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx
import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from benchbot.wire import encoding
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, eventually, sample_selection

Serve = Callable[..., Served]

IN_CI = bool(os.environ.get("CI"))
FUZZ_S = 60 * float(os.environ.get("BENCHBOT_FUZZ_MINUTES", "1" if IN_CI else "0"))
EXAMPLES = 500
JSON, MSGPACK = "application/json", "application/msgpack"

V1 = ["health", "session", "reset", "step", "next_scene", "result", "operator", "results_functions/create"]
V1_PATHS = [f"/api/v1/{route}" for route in V1] + ["/api/v1/results_functions/create_object"]
V2_PATHS = [
    "/",
    "//",
    "/config",
    "/config/",
    "/config/task/actions",
    "/config/robot/connections",
    "/connections/image_rgb",
    "/connections/poses",
    "/connections/move_distance",
    "/connections/move_angle",
    "/results_functions//",
    "/results_functions//create",
    "/results_functions/create_object",
    "/results_functions/validate",
    "/robot/",
    *(f"/robot/{name}" for name in ("is_collided", "is_dirty", "is_finished", "is_running", "selected_environment")),
    *(f"/robot/{name}" for name in ("next", "prepare", "reset", "restart", "start", "stop", "config", "configure")),
]

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=6)
    | st.sampled_from(["move_next", "move_distance", "distance", "objects", "py/object", 10**9, 1e308, -1])
)
VALUES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner), max_leaves=8
)
# What the routes read, filled with what they do not.
BODIES = (
    st.just({})
    | VALUES
    | st.fixed_dictionaries({}, optional={"action": VALUES, "arguments": VALUES})
    | st.fixed_dictionaries({"action": st.just("move_angle"), "arguments": st.just({"angle": 1.0})})
    | st.fixed_dictionaries({}, optional={"args": VALUES, "kwargs": VALUES})
    | st.fixed_dictionaries(
        {"args": st.lists(VALUES, max_size=2)}, optional={"kwargs": st.just({"num_classes": 2**40})}
    )
    | st.fixed_dictionaries({}, optional={"result": VALUES, "solution": VALUES, "failure": VALUES, "done": VALUES})
    | st.fixed_dictionaries({"result": st.fixed_dictionaries({"results": VALUES})})
    | st.fixed_dictionaries(
        {}, optional={"distance": st.floats(-0.2, 0.2) | VALUES, "angle": st.floats(-5, 5) | VALUES}
    )
)


def _encoded(value: Any) -> tuple[bytes, str]:
    return json.dumps(value).encode(), JSON


def _packed(value: Any) -> tuple[bytes, str]:
    return encoding.encode(value), MSGPACK


CONTENTS = (
    BODIES.map(_encoded)
    | BODIES.map(_packed)
    | st.tuples(BODIES.map(lambda value: _encoded(value)[0]), st.integers(0, 40)).map(
        lambda cut: (cut[0][: cut[1]], JSON)
    )
    | st.tuples(st.binary(max_size=60), st.sampled_from([JSON, MSGPACK, "text/plain", "", "application/json; x=\xe9"]))
    | st.sampled_from([(b"[" * 100_000, JSON), (b"\x91" * 100_000, MSGPACK), (b"9" * 10_000, JSON), (b"", JSON)])
)
PATHS = st.sampled_from(V1_PATHS + V2_PATHS) | st.text(max_size=12).map(
    lambda text: "/" + quote(text.encode("utf-8", "replace"), safe="/")
)
METHODS = st.sampled_from(["GET", "POST", "HEAD", "PUT", "DELETE", "OPTIONS", "BREW"])
TARGETS = st.one_of(
    *[st.sampled_from([("GET" if path[8:] in ("health", "session") else "POST", path) for path in V1_PATHS])] * 3,
    *[st.sampled_from([("GET", path) for path in V2_PATHS])] * 3,
    st.tuples(METHODS, PATHS),
)
TOKENS = st.sampled_from([TOKEN] * 9 + ["", "wrong", OPERATOR_TOKEN, "t\xf6ken"])
ACCEPTS = st.sampled_from(["*/*", "*/*", MSGPACK, JSON, "text/html", ""])
HOSTS = st.sampled_from(["localhost"] * 12 + ["benchbot_supervisor:1", "example.org", "[", "", "\xe9"])


@dataclass(frozen=True)
class Fuzzed:
    """A request, as it is sent."""

    target: tuple[str, str]
    content: tuple[bytes, str]
    token: str
    accept: str
    host: str
    arena: str
    in_one_piece: bool

    def send(self, connection: socket.socket) -> tuple[int, bytes, bool]:
        """Return status and content of the answer, and whether the connection is good for another request."""
        body, content_type = self.content
        method, path = self.target
        headers = {
            "Host": self.host,
            "Content-Type": content_type,
            "Accept": self.accept,
            "Authorization": f"Bearer {self.token}",
            "Content-Length": str(len(body)),
            **({encoding.ARENA_HEADER: self.arena} if self.arena else {}),
        }
        lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items()), "", ""]
        head = "\r\n".join(lines).encode("latin-1")
        # What comes in one piece may go the express way.
        for piece in [head + body] if self.in_one_piece else [head, body]:
            connection.sendall(piece)
        response = http.client.HTTPResponse(connection, method=method)
        response.begin()
        return response.status, response.read(), not response.will_close


REQUESTS = st.builds(
    Fuzzed,
    target=TARGETS,
    content=CONTENTS,
    token=TOKENS,
    accept=ACCEPTS,
    host=HOSTS,
    arena=st.sampled_from(["", "", "none", "00" * 16, "\xe9"]),
    in_one_piece=st.booleans(),
)


class Caller:
    """A client that connects anew when the supervisor has hung up, as it does on what is no HTTP."""

    def __init__(self, served: Served) -> None:
        address = httpx.URL(served.url)
        self._address = address.host, address.port or 80
        self._connection: socket.socket | None = None

    def send(self, request: Fuzzed) -> tuple[int, bytes]:
        try:
            return self._send(request)
        except (http.client.HTTPException, ConnectionError):
            self.close()
            return self._send(request)

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _send(self, request: Fuzzed) -> tuple[int, bytes]:
        if self._connection is None:
            self._connection = socket.create_connection(self._address, timeout=120)
            # Or the second piece of a request waits for the first to be acknowledged, for 40 ms.
            self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        status, content, is_kept = request.send(self._connection)
        if not is_kept:
            self.close()
        return status, content


def _handles() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _alive(served: Served) -> None:
    """Check that the supervisor serves a whole session as if nothing had happened."""
    with served.http() as http:
        assert http.post("/api/v1/reset").status_code == 200
        assert http.post("/api/v1/step", json={"action": "move_angle", "arguments": {"angle": 1.0}}).status_code == 200
        assert http.request("GET", "/connections/laser", json={}).status_code == 200


@pytest.fixture(params=[False, True], ids=["with_token", "open_to_v2"])
def fuzzed(serve: Serve, request: pytest.FixtureRequest) -> Iterator[Served]:
    """A run that is checked afterwards: it still serves, and has kept nothing of what was done to it."""
    served = serve(sample_selection("sample:active"), open_to_v2=request.param)
    _alive(served)
    before = _handles(), threading.active_count(), _resident_bytes()
    yield served
    _alive(served)
    # Worker threads of the server stay, up to its cap of 40 and asyncio's of 32.
    assert eventually(lambda: _handles() <= before[0] + 2)
    assert eventually(lambda: threading.active_count() <= before[1] + 80)
    assert _resident_bytes() < before[2] + 400 * 2**20
    assert len(served.hosts) == 1
    after = _handles(), threading.active_count(), _resident_bytes()
    print(f"\nfile handles, threads, resident bytes: {before} before, {after} after")


def test_no_request_makes_the_supervisor_fail(fuzzed: Served) -> None:
    caller = Caller(fuzzed)
    statuses: Counter[int] = Counter()

    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )
    @given(REQUESTS)
    def fuzz(request: Fuzzed) -> None:
        status, content = caller.send(request)
        statuses[status] += 1
        assert status < 500, (request, content)
        if status >= 400 and content and content[:1] == b"{":
            assert {"title", "why", "fix"} <= set(json.loads(content))

    with closing(caller):
        until_s = time.monotonic() + FUZZ_S / 4
        for number in itertools.count(0 if IN_CI else secrets.randbits(64)):
            # In CI, too, each round looks at examples of its own.
            seed(number)(fuzz)()
            if time.monotonic() >= until_s:
                break
    print(f"\n{statuses.total()} requests, answered with {dict(sorted(statuses.items()))}")


def test_many_at_once_are_served(fuzzed: Served) -> None:
    there = threading.Barrier(100)

    def ask(number: int) -> int:
        path = V2_PATHS[number % len(V2_PATHS)]
        connection = http.client.HTTPConnection(fuzzed.url.partition("//")[2], timeout=120)
        with closing(connection):
            there.wait(60)
            headers = {"Content-Type": JSON, "Authorization": f"Bearer {TOKEN}"}
            connection.request("GET", path, b"{}", headers)
            response = connection.getresponse()
            response.read()
            return response.status

    with ThreadPoolExecutor(100) as executor:
        statuses = set(executor.map(ask, range(100)))
    assert statuses <= {200, 400, 404}


def test_slow_clients_keep_nobody_waiting(fuzzed: Served) -> None:
    address = httpx.URL(fuzzed.url)
    beginnings = [
        b"",
        b"GE",
        b"GET /connections/laser HTTP/1.1\r\nHost: localhost\r\n",
        b"GET /connections/laser HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        b"Authorization: Bearer %s\r\nContent-Length: 1000\r\n\r\n{" % TOKEN.encode(),
        b"POST /api/v1/step HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        b"Authorization: Bearer %s\r\nTransfer-Encoding: chunked\r\n\r\n1\r\n{\r\n" % TOKEN.encode(),
    ]
    slow = []
    try:
        for number in range(100):
            slow.append(socket.create_connection((address.host, address.port or 80)))
            slow[-1].sendall(beginnings[number % len(beginnings)])
        _alive(fuzzed)
    finally:
        for connection in slow:
            connection.close()


@pytest.mark.parametrize("path", ["/config/task", "/connections/laser", "/robot/reset", "/results_functions/validate"])
@pytest.mark.parametrize("chunked", [False, True])
def test_a_huge_body_is_refused_before_it_is_read_whole(serve: Serve, path: str, *, chunked: bool) -> None:
    served = serve(open_to_v2=True)
    address = httpx.URL(served.url)
    length = b"Transfer-Encoding: chunked" if chunked else b"Content-Length: 100000000000"
    chunk = b"%x\r\n%s\r\n" % (2**20, b" " * 2**20)
    with socket.create_connection((address.host, address.port or 80), timeout=60) as connection:
        connection.sendall(
            b"GET %s HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n%s\r\n\r\n"
            % (path.encode(), length)
        )
        try:
            for _ in range(70 if chunked else 0):
                connection.sendall(chunk)
        except ConnectionError:
            pass
        response = http.client.HTTPResponse(connection)
        response.begin()
        assert response.status == 413
    assert not served.hosts
