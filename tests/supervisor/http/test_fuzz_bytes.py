"""Bytes of every kind, over TCP and a unix socket, to a supervisor in its own process: it neither fails nor swells.

Whole requests, halves, many at once and what is no HTTP, by the solution, by the operator's clients and by strangers.
Afterwards the episode can be finished and scored. A few seconds; with BENCHBOT_FUZZ_MINUTES as `test_fuzz`.
"""

import itertools
import json
import os
import re
import secrets
import socket
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from benchbot.api.client import Client
from benchbot.core.request import RunRequest
from benchbot.evaluation.score import evaluate
from benchbot.submission.modes import private_socket
from benchbot.supervisor.backend import Backend
from benchbot.wire import encoding
from benchbot.wire.run_state import Connection
from tests.supervisor.harness import eventually
from tests.supervisor.http.test_fuzz import ACCEPTS, CONTENTS, FUZZ_S, HOSTS, IN_CI, TARGETS

EXAMPLES = 120
PATIENCE_S, QUIET_S = 120.0, 0.05
MOST_MIB = 400
"""The growth of the supervisor that is let pass: a result may have 64 MiB, and takes several times that as objects."""

TOKENS = {"solution": 6, "operator": 1, "stranger": 2}
STATUS = re.compile(rb"^HTTP/1\.1 ([0-9]{3}) ", re.MULTILINE)

ODD_LINES = st.sampled_from(
    [
        b"Content-Length: 0",
        b"Content-Length: -1",
        b"Content-Length: 99999999999999999999",
        b"Content-Length: 5, 5",
        b"Transfer-Encoding: chunked",
        b"Transfer-Encoding: gzip, chunked",
        b"Transfer-Encoding:\tchunked",
        b"Host: evil.example.com",
        b"Host: a\r\nHost: b",
        b"Authorization: Bearer",
        b"Authorization: bearer \xff\xfe",
        b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
        + b"A" * 22
        + b"==",
        b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABkAAQAAP__",
        b"Connection: close",
        b"Expect: 100-continue",
        b"Expect: 200-ok",
        b" folded: line",
        b"No colon",
        b"X-Long: " + b"x" * 70_000,
        b"\x00: \x00",
        b"Range: bytes=0-0",
        b"Cookie: " + b"; ".join(b"a=b" for _ in range(500)),
    ]
)


@dataclass(frozen=True)
class Message:
    """A request in bytes, before the token is put in; and what a client does with it."""

    target: tuple[str, str]
    content: tuple[bytes, str]
    who: str
    accept: str
    host: str
    arena: str
    more: list[bytes]
    version: str
    chunked: bool

    def encoded(self, tokens: dict[str, str]) -> bytes:
        """Return the request as a client would send it that does not know better."""
        body, content_type = self.content
        lines = [
            f"{self.target[0]} {self.target[1]} {self.version}",
            f"Host: {self.host}",
            f"Content-Type: {content_type}",
            f"Accept: {self.accept}",
            f"Authorization: Bearer {tokens[self.who]}",
            *([f"{encoding.ARENA_HEADER}: {tokens.get(self.arena, self.arena)}"] if self.arena else []),
            "Transfer-Encoding: chunked" if self.chunked else f"Content-Length: {len(body)}",
        ]
        head = b"\r\n".join([*(line.encode("latin-1") for line in lines), *self.more])
        return head + b"\r\n\r\n" + (b"%x\r\n%s\r\n0\r\n\r\n" % (len(body), body) if self.chunked else body)


MESSAGES = st.builds(
    Message,
    target=TARGETS,
    content=CONTENTS,
    who=st.sampled_from([who for who, weight in TOKENS.items() for _ in range(weight)]),
    accept=ACCEPTS,
    host=HOSTS,
    arena=st.sampled_from(["", "", "none", "nonce", "00" * 16, "\xe9"]),
    more=st.just([]) | st.lists(ODD_LINES, max_size=2),
    version=st.sampled_from(["HTTP/1.1"] * 6 + ["HTTP/1.0", "HTTP/9.9", "http/1.1", ""]),
    chunked=st.booleans(),
)

PLACE = st.floats(0, 1, exclude_max=True)
# Where, how much of what is there is left out, and what is put in instead.
EDITS = st.lists(
    st.tuples(PLACE, st.integers(0, 8), st.binary(max_size=8) | st.sampled_from([b"\r\n", b"\r\n\r\n", b"\n", b"\0"])),
    max_size=3,
)


@dataclass(frozen=True)
class Sending:
    """Messages on one connection, edited, and cut off before the end or not; `listens` is whether answers are read."""

    messages: list[Message]
    edits: list[tuple[float, int, bytes]]
    kept: float
    listens: bool

    def encoded(self, tokens: dict[str, str]) -> bytes:
        sent = b"".join(message.encoded(tokens) for message in self.messages)
        for place, left_out, put_in in self.edits:
            at = int(place * len(sent))
            sent = sent[:at] + put_in + sent[at + left_out :]
        return sent[: round(self.kept * len(sent))]


