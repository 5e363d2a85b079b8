import http.client
import json
import os
import signal
import socket
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest

from benchbot.core.errors import FailureClass
from benchbot.core.host import Host
from benchbot.supervisor.http import server
from benchbot.supervisor.http.app import create_app
from benchbot.supervisor.platform.host import Timeouts
from benchbot.supervisor.run import Run
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, alive, eventually, sample_selection
from tests.supervisor.http.test_app import Serve, post, read


def test_there_is_one_robot_and_one_request_at_a_time(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:hang"))
    answers: list[tuple[int, Any]] = []
    with served.http() as http, served.http() as other:
        post(http, "reset")
        post(http, "step", {})

        def hang() -> None:
            # The other one's request may be the first, and this one refused.
            while (answer := post(http, "step", {}))[0] == 409:
                pass
            answers.append(answer)

        thread = threading.Thread(target=hang)
        thread.start()
        refused: list[Any] = []

        def is_busy() -> bool:
            status, answer = post(other, "step", {"action": "fly"})
            refused.append(answer)
            return status == 409

        assert eventually(is_busy)
        assert "busy" in refused[-1]["title"]
        assert read(other.get("/api/v1/session"))[0] == 200
        os.kill(served.hosts[0].pid, signal.SIGKILL)
        thread.join()
    assert answers[0][0] == 503


def test_a_platform_that_hangs_is_told_and_replaced(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:hang"), Timeouts(call_s=2.0))
    with served.http() as http:
        post(http, "reset")
        post(http, "step", {})
        status, error = post(http, "step", {})
        assert (status, error["failure"]) == (503, "platform")
        assert "hangs" in error["title"]
        assert not alive(served.hosts[0].pid)
        assert post(http, "reset")[0] == 200


def test_a_killed_platform_is_told_and_replaced(serve: Serve) -> None:
    served = serve()
    with served.http() as http:
        post(http, "reset")
        post(http, "step", {"action": "move_next"})
        os.kill(served.hosts[0].pid, signal.SIGKILL)
        status, error = post(http, "step", {"action": "move_next"})
        assert (status, error["failure"]) == (503, "platform")
        assert "SIGKILL" in error["why"]
        progress = read(http.get("/api/v1/session"))[1]["progress"]
        assert (progress["state"], progress["failure"]) == ("failed", "platform")
        assert post(http, "step", {"action": "move_next"})[0] == 503
        status, first = post(http, "reset")
        assert (status, first["state"], first["steps"]) == (200, "clean", 0)
        assert read(http.get("/api/v1/session"))[1]["progress"]["failure"] is None
    assert len(served.hosts) == 2
    assert not alive(served.hosts[0].pid)


def test_a_platform_that_dies_in_the_middle_of_a_step_is_told(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:crash"))
    with served.http() as http:
        post(http, "reset")
        answers = [post(http, "step", {"action": "move_next"}) for _ in range(2)]
        failed = [error for status, error in answers if status == 503]
        assert "SIGABRT" in failed[0]["why"]
        answer = post(http, "result", {"failure": {"class": "agent", "why": "It gave up."}})[1]
        assert answer["document"]["provenance"]["failure"]["class"] == "platform"


def test_a_world_that_does_not_load_is_told(serve: Serve) -> None:
    with serve(sample_selection(environment="faulty:load")).http() as http:
        status, error = post(http, "reset")
    assert (status, error["failure"]) == (503, "platform")


def test_a_mistake_of_the_supervisor_is_told_without_its_inner_life(tmp_path: Path) -> None:
    def broken() -> Host:
        raise ZeroDivisionError("inner life")

    run = Run(sample_selection(), broken, tmp_path / "result.json")
    with server.bind_tcp("127.0.0.1", 0) as listener:
        url = server.url_of(listener)
        with server.Server(create_app(run, TOKEN, OPERATOR_TOKEN), [listener]), Served(run, url, []).http() as http:
            response = http.post("/api/v1/reset")
            assert http.get("/api/v1/health").status_code == 200
    assert response.status_code == 500
    assert response.json()["failure"] == "infrastructure"
    assert "inner life" not in response.text
    assert "Traceback" not in response.text


def test_stop_is_answered_before_the_end(serve: Serve) -> None:
    served = serve()
    with served.http() as http:
        assert post(http, "stop") == (200, {"stopping": True})
    assert served.run.stop_asked.is_set()


def test_events_tell_what_happens(serve: Serve) -> None:
    served = serve()
    told: list[tuple[str, dict[str, Any]]] = []

    def listen() -> None:
        with served.http() as http, http.stream("GET", "/api/v1/events") as response:
            kind = ""
            for line in response.iter_lines():
                field, _, value = line.partition(": ")
                if field == "event":
                    kind = value
                elif field == "data":
                    told.append((kind, json.loads(value)))

    thread = threading.Thread(target=listen)
    thread.start()
    assert eventually(lambda: bool(told))
    with served.http() as http:
        post(http, "reset")
        post(http, "step", {"action": "move_next"})
        os.kill(served.hosts[0].pid, signal.SIGKILL)
        post(http, "step", {"action": "move_next"})
    assert eventually(lambda: "failure" in [kind for kind, _ in told])
    served.run.close()
    thread.join(10)
    assert not thread.is_alive()
    kinds = [kind for kind, _ in told]
    assert kinds[0] == "progress"
    assert [kind for kind in kinds if kind != "progress"] == ["scene", "step", "failure", "closed"]
    assert dict(told)["failure"]["failure"] == "platform"
    assert dict(told)["step"]["last_action"] == "move_next"


def test_closing_in_the_middle_of_an_action_ends_it(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:hang"))
    answers: list[tuple[int, Any]] = []

    def observe_until_it_ends() -> None:
        with served.http() as http:
            post(http, "reset")
            while not answers or answers[-1][0] == 200:
                answers.append(post(http, "step", {}))

    thread = threading.Thread(target=observe_until_it_ends)
    thread.start()
    assert eventually(lambda: len(answers) == 1)
    served.run.close()
    thread.join(10)
    assert not thread.is_alive()
    status, error = answers[-1]
    assert (status, error["title"]) == (500, "The run has ended.")
    assert not alive(served.hosts[0].pid)


class Impatient:
    """A client that sends a request and may hang up before it is answered."""

    def __init__(self, url: str, route: str, body: Any = None, sent_before: int = 0) -> None:
        address = httpx.URL(url)
        self._socket = socket.create_connection((address.host, address.port))
        for _ in range(sent_before):
            self._send("step", {})
            self._answer()
        self._send(route, body or {})

    def _send(self, route: str, body: Any) -> None:
        content = json.dumps(body).encode()
        self._socket.sendall(
            b"POST /api/v1/%s HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer %s\r\n"
            b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n%s"
            % (route.encode(), TOKEN.encode(), len(content), content)
        )

    def _answer(self) -> None:
        response = http.client.HTTPResponse(self._socket)
        response.begin()
        assert response.status == 200
        response.read()

    def hang_up(self) -> None:
        self._socket.close()


TURN = {"action": "move_angle", "arguments": {"angle": 36000.0}}


def moving(served: Served) -> bool:
    return served.run.progress.steps == 1


@pytest.mark.parametrize("sent_before", [0, 2])
def test_a_real_robot_stops_for_good_when_the_solution_hangs_up(serve: Serve, sent_before: int) -> None:
    served = serve(sample_selection("sample:active", "faulty:halts"))
    with served.http() as http:
        post(http, "reset")
        solution = Impatient(served.url, "step", TURN, sent_before)
        assert eventually(lambda: moving(served))
        solution.hang_up()
        assert eventually(lambda: served.run.progress.ends_run)
        assert served.run.progress.failure is FailureClass.PLATFORM
        assert "hung up while the robot was moving" in (served.run.progress.failure_why or "")
        for _ in range(2):
            status, error = post(http, "reset")
            assert (status, error["failure"], error["ends_run"]) == (503, "platform", True)
        assert read(http.get("/api/v1/session"))[1]["progress"]["ends_run"] is True
        document = post(http, "result", {"failure": {"class": "agent", "why": "It was killed."}})[1]["document"]
        assert document["provenance"]["failure"]["class"] == "platform"


def test_a_simulator_finishes_what_a_solution_has_left_under_way(serve: Serve) -> None:
    served = serve(sample_selection("sample:active", "faulty:slow"))
    with served.http() as http:
        post(http, "reset")
        solution = Impatient(served.url, "step", {"action": "move_distance", "arguments": {"distance": 1.0}})
        assert eventually(lambda: moving(served))
        solution.hang_up()
        assert eventually(lambda: post(http, "step", {})[0] == 200)
        assert served.run.progress.pose_xyyaw[0] == pytest.approx(-1.0, abs=0.01)
        assert post(http, "reset")[1]["state"] == "clean"


def test_one_who_hangs_up_while_waiting_for_a_turn_does_not_stop_anothers_robot(serve: Serve) -> None:
    served = serve(sample_selection("sample:active", "faulty:halts"))
    with served.http() as http, served.http() as other, ThreadPoolExecutor() as executor:
        post(http, "reset")
        turning = executor.submit(post, http, "step", {"action": "move_angle", "arguments": {"angle": 90.0}})
        assert eventually(lambda: moving(served))
        Impatient(served.url, "reset").hang_up()
        assert post(other, "step", {})[0] == 409
        assert turning.result()[1]["outcome"] == "reached"
        assert eventually(lambda: post(http, "step", {})[0] == 200)
        assert served.run.progress.steps == 1
        assert not served.run.progress.ends_run


def test_a_solution_that_waits_for_its_answers_is_never_taken_for_gone(serve: Serve) -> None:
    served = serve(sample_selection("sample:active", "faulty:halts"))
    for _ in range(3):
        with served.http() as http:
            post(http, "step" if served.hosts else "reset", {})
    assert not served.run.progress.ends_run


def test_the_operator_is_asked_and_confirms_with_a_token_of_their_own(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:asks"))
    with served.http() as http, served.http(OPERATOR_TOKEN) as operator, ThreadPoolExecutor() as executor:
        status, error = post(operator, "operator", {"done": True})
        assert (status, error["title"]) == (409, "Nobody waits for the operator.")
        resetting = executor.submit(post, http, "reset")
        with served.http() as watching:

            def waiting_for() -> Any:
                return read(watching.get("/api/v1/session"))[1]["progress"]["waiting_for"]

            assert eventually(lambda: waiting_for() is not None)
            assert waiting_for() == "Carry the robot to its start."
            assert post(watching, "step", {})[0] == 409
            status, error = post(watching, "operator", {"done": True})
            assert (status, error["title"]) == (403, "Only the operator can say that this is done.")
            assert post(operator, "operator", {"done": False})[0] == 400
            assert waiting_for() is not None
            assert post(operator, "operator", {"done": True}) == (200, {"confirmed": "Carry the robot to its start."})
            assert resetting.result()[0] == 200
            assert waiting_for() is None
        assert post(operator, "reset")[0] == 401


def test_a_run_that_waits_for_the_operator_ends_at_once(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:asks"))
    with served.http() as http, served.http() as other, ThreadPoolExecutor() as executor:
        resetting = executor.submit(post, http, "reset")
        assert eventually(lambda: served.run.progress.waiting_for is not None)
        assert post(other, "stop") == (200, {"stopping": True})
        status, error = resetting.result()
    assert (status, error["title"]) == (500, "The run has ended.")
    assert served.run.progress.waiting_for is None
    assert not alive(served.hosts[0].pid)


def test_stopping_ends_the_platform_in_the_middle_of_an_action(serve: Serve) -> None:
    served = serve(sample_selection("sample:active", "faulty:halts"))
    with served.http() as http, served.http() as other, ThreadPoolExecutor() as executor:
        post(http, "reset")
        turning = executor.submit(post, http, "step", TURN)
        assert eventually(lambda: moving(served))
        assert post(other, "stop") == (200, {"stopping": True})
        # Nobody serves this run but its server: the platform ends by the request alone.
        assert eventually(lambda: not alive(served.hosts[0].pid))
        assert turning.result()[0] == 500
