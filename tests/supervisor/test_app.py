import http.client
import json
import os
import signal
import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core.errors import FailureClass
from benchbot.core.host import Host
from benchbot.core.selection import Limits
from benchbot.supervisor import server, wire
from benchbot.supervisor.app import create_app
from benchbot.supervisor.platform_host import Timeouts
from benchbot.supervisor.run import Run
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, alive, eventually, sample_selection

Serve = Callable[..., Served]
MSGPACK = {"Content-Type": "application/msgpack"}

POST_ROUTES = ["reset", "step", "next_scene", "result", "results_functions/create", "stop", "operator"]
GET_ROUTES = ["session", "events"]


def post(http: httpx.Client, route: str, body: Any = None) -> tuple[int, Any]:
    content = b"" if body is None else wire.encode(body)
    return read(http.post(f"/api/v1/{route}", content=content, headers=MSGPACK))


def read(response: httpx.Response) -> tuple[int, Any]:
    if response.headers["content-type"] == "application/json":
        return response.status_code, response.json()
    return response.status_code, wire.decode(bytearray(response.content))


def test_an_episode_takes_one_request_a_step(serve: Serve) -> None:
    with serve().http() as http:
        status, first = post(http, "reset")
        assert (status, first["state"], first["result"]) == (200, "clean", "SUCCESS")
        assert first["observations"]["image_rgb"].shape == (32, 48, 3)
        assert first["available_actions"] == ["move_next"]
        states = []
        for number in range(1, 4):
            status, step = post(http, "step", {"action": "move_next"})
            assert (status, step["steps"], step["outcome"]) == (200, number, "reached")
            states.append(step["state"])
        assert states == ["dirty", "dirty", "finished"]
        assert (step["result"], step["available_actions"]) == ("FINISHED", [])
        assert step["simulated_time_s"] > 1.0
        assert post(http, "next_scene")[1]["advanced"] is False


def test_scenes_follow_one_another(serve: Serve) -> None:
    with serve(sample_selection("sample:two_scenes", "arena:1:2")).http() as http:
        first = post(http, "reset")[1]
        second = post(http, "next_scene")[1]
        assert (second["advanced"], second["scene_number"], second["state"]) == (True, 1, "clean")
        assert not np.array_equal(first["observations"]["image_rgb"], second["observations"]["image_rgb"])
        assert post(http, "next_scene")[1]["advanced"] is False
        assert post(http, "reset")[1]["scene_number"] == 0


def test_the_session_describes_the_run_without_what_is_to_be_found_out(serve: Serve) -> None:
    with serve(sample_selection(seed=3)).http() as http:
        session = http.get("/api/v1/session", headers={"Accept": "application/json"}).json()
    assert session["task"]["name"] == "sample:passive"
    assert session["selection"] == {
        "task": "sample:passive",
        "robot": "sample_robot",
        "environment": "arena:1",
        "seed": 3,
        "limits": {"steps": None, "simulated_time_s": None, "wall_time_s": None},
    }
    assert session["actions"] == {"move_next": {"argument": None, "unit": ""}}
    assert list(session["observations"]) == session["task"]["observations"]
    assert session["results_format"]["functions"] == ["create", "create_object", "validate"]
    assert (session["started"], session["state"], session["scene_count"]) == (False, "clean", 1)
    (environment,) = session["environments"]
    assert "trajectory_poses" in environment
    assert "map_path" not in environment
    assert "options" not in environment


def test_the_true_pose_is_hidden_where_localisation_is_noisy(serve: Serve) -> None:
    with serve(sample_selection("sample:noisy")).http() as http:
        post(http, "reset")
        post(http, "step", {"action": "move_distance", "arguments": {"distance": 0.5}})
        assert read(http.get("/api/v1/session"))[1]["progress"]["pose_xyyaw"] is None
    with serve(sample_selection("sample:active")).http() as http:
        post(http, "reset")
        assert read(http.get("/api/v1/session"))[1]["progress"]["pose_xyyaw"] == pytest.approx([-2, 0, 0])


def test_two_runs_with_one_seed_show_the_same(serve: Serve) -> None:
    def digest() -> str:
        with serve(sample_selection("sample:noisy", seed=11)).http() as http:
            post(http, "reset")
            post(http, "step", {"action": "move_distance", "arguments": {"distance": 0.5}})
            post(http, "step", {"action": "move_angle", "arguments": {"angle": 30}})
            answer = post(http, "result", {"failure": {"class": "agent", "why": "enough"}})[1]
            return str(answer["document"]["provenance"]["observation_digest"])

    assert digest() == digest()


