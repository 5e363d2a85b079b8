"""Clients that begin and do not go on, that are too many, or whose requests can be read in more ways than one."""

import http.client
import json
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import httpx
import pytest

from benchbot.supervisor.http import bodies, connections
from tests.supervisor.harness import TOKEN, Served

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
