"""Looking on at a run, holding it and driving it by hand, beside a solution that knows nothing of it."""

import json
import socket
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from benchbot.api.client import Client
from benchbot.core import plugin_manager, results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.request import Limits
from benchbot.plugins.bundles import replay
from benchbot.plugins.watching.routes import MOST_POINTS
from benchbot.wire import encoding
from benchbot.wire.run_state import Connection
from tests.plugins.bundles.conftest import StartHost, start_host  # noqa: F401 - a fixture
from tests.plugins.v2.v2_client import V2Client
from tests.supervisor import harness
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, sample_selection

Serve = Callable[..., Served]
eventually = partial(harness.eventually, patience_s=120.0)
WATCH_ROUTES = [("GET", "watch"), ("GET", "watch/look"), ("POST", "watch/gate"), ("POST", "watch/drive")]


class Host:
    """Whoever runs the solution: asks with the operator's token."""

    def __init__(self, served: Served, token: str = OPERATOR_TOKEN) -> None:
        self.http = served.http(token)

    def watch(self, **asked: Any) -> dict[str, Any]:
        answer: dict[str, Any] = self.ask("GET", "watch", params=asked)[1]
        return answer

    def look(self, after: int = 0, width: int = 320, channels: str = "image_rgb") -> Any:
        return self.ask("GET", "watch/look", params={"after": after, "width": width, "channels": channels})[1]

    def gate(self, **order: Any) -> Any:
        return self.ask("POST", "watch/gate", json=order)[1]

    def drive(self, action: str, **arguments: float) -> tuple[int, Any]:
        return self.ask("POST", "watch/drive", json={"action": action, "arguments": arguments})

    def ask(self, method: str, route: str, **more: Any) -> tuple[int, Any]:
        response = self.http.request(method, f"/api/v1/{route}", **more)
        if response.status_code == 204:
            return 204, None
        if response.headers["content-type"] == "application/json":
            return response.status_code, response.json()
        return response.status_code, encoding.decode(bytearray(response.content))

    def sees_it_held(self) -> bool:
        return bool(self.watch()["gate"]["held"])


def solution(served: Served) -> Client:
    return Client(Connection(served.url, None, TOKEN))


def test_a_host_watches_holds_and_drives_and_all_of_it_is_told(serve: Serve, start_host: StartHost) -> None:  # noqa: F811
    served = serve(sample_selection("sample:active", limits=Limits(steps=20)))
    host, client = Host(served), solution(served)

    # Before a solution has begun: nothing to see yet, and the host may try the robot.
    before = host.watch(session=1)
    assert (before["progress"]["frames"], before["path"], before["last"], before["result"]) == (0, [], None, None)
    assert before["gate"] == {"paused": False, "steps_left": 0, "held": False}
    assert before["session"]["selection"]["task"] == "sample:active"
    assert host.look() is None
    status, driven = host.drive("move_distance", distance=0.2)
    assert (status, driven["outcome"], driven["by_hand"]) == (200, "reached", True)
    assert served.run.describe()["started"] is False

    # The solution begins, and drives: the host looks, but does not drive.
    first = client.reset()
    seen = host.look(width=16, channels="image_rgb,image_segment")
    assert seen["stride"] == 3
    assert np.array_equal(seen["observations"]["image_rgb"], first["observations"]["image_rgb"][::3, ::3])
    classes = seen["observations"]["image_segment"]
    assert np.array_equal(
        classes["class_segment_img"], first["observations"]["image_segment"]["class_segment_img"][::3, ::3]
    )
    assert classes["class_ids"] == first["observations"]["image_segment"]["class_ids"]
    assert host.look(after=seen["number"], width=16, channels="image_rgb,image_segment") is None
    assert client.step("move_distance", {"distance": 0.3})["outcome"] == "reached"
    assert host.drive("move_distance", distance=0.2)[0] == 409
    watched = host.watch(after=0, channels="laser,poses")
    assert watched["last"] == {
        "action": "move_distance",
        "arguments": {"distance": 0.3},
        "by_hand": False,
        "outcome": "reached",
        "result": "SUCCESS",
    }
    assert watched["progress"]["pose_xyyaw"][:2] == pytest.approx(watched["path"][-1], abs=1e-3)
    assert set(watched["look"]["observations"]) == {"laser", "poses"}
    assert watched["usage"]["memory_bytes"] > 0

    # Paused: the next step waits, its time does not count, and the host drives and lets single steps through.
    assert host.gate(paused=True)["paused"]
    assert client.session()["progress"]["paused"]
    with ThreadPoolExecutor(1) as thread:
        held = thread.submit(client.step, "move_angle", {"angle": 30.0})
        assert eventually(host.sees_it_held)
        stood_still = [served.run.progress.wall_time_s for _ in range(2)]
        assert stood_still[0] == stood_still[1]
        assert host.drive("move_angle", angle=-90.0)[1]["outcome"] == "reached"
        assert host.drive("fly")[0] == 400
        assert not held.done()
        assert host.gate(steps=1)["paused"]
        assert held.result()["steps"] == 3
        held = thread.submit(client.step, "move_angle", {"angle": 30.0})
        assert eventually(host.sees_it_held)
        assert client_looks(served)["steps"] == 3
        assert not host.gate(paused=False)["paused"]
        assert held.result()["steps"] == 4

    # What the host has done is in the result, and the result can be read by whoever checks its schema.
    answer = client.result({"results": client.results_function("create")})
    document: Any = results.read(served.run.result_path)
    assert (document["provenance"]["driven_by_hand"], document["provenance"]["restarts"]) == (2, 0)
    assert [row[1:] for row in document["actions"][0]["rows"]] == [
        [],
        ["move_distance", {"distance": 0.3}],
        ["move_angle", {"angle": -90.0}, "by_hand"],
        ["move_angle", {"angle": 30.0}],
        [],
        ["move_angle", {"angle": 30.0}],
    ]
    # It can be verified: what was done by hand is done again like the rest.
    verification = replay.verify(document, Catalog(plugin_manager.load()), start_host)
    assert verification.problems == ()
    assert host.watch()["result"] == answer["path"]
    client.reset()
    assert (
        "driven_by_hand" not in client.result({"results": client.results_function("create")})["document"]["provenance"]
    )