SENDINGS = st.builds(
    Sending,
    messages=st.lists(MESSAGES, min_size=1, max_size=4),
    edits=st.just([]) | EDITS,
    kept=st.just(1.0) | PLACE,
    listens=st.sampled_from([True, True, True, False]),
)


@dataclass
class Target:
    """A supervisor in a process of its own, by one of its addresses; what is counted of it."""

    backend: Backend
    connection: Connection
    held: list[socket.socket] = field(default_factory=list)
    statuses: Counter[str] = field(default_factory=Counter)

    def connect(self) -> socket.socket:
        if self.connection.socket is not None:
            client = socket.socket(socket.AF_UNIX)
            client.settimeout(None)
            client.connect(self.connection.socket)
            client.settimeout(PATIENCE_S)
            return client
        address = urlsplit(str(self.connection.url))
        return socket.create_connection((str(address.hostname), int(address.port or 80)), PATIENCE_S)

    def usage(self) -> tuple[int, int, int]:
        """Return the resident MiB of the supervisor, its open files and its threads."""
        folder = Path(f"/proc/{self.backend.pid}")
        pages = int((folder / "statm").read_text().split()[1])
        files, threads = (len(list((folder / name).iterdir())) for name in ("fd", "task"))
        return pages * os.sysconf("SC_PAGE_SIZE") // 2**20, files, threads

    def send(self, sending: Sending, tokens: dict[str, str]) -> bytes:
        """Send it all; return what is answered until the supervisor hangs up, which it does once told no more comes."""
        connection = self.connect()
        if not sending.listens:
            # Most stay open, without a word and without being read, until there are too many.
            self.held.append(connection)
            with suppress(OSError):
                connection.sendall(sending.encoded(tokens), socket.MSG_DONTWAIT)
            return b""
        answer = b""
        with connection, suppress(ConnectionError):
            connection.sendall(sending.encoded(tokens))
            connection.settimeout(QUIET_S)
            with suppress(TimeoutError):
                while chunk := connection.recv(2**16):
                    answer += chunk
            # Not earlier: who hangs up is not answered any more.
            connection.settimeout(PATIENCE_S)
            connection.shutdown(socket.SHUT_WR)
            while chunk := connection.recv(2**16):
                answer += chunk
        return answer


@pytest.fixture(params=["tcp", "unix"])
def target(request: pytest.FixtureRequest) -> Iterator[Target]:
    with (
        private_socket() as path,
        Backend.start(RunRequest("sample:active", "sample_robot", "arena:1"), port=0, unix_socket=path) as backend,
    ):
        whole = backend.state.connection
        yield Target(backend, replace(whole, url=None) if request.param == "unix" else replace(whole, socket=None))


def test_nothing_that_is_sent_makes_it_fail(target: Target) -> None:
    tokens = {"solution": target.connection.token, "operator": target.backend.state.operator_token, "stranger": "?"}
    with closing(Client(target.connection)) as client:
        client.reset()
        tokens["nonce"] = client._memory.nonce if client._memory else "none"
    before = target.usage()

    @settings(
        max_examples=EXAMPLES,
        deadline=None,
        database=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )
    @given(SENDINGS)
    def fuzz(sending: Sending) -> None:
        answer = target.send(sending, tokens)
        found = [status.decode() for status in STATUS.findall(answer)]
        target.statuses.update(found or ["none"])
        assert not [status for status in found if status >= "500"], (sending.encoded(tokens)[:2000], answer[:2000])

    until_s, peak = time.monotonic() + FUZZ_S / 4, before
    for number in itertools.count(0 if IN_CI else secrets.randbits(64)):
        seed(number)(fuzz)()
        now = target.usage()
        peak = max(peak[0], now[0]), max(peak[1], now[1]), max(peak[2], now[2])
        if time.monotonic() >= until_s:
            break
    for connection in target.held:
        connection.close()

    finished_and_scored(target.connection)
    assert eventually(lambda: target.usage()[1] <= before[1] + 2), "open files"
    after = target.usage()
    assert after[0] < before[0] + MOST_MIB
    sent = f"{target.statuses.total()} answers: {dict(sorted(target.statuses.items()))}; {len(target.held)} not read"
    print(f"\n{sent}\nMiB, open files, threads: {before} before, {peak} at most, {after} after")


def finished_and_scored(connection: Connection) -> None:
    """Go through an episode as if nothing had happened, and score its result."""
    with closing(Client(connection)) as client:
        client.reset()
        assert client.step("move_angle", {"angle": 10.0})["outcome"] == "reached"
        results = client.results_function("create")
        path = Path(client.result({"results": results})["path"])
    result: dict[str, Any] = json.loads(path.read_text("utf-8"))
    assert result["provenance"]["failure"] is None
    assert (result["provenance"]["steps"], result["provenance"]["frames"]) == (1, 2)
    truth = {"environment": {"name": "arena", "variant": 1}, "ground_truth": {"class_list": ["chair"], "objects": []}}
    assert evaluate(result, [truth])["scores"] is not None
