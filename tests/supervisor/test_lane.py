"""Requests in the express lane: answered as by the HTTP server, one at a time, and whatever their clients do."""

import http.client
import logging
import select
import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from benchbot.api.client import Client
from benchbot.core.errors import BenchbotError
from benchbot.supervisor import lane, server, wire
from benchbot.supervisor.app import create_app
from benchbot.supervisor.platform_host import ChildHost
from benchbot.supervisor.run import Run
from benchbot.supervisor.run_state import Connection
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, eventually, sample_selection

Serve = Callable[..., Served]

TURN = {"action": "move_angle", "arguments": {"angle": 1.0}}
# A header that the lane does not know sends a request the ordinary way.
DETOUR = b"X-Detour: 1\r\n"


class Raw:
    """A client that sends bytes as they are."""

    def __init__(self, served: Served) -> None:
        address = httpx.URL(served.url)
        self.socket = socket.create_connection((address.host, address.port or 80), timeout=120)

    def send(self, *messages: bytes) -> None:
        self.socket.sendall(b"".join(messages))

    def answer(self) -> tuple[int, dict[str, Any]]:
        response = http.client.HTTPResponse(self.socket, method="POST")
        response.begin()
        body = bytearray(response.read())
        content = wire.decode(body) if response.headers["Content-Type"] == "application/msgpack" else {"error": body}
        return response.status, {**content, "headers": sorted(name.lower() for name in response.headers)}

    def ask(self, *messages: bytes) -> tuple[int, dict[str, Any]]:
        self.send(*messages)
        return self.answer()


def message(route: str, body: Any = None, more: bytes = b"") -> bytes:
    content = wire.encode(body or {})
    start = b"POST /api/v1/%s HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer %s\r\n" % (route.encode(), TOKEN.encode())
    return start + b"Content-Type: application/msgpack\r\nContent-Length: %d\r\n%s\r\n%s" % (
        len(content),
        more,
        content,
    )


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """What the lane has been asked to answer."""
    begun: list[object] = []
    begin = lane.Lane.begin

    def counted(self: lane.Lane, work: Callable[[], None]) -> object:
        begun.append(work)
        return begin(self, work)

    monkeypatch.setattr(lane.Lane, "begin", counted)
    return begun


def test_an_answer_is_the_same_by_both_ways(serve: Serve, taken: list[object]) -> None:
    raw = Raw(serve(sample_selection("sample:active")))
    assert raw.ask(message("step", TURN)) == raw.ask(message("step", TURN, DETOUR))
    assert raw.ask(message("reset"))[1]["state"] == "clean"
    assert len(taken) == 2
    by_lane, ordinarily = raw.ask(message("step")), raw.ask(message("step", more=DETOUR))
    assert len(taken) == 3
    np.testing.assert_equal(by_lane, ordinarily)
    assert raw.ask(message("step", {"action": "fly"})) == raw.ask(message("step", {"action": "fly"}, DETOUR))


def test_our_own_client_takes_the_lane(serve: Serve, taken: list[object]) -> None:
    served = serve(sample_selection("sample:active"))
    client = Client(Connection(served.url, None, TOKEN))
    client.reset()
    for _ in range(3):
        client.step("move_angle", {"angle": 1.0})
    assert client.session()["steps"] == 3
    client.next_scene()
    assert len(taken) == 5