def test_a_result_is_completed_written_and_returned(serve: Serve, tmp_path: Path) -> None:
    with serve().http() as http:
        post(http, "reset")
        results = post(http, "results_functions/create", {})[1]["value"]
        claimed = {"task_details": {"name": "another"}, "environment_details": [], "results": results}
        status, answer = post(http, "result", {"result": claimed, "solution": {"command": ["me"]}})
    assert status == 200
    assert answer["document"]["task_details"]["name"] == "sample:passive"
    assert answer["document"]["provenance"]["solution"] == {"command": ["me"]}
    assert json.loads(Path(answer["path"]).read_text("utf-8")) == answer["document"]
    assert answer["path"] == str(tmp_path / "result.json")


def test_a_result_that_breaks_its_format_is_refused(serve: Serve, tmp_path: Path) -> None:
    with serve().http() as http:
        post(http, "reset")
        status, error = post(http, "result", {"result": {"results": {"objects": "none"}}})
    assert (status, error["failure"]) == (400, "agent")
    assert "object_map" in error["title"]
    assert not (tmp_path / "result.json").exists()


def test_a_failed_episode_has_a_result_too(serve: Serve) -> None:
    with serve().http() as http:
        post(http, "reset")
        failure = {"class": "timeout", "why": "The solution did not end within 5 s."}
        status, answer = post(http, "result", {"failure": failure})
    assert (status, answer["document"]["provenance"]["failure"]) == (200, failure)
    assert "results" not in answer["document"]


def test_results_functions_are_called_with_what_they_are_given(serve: Serve) -> None:
    with serve().http() as http:
        body = {"args": [], "kwargs": {"num_classes": 3}}
        assert post(http, "results_functions/create_object", body)[1]["value"]["label_probs"] == [0, 0, 0]
        assert post(http, "results_functions/no_such")[0] == 400
        status, error = post(http, "results_functions/create", {"kwargs": {"wrong": 1}})
    assert status == 400
    assert "arguments" in error["title"]


@pytest.mark.parametrize("token", ["", "wrong", TOKEN + "x", "tökén"])
def test_nothing_is_told_or_done_without_the_token(serve: Serve, token: str) -> None:
    served = serve()
    headers = [(b"Authorization", f"Bearer {token}".encode())] if token else []
    with httpx.Client(base_url=served.url, headers=headers) as http:
        responses = [http.post(f"/api/v1/{route}") for route in POST_ROUTES]
        responses += [http.get(f"/api/v1/{route}") for route in GET_ROUTES]
    assert {response.status_code for response in responses} == {401}
    assert all(response.json()["title"] for response in responses)
    assert not served.hosts
    assert not served.run.stop_asked.is_set()


def test_health_needs_no_token(serve: Serve) -> None:
    url = serve().url
    response = httpx.get(url + "/api/v1/health", headers={"Accept": "application/json"})
    assert response.json() | {"version": "x", "pid": 0} == {"name": "benchbot", "version": "x", "api": 1, "pid": 0}
    assert httpx.get(url).json() == "Hello, I am the BenchBot supervisor"


def test_json_is_read_and_written_where_there_are_no_arrays(serve: Serve) -> None:
    with serve().http() as http:
        http.headers["Accept"] = "application/json"
        assert http.post("/api/v1/results_functions/create", json={"args": []}).json()["value"]["objects"] == []
        response = http.post("/api/v1/step", json={"action": "move_next"})
    assert response.status_code == 406
    assert "MessagePack" in response.json()["title"]


def test_a_refused_answer_does_nothing(serve: Serve) -> None:
    served = serve()
    with served.http() as http:
        assert http.post("/api/v1/reset", headers={"Accept": "application/json"}).status_code == 406
    assert not served.hosts