def client_looks(served: Served) -> dict[str, Any]:
    """Return what a mere look says: it moves nothing, and is not held."""
    return solution(served).step(None)


def test_a_solution_may_not_watch_hold_or_drive(serve: Serve) -> None:
    served = serve()
    for token, refused in ((TOKEN, 403), ("another", 401)):
        stranger = Host(served, token)
        assert [stranger.ask(method, route, json={})[0] for method, route in WATCH_ROUTES] == [refused] * 4
    host = Host(served)
    for wrong in ({}, {"paused": True, "steps": 1}, {"steps": 0}, {"steps": "1"}, {"fast": 1}):
        assert host.ask("POST", "watch/gate", json=wrong)[0] == 400
    for asked in ({"after": "-1"}, {"width": "wide"}, {"after": "9" * 30}):
        assert host.ask("GET", "watch/look", params=asked)[0] == 400
    assert host.ask("GET", "watch/look", headers={"Accept": "application/json"})[0] == 406
    json_only = host.ask("GET", "watch", headers={"Accept": "application/json"})
    assert (json_only[0], json_only[1]["progress"]["state"]) == (200, "clean")


def test_stopping_ends_a_run_that_is_paused_and_hanging_up_frees_the_gate(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    host, client = Host(served), solution(served)
    client.reset()
    host.gate(paused=True)

    # A solution that dies while it waits is gone from the gate, and has not moved the robot.
    with sent_step(served):
        assert eventually(host.sees_it_held)
    assert eventually(lambda: not host.sees_it_held())
    assert served.run.progress.steps == 0

    with ThreadPoolExecutor(4) as threads:
        waiting = [threads.submit(solution(served).step, "move_angle", {"angle": 5.0}) for _ in range(4)]
        assert eventually(lambda: served.run.gate.state.held and all(not each.done() for each in waiting))
        host.ask("POST", "stop", json={})
        for each in waiting:
            with pytest.raises(BenchbotError, match=r"run has ended|supervisor is gone"):
                each.result()
    # It was stopped while it was in use: that is not the solution's fault.
    assert served.run.progress.failure is FailureClass.PLATFORM


def sent_step(served: Served) -> socket.socket:
    """Return the connection of a client that has sent a step, and does not read the answer."""
    address = urlsplit(served.url)
    connection = socket.create_connection((address.hostname or "", address.port or 0))
    body = json.dumps({"action": "move_angle", "arguments": {"angle": 5.0}})
    head = f"POST /api/v1/step HTTP/1.1\r\nHost: a\r\nAuthorization: Bearer {TOKEN}\r\n"
    connection.sendall(f"{head}Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n{body}".encode())
    return connection


def test_the_gate_holds_a_client_of_v2_and_the_limit_of_time_does_not_run_on(serve: Serve) -> None:
    # So little time that a paused run, whose clock ran on, would have used it up when the pause is seen.
    served = serve(sample_selection("sample:active", limits=Limits(wall_time_s=600.0)), open_to_v2=True)
    host = Host(served)
    host.gate(paused=True)
    with ThreadPoolExecutor(1) as thread:
        client = V2Client(f"{served.url}/")
        held = thread.submit(client.query, "/robot/restart")
        assert eventually(host.sees_it_held)
        host.gate(steps=1)
        assert held.result()["restart_success"]
        # A run that is reset while it is paused is paused still.
        assert host.watch()["progress"]["paused"]
        wall_s = served.run.progress.wall_time_s
        held = thread.submit(client.query, "/connections/move_angle", {"angle": 5.0})
        assert eventually(host.sees_it_held)
        assert served.run.progress.wall_time_s == wall_s
        host.gate(paused=False)
        held.result()
    assert served.run.progress.steps == 1


def test_a_watcher_that_stalls_or_dies_takes_nothing_from_the_run(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    client = solution(served)
    client.reset()
    address = urlsplit(served.url)
    head = f"Host: a\r\nAuthorization: Bearer {OPERATOR_TOKEN}\r\nAccept: application/msgpack\r\n\r\n"
    asked = f"GET /api/v1/watch?session=1&after=0&width=4096&channels=image_rgb,image_depth HTTP/1.1\r\n{head}".encode()
    stalled = [socket.create_connection((address.hostname or "", address.port or 0)) for _ in range(3)]
    for connection in stalled:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.settimeout(0.2)
        # As much as the supervisor takes, and nothing is ever read.
        with pytest.raises(TimeoutError):
            connection.sendall(asked * 100_000)

    steps = [client.step("move_angle", {"angle": 5.0})["steps"] for _ in range(20)]
    stalled.pop().close()
    steps += [client.step("move_angle", {"angle": 5.0})["steps"] for _ in range(20)]

    assert steps == list(range(1, 41))
    watched = Host(served).watch()
    assert 1 < len(watched["path"]) <= MOST_POINTS + 1
    for connection in stalled:
        connection.close()


def test_driving_waits_for_what_is_under_way_and_a_refused_drive_leaves_the_gate_as_it_was(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    host, client = Host(served), solution(served)
    client.reset()
    host.gate(paused=True)
    with ThreadPoolExecutor(3) as threads:
        drives = [threads.submit(Host(served).drive, "move_angle", angle=1.0) for _ in range(3)]
        looks = [client.step(None) for _ in range(10)]
        # One drive at a time: the others are told so, or come after it.
        statuses = [each.result()[0] for each in drives]
    assert set(statuses) <= {200, 409}
    assert served.run.session.driven_by_hand == statuses.count(200)
    assert looks[-1]["steps"] <= 3
    host.gate(paused=False)
    assert client.step("move_angle", {"angle": 1.0})["steps"] == statuses.count(200) + 1


def test_the_state_is_told_while_every_thread_of_requests_waits(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"))
    client = solution(served)
    client.reset()
    Host(served).gate(paused=True)
    with ThreadPoolExecutor(1) as thread, httpx.Client(base_url=served.url, timeout=60) as other:
        held = thread.submit(client.step, "move_angle", {"angle": 5.0})
        assert eventually(Host(served).sees_it_held)
        # Another solution is refused, not put to sleep: threads are few.
        refusals = [sent_step(served) for _ in range(60)]
        assert eventually(lambda: Host(served).watch()["gate"]["held"])
        assert other.get("/api/v1/health").status_code == 200
        for connection in refusals:
            connection.close()
        Host(served).gate(paused=False)
        assert held.result()["outcome"] == "reached"
