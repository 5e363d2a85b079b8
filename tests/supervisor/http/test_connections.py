"""Clients that begin and do not go on, that are too many, or whose requests can be read in more ways than one."""

import http.client
import json
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.requests import Request

from benchbot.supervisor.http import access, bodies, connections
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, eventually

Serve = Callable[..., Served]

HEAD = b"POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer wrong\r\n"
WHOLE = HEAD + b"Content-Length: 0\r\n\r\n"


@contextmanager
def connected(served: Served, *messages: bytes) -> Iterator[socket.socket]:
    address = httpx.URL(served.url)
    with socket.create_connection((address.host, address.port or 80), timeout=60) as connection:
        for message in messages:
            connection.sendall(message)
        yield connection


def answered(connection: socket.socket) -> tuple[int, dict[str, Any], bool]:
    """Return the status and the error of an answer, and whether the server closes the connection after it."""
    response = http.client.HTTPResponse(connection)
    response.begin()
    return response.status, json.loads(response.read()), response.will_close


def is_closed(connection: socket.socket) -> bool:
    """Wait until the server has closed a connection that is sent nothing."""
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


@pytest.mark.parametrize("beginning", [b"", b"PO", HEAD])
def test_who_does_not_send_the_rest_of_a_head_is_disconnected(
    serve: Serve, monkeypatch: pytest.MonkeyPatch, beginning: bytes
) -> None:
    monkeypatch.setattr(connections, "HEAD_DEADLINE_S", 0.2)
    with connected(serve(), beginning) as connection:
        assert is_closed(connection)


def test_so_is_who_does_not_in_a_later_request(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "HEAD_DEADLINE_S", 0.2)
    with connected(serve(), WHOLE) as connection:
        assert answered(connection)[0] == 401
        connection.sendall(HEAD)
        assert is_closed(connection)


def test_a_client_may_think_after_an_answer_for_as_long_as_it_likes(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "HEAD_DEADLINE_S", 0.2)
    served = serve()
    with connected(served, WHOLE) as thinking, connected(served) as silent:
        answered(thinking)
        assert is_closed(silent)  # a deadline later
        thinking.sendall(WHOLE)
        assert answered(thinking)[0] == 401


def test_a_body_that_does_not_come_is_an_error(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bodies, "BODY_DEADLINE_S", 0.2)
    head = HEAD.replace(b"wrong", TOKEN.encode()) + b"Content-Length: 10\r\n\r\n{"
    with connected(serve(), head) as connection:
        status, error, closes = answered(connection)
    assert (status, error["title"], closes) == (408, "The request's body did not come.", True)


def test_requests_that_never_end_keep_nobody_out(serve: Serve) -> None:
    served = serve()
    with ExitStack() as stack:
        held = [stack.enter_context(connected(served, HEAD)) for _ in range(2 * connections.MOST_CONNECTIONS)]
        with connected(served, WHOLE) as connection:
            assert answered(connection)[0] == 401
        # Those that have been silent for the longest had to make room.
        assert is_closed(held[0])


def test_as_many_are_closed_as_are_too_many_also_when_they_come_at_once(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 8)
    served = serve()
    before = open_sockets()
    with ExitStack() as stack:
        held = [stack.enter_context(connected(served, HEAD)) for _ in range(60)]
        # Both ends are in this process.
        assert eventually(lambda: open_sockets() - before == len(held) + 8)


def test_who_was_refused_and_does_not_send_the_rest_of_the_body_is_disconnected(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "HEAD_DEADLINE_S", 0.2)
    with connected(serve(), HEAD + b"Content-Length: 100\r\n\r\n{") as connection:
        status, _, closes = answered(connection)
        assert (status, closes) == (401, False)
        assert is_closed(connection)


def test_who_does_not_read_its_answers_is_disconnected(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "ANSWER_DEADLINE_S", 0.2)
    asking = b"GET /api/v1/session HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer %s\r\n\r\n" % TOKEN.encode()
    with connected(serve()) as connection, pytest.raises(ConnectionError):  # noqa: PT012 - it is the last that fails
        for _ in range(10_000):  # until neither side's buffers take any more
            connection.sendall(asking * 100)


def test_a_solution_that_asks_too_much_at_once_keeps_no_operator_out(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "MOST_REQUESTS", 4)
    served = serve()
    listening = b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer %s\r\n\r\n" % TOKEN.encode()
    with ExitStack() as stack:
        for _ in range(4):
            assert stack.enter_context(connected(served, listening)).recv(1000).startswith(b"HTTP/1.1 200 ")
        status, error, closes = answered(stack.enter_context(connected(served, listening)))
        assert (status, error["title"], closes) == (429, "There are too many requests at once.", True)
        with served.http(OPERATOR_TOKEN) as operator:
            assert operator.get("/api/v1/watch/record").status_code == 200
    with served.http() as solution:
        assert eventually(lambda: solution.get("/api/v1/session").status_code == 200), "they are over"


