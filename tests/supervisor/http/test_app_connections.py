"""Connections: requests in pieces, in advance and side by side; clients that do not read, hang up or outlive a run."""

import http.client
import logging
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
from benchbot.core.digest import ObservationDigest
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.supervisor.http import server
from benchbot.supervisor.http.app import create_app
from benchbot.supervisor.platform import borrowed
from benchbot.supervisor.platform.host import ChildHost
from benchbot.supervisor.run import Run
from benchbot.wire import encoding
from benchbot.wire.arena import ArenaReader
from benchbot.wire.run_state import Connection
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, eventually, sample_selection

Serve = Callable[..., Served]

TURN = {"action": "move_angle", "arguments": {"angle": 1.0}}


class Raw:
    """A client that sends bytes as they are."""

    def __init__(self, served: Served) -> None:
        address = httpx.URL(served.url)
        self.socket = socket.create_connection((address.host, address.port or 80), timeout=120)
        # One for all answers: it may have read the beginning of the next one.
        self.answers = self.socket.makefile("rb")

    def send(self, *messages: bytes) -> None:
        self.socket.sendall(b"".join(messages))

    def close(self) -> None:
        self.answers.close()
        self.socket.close()

    def answer(self) -> tuple[int, dict[str, Any]]:
        _, status, _ = self.answers.readline().split(maxsplit=2)
        headers = http.client.parse_headers(self.answers)
        body = bytearray(self.answers.read(int(headers["Content-Length"])))
        content = encoding.decode(body) if headers["Content-Type"] == "application/msgpack" else {"error": body}
        return int(status), {**content, "headers": sorted(name.lower() for name in headers)}

    def ask(self, *messages: bytes) -> tuple[int, dict[str, Any]]:
        self.send(*messages)
        return self.answer()


def message(route: str, body: Any = None) -> bytes:
    content = encoding.encode(body or {})
    start = b"POST /api/v1/%s HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer %s\r\n" % (route.encode(), TOKEN.encode())
    return start + b"Content-Type: application/msgpack\r\nContent-Length: %d\r\n\r\n%s" % (len(content), content)