@pytest.mark.parametrize("pieces", [1, 2, 100])
def test_a_request_in_pieces_is_answered_all_the_same(serve: Serve, pieces: int) -> None:
    raw = Raw(serve(sample_selection("sample:active")))
    raw.ask(message("reset"))
    whole = message("step", TURN)
    size = -(-len(whole) // pieces)
    raw.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for start in range(0, len(whole), size):
        raw.send(whole[start : start + size])
    assert raw.answer()[1]["steps"] == 1
    assert raw.ask(message("step", TURN))[1]["steps"] == 2


def test_requests_that_do_not_wait_for_their_answers_get_them_in_turn(serve: Serve) -> None:
    raw = Raw(serve(sample_selection("sample:active")))
    raw.ask(message("reset"))
    raw.send(message("step", TURN), message("step", TURN, DETOUR), message("step", TURN))
    for _ in range(5):
        raw.send(message("step", TURN))
    assert [raw.answer()[1]["steps"] for _ in range(8)] == list(range(1, 9))


def test_one_request_at_a_time_uses_the_robot(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    Raw(served).ask(message("reset"))

    def step_often(number: int) -> list[int]:
        raw = Raw(served)
        return [raw.ask(message("step", TURN, DETOUR if number % 2 else b""))[0] for _ in range(20)]

    with ThreadPoolExecutor(6) as executor:
        statuses = [status for answered in executor.map(step_often, range(6)) for status in answered]
    assert set(statuses) <= {200, 409}
    assert served.run.progress.steps == statuses.count(200)


def test_one_who_does_not_read_keeps_nobody_waiting(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    served = serve(sample_selection("sample:active"))
    # As if the buffers of every connection were full.
    monkeypatch.setattr(lane, "_send", lambda connection, head, body: head + body)
    slow, quick = Raw(served), Raw(served)
    slow.send(message("reset"))
    assert eventually(lambda: quick.ask(message("step"))[0] == 200)
    first = quick.ask(message("step"))[1]["observations"]
    np.testing.assert_equal(slow.answer()[1]["observations"], first)


def test_what_a_connection_does_not_take_at_once_is_the_rest() -> None:
    head, body = b"head", bytes(range(100)) * 100_000
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.setblocking(False)
        rest = lane._send(ours, head, body)
        while not lane._send(ours, b"x", b""):
            pass
        sent = b"".join(iter(lambda: theirs.recv(2**16) if readable(theirs) else b"", b""))
        assert 0 < len(rest) < len(body)
        assert sent.rstrip(b"x") + bytes(rest) == head + body
        assert lane._send(ours, head, b"") == b""
        theirs.close()
        assert lane._send(ours, head, body) == b""


def readable(connection: socket.socket) -> bool:
    return bool(select.select([connection], [], [], 0)[0])


def test_clients_that_hang_up_leave_nothing_behind(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    Raw(served).ask(message("reset"))
    before = open_files()
    for number in range(30):
        raw = Raw(served)
        if number % 3:
            raw.ask(message("step"))
        raw.send(message("step", TURN))
        raw.socket.close()
    assert eventually(lambda: open_files() <= before)
    assert eventually(lambda: Raw(served).ask(message("step"))[0] == 200)
    assert served.run.progress.failure is None


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_an_action_under_way_is_answered_when_the_run_ends(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:hang"))
    client = Client(Connection(served.url, None, TOKEN))
    client.reset()
    client.step(None)
    with ThreadPoolExecutor() as executor:
        hanging = executor.submit(client.step, None)
        assert eventually(lambda: Raw(served).ask(message("step", {"action": "fly"}))[0] == 409)
        served.run.close()
        with pytest.raises(BenchbotError, match="The run has ended"):
            hanging.result()


def test_a_server_that_ends_lets_the_answer_out_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = Run(
        sample_selection("sample:active"), lambda: ChildHost(run.selection, tmp_path / "log"), tmp_path / "result"
    )
    under_way, go_on = threading.Event(), threading.Event()
    step = run.step

    def waiting(*arguments: Any) -> Any:
        under_way.set()
        go_on.wait(60)
        return step(*arguments)

    monkeypatch.setattr(run, "step", waiting)
    listener = server.bind_tcp("127.0.0.1", 0)
    served = Served(run, server.url_of(listener), [])
    with ExitStack() as stack, ThreadPoolExecutor() as executor:
        stack.callback(run.close)
        serving = ExitStack()
        serving.enter_context(server.Server(create_app(run, TOKEN, OPERATOR_TOKEN), [listener]))
        raw = Raw(served)
        raw.ask(message("reset"))
        raw.send(message("step", TURN))
        under_way.wait(60)
        ending = executor.submit(serving.close)
        assert eventually(lambda: not listens(served))
        go_on.set()
        status, answer = raw.answer()
        assert (status, answer["steps"]) == (200, 1)
        assert raw.socket.recv(1) == b""
        ending.result()


def listens(served: Served) -> bool:
    try:
        Raw(served).socket.close()
    except ConnectionError:
        return False
    return True


def test_a_mistake_of_the_supervisor_is_told_without_its_inner_life(
    serve: Serve, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    served = serve(sample_selection("sample:active"))

    def broken(*_arguments: Any) -> Any:
        raise ZeroDivisionError("inner life")

    monkeypatch.setattr(served.run, "step", broken)
    raw = Raw(served)
    with caplog.at_level(logging.ERROR, "benchbot.supervisor"):
        status, answer = raw.ask(message("step", TURN))
        assert raw.socket.recv(1) == b""
    assert status == 500
    assert "connection" in answer["headers"]
    assert b"The supervisor made a mistake." in answer["error"]
    assert b"inner life" not in answer["error"]
    assert "inner life" in caplog.text
    assert Raw(served).ask(message("reset"))[0] == 200
