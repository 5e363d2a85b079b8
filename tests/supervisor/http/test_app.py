import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core import randomness
from benchbot.core.request import Limits
from benchbot.wire import encoding
from tests.supervisor.harness import TOKEN, Served, sample_selection

Serve = Callable[..., Served]
SECRET = 16 * "a5"
MSGPACK = {"Content-Type": "application/msgpack"}

POST_ROUTES = ["reset", "step", "next_scene", "result", "results_functions/create", "stop", "operator"]
GET_ROUTES = ["session", "events"]


def post(http: httpx.Client, route: str, body: Any = None) -> tuple[int, Any]:
    content = b"" if body is None else encoding.encode(body)
    return read(http.post(f"/api/v1/{route}", content=content, headers=MSGPACK))


def read(response: httpx.Response) -> tuple[int, Any]:
    if response.headers["content-type"] == "application/json":
        return response.status_code, response.json()
    return response.status_code, encoding.decode(bytearray(response.content))


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
    with serve(sample_selection(seed=3, secret=SECRET)).http() as http:
        session = http.get("/api/v1/session", headers={"Accept": "application/json"}).json()
    assert session["task"]["name"] == "sample:passive"
    assert session["selection"] == {
        "task": "sample:passive",
        "robot": "sample_robot",
        "environment": "arena:1",
        "commitment": randomness.commitment(SECRET, 3),
        "episode": None,
        "settings": {},
        "limits": {"steps": None, "simulated_time_s": None, "wall_time_s": None, "restarts": None},
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
    with serve(sample_selection(seed=3, secret=SECRET)).http() as http:
        post(http, "reset")
        results = post(http, "results_functions/create", {})[1]["value"]
        claimed = {"task_details": {"name": "another"}, "environment_details": [], "results": results}
        status, answer = post(http, "result", {"result": claimed, "solution": {"command": ["me"]}})
    assert status == 200
    assert answer["document"]["task_details"]["name"] == "sample:passive"
    assert answer["document"]["provenance"]["solution"] == {"command": ["me"]}
    assert answer["path"] == str(tmp_path / "result.json")
    kept = json.loads(Path(answer["path"]).read_text("utf-8"))
    # A solution may go on driving: what it could foresee with them is kept from it.
    assert (kept["provenance"]["selection"].pop("seed"), kept["provenance"]["selection"].pop("secret")) == (3, SECRET)
    assert kept == answer["document"]


def test_a_result_that_breaks_its_format_is_refused(serve: Serve, tmp_path: Path) -> None:
    with serve().http() as http:
        post(http, "reset")
        status, error = post(http, "result", {"result": {"results": {"objects": "none"}}})
    assert (status, error["failure"]) == (400, "agent")
    assert "object_map" in error["title"]
    assert not (tmp_path / "result.json").exists()


@pytest.mark.parametrize(("task", "told"), [("sample:noisy", False), ("sample:active", True)])
def test_the_true_way_of_all_attempts_is_hidden_where_localisation_is_noisy(
    serve: Serve, task: str, told: bool
) -> None:
    with serve(sample_selection(task)).http() as http:
        for _ in range(2):
            post(http, "reset")
            post(http, "step", {"action": "move_distance", "arguments": {"distance": 0.2}})
        session = http.get("/api/v1/session", headers={"Accept": "application/json"}).json()
        _, answer = post(http, "result", {"failure": {"class": "agent", "why": "It is tired."}})
    assert "path_length_m" not in session["progress"]["spent"]
    assert ("spent" in answer["document"]["provenance"]) is told
    kept = json.loads(Path(answer["path"]).read_text("utf-8"))["provenance"]["spent"]
    assert kept["path_length_m"] == pytest.approx(0.4, abs=0.1)


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


def test_a_task_without_a_format_has_no_results_functions_and_says_so(serve: Serve) -> None:
    with serve(sample_selection("sample:goal")).http() as http:
        status, error = post(http, "results_functions/create")

    assert status == 404
    assert (error["title"], error["why"]) == (
        "There is no results function 'create'.",
        "The task 'sample:goal' has no results format.",
    )


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
        for again in ("reset", "next_scene", "step"):
            status, error = post(http, again)
            assert (status, error["failure"], "limit of 1 steps" in error["why"]) == (400, "timeout", True)


def test_a_restart_that_the_limits_forbid_is_refused_and_the_robot_goes_on(serve: Serve) -> None:
    with serve(sample_selection("sample:active", limits=Limits(restarts=1))).http() as http:
        move = {"action": "move_distance", "arguments": {"distance": 0.1}}
        for _ in range(2):
            assert post(http, "reset")[0] == 200
            post(http, "step", move)
        status, error = post(http, "reset")
        assert (status, error["title"]) == (400, "The robot may not be put back again.")
        assert post(http, "step", move)[1]["state"] == "dirty"
        session = http.get("/api/v1/session", headers={"Accept": "application/json"}).json()
    spent = session["progress"]["spent"]
    assert (session["progress"]["steps"], spent["steps"], spent["restarts"]) == (2, 3, 1)


@pytest.mark.parametrize("declared", [True, False])
def test_a_huge_body_is_refused(serve: Serve, declared: bool) -> None:
    size = encoding.MAX_BODY_BYTES + 1

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
    ).map(encoding.encode)
    with served.http() as http:

        @settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
        @given(routes, types, st.binary(max_size=100) | shaped)
        def check(route: str, content_type: str, content: bytes) -> None:
            response = http.post(f"/api/v1/{route}", content=content, headers={"Content-Type": content_type})
            assert response.status_code in ((403,) if route == "operator" else (200, 400, 415))
            if response.status_code != 200:
                assert {"title", "why", "fix"} <= set(response.json())

        check()