@pytest.mark.parametrize("route", ["reset", "step", "next_scene", "stop"])
def test_what_holds_no_result_is_small(serve: Serve, route: str) -> None:
    body = b'{"action": "%s"}' % (b"x" * bodies.SMALL_BYTES)
    with serve().http() as client:
        response = client.post(f"/api/v1/{route}", content=body, headers={"Content-Type": "application/json"})
    assert response.status_code == 413


def test_a_large_body_holds_up_nobody_but_the_next_one(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    decode, decoding, go_on = bodies._decoded, threading.Semaphore(0), threading.Event()

    def slowly(request: Request, body: bytearray) -> Any:
        if len(body) > bodies.SMALL_BYTES:
            decoding.release()
            go_on.wait(60)
        return decode(request, body)

    monkeypatch.setattr(bodies, "_decoded", slowly)
    served = serve()
    document = {"result": {"results": "x" * 2 * bodies.SMALL_BYTES}}
    with served.http() as client, ThreadPoolExecutor(2) as executor:
        try:
            sent = [executor.submit(served_post, served, document) for _ in range(2)]
            assert decoding.acquire(timeout=60)
            assert client.get("/api/v1/session").status_code == 200
            assert client.post("/api/v1/reset").status_code == 200
            assert not decoding.acquire(blocking=False), "one at a time"
        finally:
            go_on.set()
        assert [one.result() for one in sent] == [400, 400]


def served_post(served: Served, document: dict[str, Any]) -> int:
    with served.http() as client:
        return client.post("/api/v1/result", json=document).status_code


def open_sockets() -> int:
    """Return how many sockets this process has open."""
    found = 0
    for path in Path("/proc/self/fd").iterdir():
        with suppress(OSError):
            found += str(path.readlink()).startswith("socket:")
    return found


def test_a_connection_in_use_is_not_closed_for_others(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 8)
    served = serve()
    head = HEAD.replace(b"wrong", TOKEN.encode()) + b"Expect: 100-continue\r\nContent-Length: 9\r\n\r\n"
    with ExitStack() as stack, connected(served, head) as slow:
        assert slow.recv(1000).startswith(b"HTTP/1.1 100 ")  # the head has been read
        for _ in range(20):
            stack.enter_context(connected(served, WHOLE))
        slow.sendall(b'{"a": 1 }')
        assert answered(slow)[0] == 415


def test_a_request_with_two_lengths_is_refused_and_its_connection_closed(serve: Serve) -> None:
    message = HEAD + b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + WHOLE
    with connected(serve(), message) as connection:
        status, error, closes = answered(connection)
    assert (status, closes) == (400, True)
    assert error["why"] == "It has both Content-Length and Transfer-Encoding."


@pytest.mark.parametrize("path", ["/api/v1/health", "/api/v1/session", "/nothing"])
def test_a_domain_name_of_somebody_else_is_refused_everywhere(serve: Serve, path: str) -> None:
    served = serve()
    headers = {"Host": "evil.example.com", "Authorization": f"Bearer {TOKEN}"}
    assert httpx.get(served.url + path, headers=headers).status_code == 403


@pytest.mark.parametrize(
    "host",
    ["localhost", "LOCALHOST:80", "127.0.0.1", "[::1]:7", "192.0.2.7", "benchbot_supervisor", socket.gethostname()],
)
def test_addresses_and_names_of_this_machine_are_answered(serve: Serve, host: str) -> None:
    assert httpx.get(serve().url + "/api/v1/health", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("scheme", ["Bearer", "bearer", "BEARER"])
def test_the_scheme_of_a_token_may_be_in_any_case(serve: Serve, scheme: str) -> None:
    headers = {"Authorization": f"{scheme} {TOKEN}"}
    assert httpx.get(serve().url + "/api/v1/session", headers=headers).status_code == 200


@pytest.mark.parametrize("given", ["Basic {}", "Bearer{}", "{}", "Bearer {}x", "Bearer"])
def test_what_is_not_the_token_is_not_taken_for_it(serve: Serve, given: str) -> None:
    headers = {"Authorization": given.format(TOKEN)}
    assert httpx.get(serve().url + "/api/v1/session", headers=headers).status_code == 401


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (b'{"action": null, "action": "move_next"}', "the key 'action' is in an object twice."),
        (b'{"action": null, "arguments": {"distance": 1, "angle": 2, "distance": 3}}', "the key 'distance' is"),
        (b'{"arguments": {"distance": NaN}}', "NaN is no number of JSON."),
    ],
)
def test_json_that_others_read_differently_is_refused(serve: Serve, body: bytes, why: str) -> None:
    headers = {"Content-Type": "application/json", "Accept": "application/msgpack"}
    with serve().http() as client:
        response = client.post("/api/v1/step", content=body, headers=headers)
    assert response.status_code == 400
    assert response.json()["why"].startswith(why)
