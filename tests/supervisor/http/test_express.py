"""What may be read at once, and what is left to the HTTP server: everything that is not plainly right."""

from collections.abc import Callable
from pathlib import Path

import h11
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core.host import Host
from benchbot.supervisor.http.express import Reader, read_head
from benchbot.supervisor.run import Run
from benchbot.wire import encoding
from tests.supervisor.harness import TOKEN, sample_selection

AUTHORIZATION = f"Authorization: Bearer {TOKEN}"
BODY = encoding.encode({"action": "move_next"})
USUAL = ["Host: x", AUTHORIZATION, "Content-Type: application/msgpack", f"Content-Length: {len(BODY)}"]


def head(*lines: str, start: str = "POST /api/v1/step HTTP/1.1") -> bytes:
    return "\r\n".join([start, *lines, "", ""]).encode("latin-1")


@pytest.fixture
def read(tmp_path: Path) -> Callable[[bytes], object]:
    def never() -> Host:
        raise AssertionError("reading a request starts nothing")

    return Reader(Run(sample_selection(), never, tmp_path / "result.json"), TOKEN).read


def test_the_head_of_a_step_is_read() -> None:
    told = read_head(
        head(*USUAL, "Accept: application/msgpack", "X-BenchBot-Arena: none", "connection: Keep-Alive"), TOKEN
    )
    assert told is not None
    assert (told.route, told.content_type, told.content_length) == ("step", "application/msgpack", len(BODY))
    assert told.opened == "none"


def test_an_empty_body_needs_no_headers() -> None:
    told = read_head(head("Host: x", AUTHORIZATION, start="POST /api/v1/reset HTTP/1.1"), TOKEN)
    assert told is not None
    assert (told.route, told.content_length, told.opened) == ("reset", 0, None)


@pytest.mark.parametrize(
    "start",
    [
        "GET /api/v1/step HTTP/1.1",
        "POST /api/v1/result HTTP/1.1",
        "POST /api/v1//step HTTP/1.1",
        "POST /api/v1/step?x HTTP/1.1",
        "POST /api/v1/step HTTP/1.0",
        "POST http://x/api/v1/step HTTP/1.1",
        " POST /api/v1/step HTTP/1.1",
    ],
)
def test_other_requests_are_for_the_http_server(start: str) -> None:
    assert read_head(head(*USUAL, start=start), TOKEN) is None


@pytest.mark.parametrize(
    "lines",
    [
        USUAL[1:],
        ["Host: x", *USUAL],
        ["Host: x"],
        ["Host: x", "Authorization: Bearer wrong"],
        ["Host: x", f"Authorization: bearer {TOKEN}"],
        [*USUAL, "Transfer-Encoding: chunked"],
        [*USUAL, "Expect: 100-continue"],
        [*USUAL, "Connection: close"],
        [*USUAL, "Connection: upgrade"],
        [*USUAL, "Upgrade: websocket"],
        [*USUAL, "Accept: application/json"],
        [*USUAL, "Accept : */*"],
        [*USUAL, " folded"],
        [*USUAL, "Accept: */*\n"],
        [*USUAL, "Accept: caf\xe9"],
        [*USUAL, "no colon"],
        [*USUAL[:3], "Content-Length: -1"],
        [*USUAL[:3], "Content-Length: 1e3"],
        [*USUAL[:3], "Content-Length: +12"],
        [*USUAL[:3], "Content-Length: 65537"],
        [*USUAL[:3], "Content-Length: " + "9" * 5000],
    ],
)
def test_an_unusual_head_is_for_the_http_server(lines: list[str]) -> None:
    assert read_head(head(*lines), TOKEN) is None


@pytest.mark.parametrize(
    ("length", "body"),
    [
        (len(BODY), BODY[:-1]),
        (len(BODY), BODY + b"\0"),
        (1, b"\xc1"),
        (1, encoding.encode(3)),
        (2, b"{}"),
        (len(encoding.encode({"acton": 1})), encoding.encode({"acton": 1})),
    ],
)
def test_a_body_that_is_not_right_is_for_the_http_server(
    read: Callable[[bytes], object], length: int, body: bytes
) -> None:
    told = head(*USUAL[:3], f"Content-Length: {length}")
    assert read(told + body) is None
    assert read(head(*USUAL) + BODY) is not None


def test_a_head_that_was_right_lets_no_other_in(read: Callable[[bytes], object]) -> None:
    right = head(*USUAL)
    assert read(right + BODY) is not None
    assert read(right + BODY) is not None
    assert read(right.replace(TOKEN.encode(), TOKEN.encode()[:-1] + b"x") + BODY) is None
    assert read(right.replace(b"Host: x\r\n", b"") + BODY) is None
    assert read(right + BODY) is not None


NAMES = [
    "Host",
    "Authorization",
    "Content-Type",
    "Content-Length",
    "Accept",
    "Connection",
    "X-BenchBot-Arena",
    "Cookie",
]
VALUES = st.sampled_from(["x", f"Bearer {TOKEN}", "application/msgpack", "0", "14", "keep-alive", "*/*", "none", ""])
LINES = st.lists(st.sampled_from(NAMES).flatmap(lambda name: VALUES.map(lambda value: f"{name}: {value}")), max_size=4)
EDITS = st.lists(st.tuples(st.integers(0, 400), st.integers(0, 2), st.binary(max_size=3)), max_size=3)


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(LINES, st.booleans(), EDITS)
def test_what_is_read_at_once_means_the_same_to_an_http_server(
    lines: list[str], has_the_usual: bool, edits: list[tuple[int, int, bytes]]
) -> None:
    """Any head that is taken is one that h11 reads as the same request, with nothing left over."""
    told = head(*(USUAL if has_the_usual else []), *lines)
    for place, removed, inserted in edits:
        told = told[:place] + inserted + told[place + removed :]
    taken = read_head(told, TOKEN)
    if taken is None:
        return
    server = h11.Connection(h11.SERVER)
    server.receive_data(told + b"\0" * taken.content_length)
    request = server.next_event()
    assert isinstance(request, h11.Request)
    assert (request.method, request.target) == (b"POST", f"/api/v1/{taken.route}".encode())
    assert dict(request.headers)[b"authorization"] == f"Bearer {TOKEN}".encode()
    if taken.content_length:
        data = server.next_event()
        assert isinstance(data, h11.Data)
        assert len(data.data) == taken.content_length
    assert isinstance(server.next_event(), h11.EndOfMessage)
    assert server.trailing_data == (b"", False)
    assert server.their_state is h11.DONE