def test_our_own_client_steps_through_a_run_on_one_connection(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    client = Client(Connection(served.url, None, TOKEN))
    client.reset()
    for _ in range(3):
        client.step("move_angle", {"angle": 1.0})
    assert client.session()["steps"] == 3
    client.next_scene()


def test_many_connections_are_answered_alike(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    Client(Connection(served.url, None, TOKEN)).reset()
    clients = [Raw(served) for _ in range(10)]
    for _ in range(2):
        answers = [client.ask(message("step")) for client in clients]
        np.testing.assert_equal(answers, [answers[0]] * len(clients))
    clients[0].close()
    assert clients[1].ask(message("step"))[0] == 200


def test_what_follows_an_answer_is_whole_and_in_order_whoever_comes_next(serve: Serve) -> None:
    """The digest, the log and the events are those of the steps one after the other, by several connections."""
    served = serve(sample_selection("sample:active"))
    clients = [Client(Connection(served.url, None, TOKEN)) for _ in range(3)]
    shown = ObservationDigest()
    told: list[tuple[str, int]] = []
    publish = served.run.events.publish

    def noted(kind: str, data: dict[str, Any]) -> None:
        told.append((kind, data.get("steps", 0)))
        publish(kind, data)

    served.run.events.publish = noted  # type: ignore[method-assign]
    shown.update(clients[0].reset()["observations"])
    for number in range(1, 13):
        client = clients[number % 3]
        angle = {"angle": float(number)}
        shown.update(client.step("move_angle", angle)["observations"])
        if number % 4 == 0:
            status, answer = Raw(served).ask(message("step"))
            assert status == 200
            shown.update(answer["observations"])
    document = clients[1].failed(FailureClass.AGENT, "It has seen enough.")["document"]
    assert document["provenance"]["observation_digest"] == shown.hexdigest()
    (scene,) = document["actions"]
    assert [row[0] for row in scene["rows"]] == shown.marks()
    assert [row[2]["angle"] for row in scene["rows"] if len(row) > 2] == [float(number) for number in range(1, 13)]
    looked = [("step", number) for number in range(1, 13) for _ in range(1 + (number % 4 == 0))]
    assert told == [("scene", 0), *looked, ("result", 0)]


def test_an_answer_does_not_wait_for_its_event_but_the_next_request_does(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    begun, go_on, told = threading.Event(), threading.Event(), list[str]()

    def slow(kind: str, data: dict[str, Any]) -> None:
        begun.set()
        go_on.wait(60)
        told.append(kind)

    first, second = Raw(served), Raw(served)
    served.run.events.publish = slow  # type: ignore[method-assign]
    assert first.ask(message("reset"))[0] == 200
    assert begun.wait(60)
    with ThreadPoolExecutor() as executor:
        stepping = executor.submit(second.ask, message("step", TURN))
        # Not by a request: that could come first, and wait in its place.
        assert eventually(served.run._lock.locked)
        assert (told, stepping.done()) == ([], False)
        go_on.set()
        assert stepping.result()[1]["steps"] == 1
    assert told[0] == "scene"


def test_a_follow_up_that_fails_keeps_no_other_from_being_done(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    told: list[str] = []

    def failing(kind: str, data: dict[str, Any]) -> None:
        told.append(kind)
        raise ZeroDivisionError

    publish, served.run.events.publish = served.run.events.publish, failing  # type: ignore[method-assign]
    assert Raw(served).ask(message("reset"))[0] == 200
    assert eventually(lambda: told == ["scene"])
    served.run.events.publish = publish  # type: ignore[method-assign]
    shown = ObservationDigest()
    for route, steps in (("reset", 0), ("step", 1)):
        status, answer = Raw(served).ask(message(route, TURN if steps else None))
        assert (status, answer["steps"]) == (200, steps)
        shown.update(answer["observations"])
    document = Client(Connection(served.url, None, TOKEN)).failed(FailureClass.AGENT, "Enough.")["document"]
    assert document["provenance"]["observation_digest"] == shown.hexdigest()


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
    raw.send(*[message("step", TURN)] * 3)
    for _ in range(5):
        raw.send(message("step", TURN))
    assert [raw.answer()[1]["steps"] for _ in range(8)] == list(range(1, 9))


def test_one_request_at_a_time_uses_the_robot(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    Raw(served).ask(message("reset"))

    def step_often(_: int) -> list[int]:
        raw = Raw(served)
        return [raw.ask(message("step", TURN))[0] for _ in range(20)]

    with ThreadPoolExecutor(6) as executor:
        statuses = [status for answered in executor.map(step_often, range(6)) for status in answered]
    assert set(statuses) <= {200, 409}
    assert served.run.progress.steps == statuses.count(200)


@pytest.fixture
def endless(monkeypatch: pytest.MonkeyPatch) -> None:
    """Answers to resets are longer than what any connection takes at once."""
    encode = borrowed.encode_answer

    def more(answer: dict[str, Any], arena: ArenaReader | None, *, opened: str | None) -> bytes:
        return encode({**answer, "more": bytes(2**25)} if answer["state"] == "clean" else answer, arena, opened=opened)

    monkeypatch.setattr(borrowed, "encode_answer", more)


@pytest.mark.usefixtures("endless")
def test_one_who_does_not_read_keeps_nobody_waiting(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    slow, quick = Raw(served), Raw(served)
    slow.send(message("reset"))
    assert eventually(lambda: quick.ask(message("step", TURN))[0] == 200)
    assert quick.ask(message("step", TURN))[1]["steps"] == 2
    assert slow.answer()[1]["steps"] == 0


@pytest.mark.usefixtures("endless")
def test_one_who_does_not_read_keeps_no_server_from_ending(tmp_path: Path) -> None:
    before = server_threads()
    run, url, serving = started(tmp_path)
    with serving:
        deaf = Raw(Served(run, url, []))
        deaf.send(message("reset"))
        assert eventually(lambda: run.progress.frames == 1)
        assert server_threads() - before
    assert eventually(lambda: server_threads() <= before)


def server_threads() -> set[threading.Thread]:
    return {thread for thread in threading.enumerate() if thread.name == "benchbot-server"}


def test_clients_that_hang_up_leave_nothing_behind(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    Raw(served).ask(message("reset"))
    before = open_files()
    for number in range(30):
        raw = Raw(served)
        if number % 3:
            raw.ask(message("step"))
        raw.send(message("step", TURN))
        raw.close()
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
    run, url, serving = started(tmp_path)
    under_way, go_on = threading.Event(), threading.Event()
    step = run.step

    def waiting(*arguments: Any) -> Any:
        under_way.set()
        go_on.wait(60)
        return step(*arguments)

    monkeypatch.setattr(run, "step", waiting)
    served = Served(run, url, [])
    with serving, ThreadPoolExecutor() as executor:
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


def started(folder: Path) -> tuple[Run, str, ExitStack]:
    """Return a run, its address, and what ends first the server, then the run."""
    run = Run(sample_selection("sample:active"), lambda: ChildHost(run.selection, folder / "log"), folder / "result")
    listener = server.bind_tcp("127.0.0.1", 0)
    serving = ExitStack()
    serving.callback(run.close)
    serving.enter_context(server.Server(create_app(run, TOKEN, OPERATOR_TOKEN), [listener]))
    return run, server.url_of(listener), serving


def listens(served: Served) -> bool:
    try:
        Raw(served).close()
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
    with caplog.at_level(logging.ERROR, "uvicorn.error"):
        status, answer = raw.ask(message("step", TURN))
        assert raw.socket.recv(1) == b""
    assert status == 500
    assert "connection" in answer["headers"]
    assert b"The supervisor made a mistake." in answer["error"]
    assert b"inner life" not in answer["error"]
    assert "inner life" in caplog.text
    assert Raw(served).ask(message("reset"))[0] == 200