@pytest.mark.parametrize(
    ("method", "path", "content", "content_type", "status"),
    [
        ("GET", "/api/v1/nothing", b"", "", 404),
        ("GET", "/api/v2/session", b"", "", 404),
        ("GET", "/api/v1/step", b"", "", 405),
        ("POST", "/api/v1/session", b"", "", 405),
        ("POST", "/api/v1/step", b"{}", "text/plain", 415),
        ("POST", "/api/v1/step", b"{}", "", 415),
        ("POST", "/api/v1/step", b"{", "application/json", 400),
        ("POST", "/api/v1/step", b"[" * 100_000, "application/json", 400),
        ("POST", "/api/v1/step", b'{"action": 3}', "application/json", 400),
        ("POST", "/api/v1/step", b'{"acton": "move_next"}', "application/json", 400),
        ("POST", "/api/v1/step", b'{"action": "move_next", "arguments": []}', "application/json", 400),
        ("POST", "/api/v1/reset", b'{"scene": 3}', "application/json", 400),
        ("POST", "/api/v1/result", b"{}", "application/json", 400),
        ("POST", "/api/v1/result", b'{"failure": {"class": "bad luck", "why": ""}}', "application/json", 400),
        ("POST", "/api/v1/step", b"\xc1", "application/msgpack", 400),
    ],
)
def test_a_wrong_request_is_told_what_is_wrong(
    serve: Serve, method: str, path: str, content: bytes, content_type: str, status: int
) -> None:
    served = serve()
    with served.http() as http:
        headers = {"Content-Type": content_type} if content_type else {}
        response = http.request(method, path, content=content, headers=headers)
    assert response.status_code == status
    assert set(response.json()) == {"title", "why", "fix"}
    assert not served.hosts


def test_a_step_before_the_first_reset_is_told_what_to_do(serve: Serve) -> None:
    with serve().http() as http:
        status, error = post(http, "step", {"action": "move_next"})
    assert status == 400
    assert "reset()" in error["fix"]


def test_an_agents_mistake_is_told_and_changes_nothing(serve: Serve) -> None:
    with serve(sample_selection("sample:active")).http() as http:
        post(http, "reset")
        for body in (
            {"action": "move_next"},
            {"action": "fly"},
            {"action": "move_angle", "arguments": {"angle": "far"}},
            {"action": "move_angle", "arguments": {"angle": np.ones(3)}},
            {"action": "move_angle", "arguments": {"angle": float("nan")}},
            {"action": "move_angle", "arguments": {"distance": 1}},
        ):
            status, error = post(http, "step", body)
            assert (status, error["failure"]) == (400, "agent")
        assert post(http, "step", {})[1]["state"] == "clean"


def test_a_limit_ends_the_episode(serve: Serve) -> None:
    with serve(sample_selection(limits=Limits(steps=1))).http() as http:
        post(http, "reset")
        post(http, "step", {"action": "move_next"})
        status, error = post(http, "step", {"action": "move_next"})
        assert (status, error["failure"]) == (400, "timeout")
        assert post(http, "reset")[0] == 200


@pytest.mark.parametrize("declared", [True, False])
def test_a_huge_body_is_refused(serve: Serve, declared: bool) -> None:
    size = wire.MAX_BODY_BYTES + 1

    def chunks() -> Any:
        for _ in range(size // 2**20 + 1):
            yield b"\0" * 2**20

    with serve().http() as http:
        content = b"\0" * size if declared else chunks()
        response = http.post("/api/v1/step", content=content, headers=MSGPACK)
    assert response.status_code == 413


def test_any_body_at_all_gets_an_answer(serve: Serve) -> None:
    served = serve()
    routes = st.sampled_from([route for route in POST_ROUTES if route != "stop"])
    types = st.sampled_from(["application/msgpack", "application/json", "text/html"])
    shaped = st.dictionaries(
        st.sampled_from(["action", "arguments", "result", "failure", "args", "kwargs"]),
        st.none() | st.text(max_size=5) | st.lists(st.integers(0, 9), max_size=3) | st.just({"class": "agent"}),
    ).map(wire.encode)
    with served.http() as http:

        @settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
        @given(routes, types, st.binary(max_size=100) | shaped)
        def check(route: str, content_type: str, content: bytes) -> None:
            response = http.post(f"/api/v1/{route}", content=content, headers={"Content-Type": content_type})
            assert response.status_code in ((403,) if route == "operator" else (200, 400, 415))
            if response.status_code != 200:
                assert {"title", "why", "fix"} <= set(response.json())

        check()


def test_there_is_one_robot_and_one_request_at_a_time(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:hang"))
    answers: list[tuple[int, Any]] = []
    with served.http() as http, served.http() as other:
        post(http, "reset")
        post(http, "step", {})

        def hang() -> None:
            answers.append(post(http, "step", {}))

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
