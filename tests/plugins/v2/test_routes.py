import http.client
import json
import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from benchbot.core import results
from benchbot.core.request import Limits
from benchbot.wire import encoding
from tests.plugins.v2.v2_client import COLLISION, FINISHED, SUCCESS, get, run_agent, v2
from tests.supervisor.harness import Served, eventually, sample_selection

Serve = Callable[..., Served]

JSON, HTML = "application/json", "text/html; charset=utf-8"
OBSERVATIONS = [
    "image_rgb",
    "image_rgb_info",
    "image_depth",
    "image_depth_info",
    "image_segment",
    "image_segment_info",
    "laser",
    "poses",
]

pytestmark = pytest.mark.filterwarnings("ignore:keys will default:DeprecationWarning")


Said = tuple[str, Any, int, str, bytes | None]

ROBOT_STATES: list[Said] = [
    ("/robot/is_collided", {}, 200, JSON, b'{"is_collided":false}\n'),
    ("/robot/is_finished", {}, 200, JSON, b'{"is_finished":false}\n'),
]
OBSERVED: list[Said] = [
    ("/config/task/observations", {}, 200, JSON, json.dumps(OBSERVATIONS, separators=(",", ":")).encode() + b"\n"),
    *(("/connections/" + name, {}, 200, HTML, None) for name in OBSERVATIONS),
]


def selected(number: int) -> Said:
    content = b'{"name":"arena","number":%d,"variant":%d}\n' % (number, number + 1)
    return ("/robot/selected_environment", {}, 200, JSON, content)


STEPPED: list[Said] = [
    *ROBOT_STATES,
    ("/config/task/actions", {}, 200, JSON, b'["move_next"]\n'),
    ("/connections/move_next", {}, 200, HTML, b"null"),
    *ROBOT_STATES,
    *OBSERVED,
]
TRANSCRIPT: list[Said] = [
    ("//", {}, 200, JSON, b'"Hello, I am the BenchBot supervisor"\n'),
    ("/robot/is_running", {}, 200, JSON, b'{"is_running":true}\n'),
    ("/config/robot", {}, 200, JSON, None),
    selected(0),
    ("/robot/is_dirty", {}, 200, JSON, b'{"is_dirty":false}\n'),
    *ROBOT_STATES,
    *OBSERVED,
    selected(0),
    *STEPPED,
    selected(0),
    ("/robot/is_dirty", {}, 200, JSON, b'{"is_dirty":true}\n'),
    ("/robot/reset", {}, 200, JSON, b'{"reset_success":true}\n'),
    *ROBOT_STATES,
    *OBSERVED,
    selected(0),
    ("/robot/is_collided", {}, 200, JSON, b'{"is_collided":false}\n'),
    ("/robot/next", {}, 200, JSON, b'{"next_success":true}\n'),
    ("/robot/is_dirty", {}, 200, JSON, b'{"is_dirty":false}\n'),
    *ROBOT_STATES,
    *OBSERVED,
    selected(1),
    *STEPPED,
    selected(1),
    ("/robot/is_collided", {}, 200, JSON, b'{"is_collided":false}\n'),
    ("/robot/next", {}, 200, JSON, b'{"next_success":false}\n'),
    ("/config/task", {}, 200, JSON, None),
    ("/config/environments", {}, 200, JSON, None),
    ("/results_functions/create", {}, 200, JSON, None),
    ("/results_functions//", {}, 200, JSON, b'["create","create_object","validate"]\n'),
    ("/results_functions//create_object", {"args": [], "kwargs": {"num_classes": 2}}, 200, JSON, None),
    ("/results_functions//validate", None, 200, JSON, b"null\n"),
]


def test_a_session_of_v2s_client_is_answered_to_the_byte(serve: Serve) -> None:
    with v2(serve(sample_selection("sample:two_scenes", "arena:1:2"), open_to_v2=True)) as bench:
        bench.start()
        bench.step("move_next")
        bench.reset()
        assert bench.next_scene()
        bench.reset()
        bench.step("move_next")
        assert not bench.next_scene()
        empty = bench.empty_results()
        functions = bench.results_functions()
        assert functions["create_object"](num_classes=2)["label_probs"] == [0, 0]
        assert functions["validate"](empty["results"]) is None
    assert len(bench.transcript) == len(TRANSCRIPT)
    for said, expected in zip(bench.transcript, TRANSCRIPT, strict=True):
        assert said[0] == expected[0]
        assert expected[1] in (said[1], None)
        assert said[2:4] == expected[2:4]
        assert expected[4] in (said[4], None)


def test_hello_passive_comes_to_a_result_that_is_read(serve: Serve, tmp_path: Path) -> None:
    with v2(serve(sample_selection("sample:two_scenes", "arena:1:2"), open_to_v2=True)) as bench:
        bench.start()
        result = run_agent(bench)
    path = tmp_path / "benchbot_result"
    path.write_text(json.dumps(result), "utf-8")
    document = results.read(path)
    assert document["results"]["objects"] == []
    assert [scene["variant"] for scene in document["environment_details"]] == [1, 2]
    steps = [path for path, *_ in bench.transcript if path == "/connections/move_next"]
    assert len(steps) == 6


def test_a_second_solution_begins_in_the_first_scene(serve: Serve) -> None:
    served = serve(sample_selection("sample:two_scenes", "arena:1:2"), open_to_v2=True)
    with v2(served) as first:
        first.start()
        assert first.next_scene()
    with v2(served) as second:
        second.start()
        observations, result = second.reset()
        assert (observations["scene_number"], result) == (0, SUCCESS)
        assert len(run_agent(second)["environment_details"]) == 2


def test_v2s_client_sees_what_ours_sees(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        theirs, _ = bench.step("move_angle", angle=30)
    with served.http() as http:
        ours = encoding.decode(http.post("/api/v1/step").content)["observations"]
    assert np.array_equal(theirs["image_rgb"], ours["image_rgb"])
    for name in ("image_rgb_info", "image_depth_info", "image_segment", "image_segment_info", "laser"):
        np.testing.assert_equal(theirs[name], ours[name])
    assert theirs["image_depth"].dtype == np.float32
    np.testing.assert_array_equal(theirs["image_depth"], ours["image_depth"])
    assert list(theirs["poses"]) == list(ours["poses"])
    for frame, pose in theirs["poses"].items():
        assert type(pose["rotation_rpy"]) is tuple
        np.testing.assert_equal(pose["rotation_xyzw"], ours["poses"][frame]["rotation_xyzw"])
        np.testing.assert_equal(np.array(pose["rotation_rpy"]), ours["poses"][frame]["rotation_rpy"])


def test_the_observations_between_two_actions_are_of_one_instant(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        bench.step(None)
        assert served.run.progress.frames == 1
        first = bench.query("/connections/poses")
        bench.step("move_distance", distance=0.2)
        bench.step(None)
        assert served.run.progress.frames == 2
        moved = bench.query("/connections/poses")
    shift = moved["base_link"]["translation_xyz"] - first["base_link"]["translation_xyz"]
    np.testing.assert_allclose(shift, [0.2, 0.0, 0.0], atol=0.01)


def test_the_world_around_a_real_robot_is_looked_at_again(serve: Serve) -> None:
    served = serve(sample_selection("sample:active", robot="sample_real_robot"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        assert served.run.progress.frames == 1
        bench.step(None)
        assert served.run.progress.frames == 2


def test_observations_follow_a_robot_that_another_client_has_moved(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"), open_to_v2=True)
    with v2(served) as bench, served.http() as http:
        bench.start()
        before = bench.query("/connections/poses")["base_link"]["translation_xyz"]
        http.post("/api/v1/step", json={"action": "move_distance", "arguments": {"distance": 0.2}})
        after = bench.query("/connections/poses")["base_link"]["translation_xyz"]
    assert after[0] - before[0] == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize("way_back", ["reset", "restart"])
def test_after_the_second_scene_a_reset_shows_the_first_one(serve: Serve, way_back: str) -> None:
    served = serve(sample_selection("sample:two_scenes", "arena:1:2"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        first, _ = bench.step(None)
        assert bench.next_scene()
        second, _ = bench.step("move_next")
        assert second["scene_number"] == 1
        assert bench.query(f"/robot/{way_back}") == {f"{way_back}_success": True}
        again, _ = bench.step(None)
    assert again["scene_number"] == 0
    assert np.array_equal(again["image_rgb"], first["image_rgb"])
    assert not np.array_equal(again["image_rgb"], second["image_rgb"])


def test_each_scene_has_its_own_initial_pose(serve: Serve) -> None:
    served = serve(sample_selection("sample:two_scenes", "arena:1:2"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        bench.step("move_next")
        assert bench.next_scene()
        observations, _ = bench.reset()
    poses = observations["poses"]
    np.testing.assert_allclose(poses["initial_pose"]["translation_xyz"], poses["base_link"]["translation_xyz"])


def test_a_collision_is_told_and_a_reset_is_the_way_back(serve: Serve) -> None:
    with v2(serve(sample_selection("sample:active"), open_to_v2=True)) as bench:
        bench.start()
        _, result = bench.step("move_distance", distance=100.0)
        assert result == COLLISION
        assert bench.actions == []
        with pytest.raises(ConnectionError, match="out of reach after a collision"):
            bench.query("/robot/next")
        assert bench.reset()[1] == SUCCESS
        assert bench.actions == ["move_distance", "move_angle"]


@pytest.mark.parametrize("way_back", ["reset", "restart"])
@pytest.mark.parametrize(
    ("limits", "why"), [(Limits(restarts=1), "may not be put back again"), (Limits(steps=2), "reached its limit")]
)
def test_limits_count_over_resets(serve: Serve, way_back: str, limits: Limits, why: str) -> None:
    with v2(serve(sample_selection("sample:active", limits=limits), open_to_v2=True)) as bench:
        bench.start()
        bench.step("move_distance", distance=0.1)
        assert bench.query(f"/robot/{way_back}") == {f"{way_back}_success": True}
        bench.step("move_distance", distance=0.1)
        with pytest.raises(ConnectionError, match=why):
            bench.query(f"/robot/{way_back}")


def test_the_end_of_the_trajectory_is_told_and_not_passed(serve: Serve) -> None:
    served = serve(open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        results_of_steps = [bench.step("move_next")[1] for _ in range(3)]
        assert results_of_steps == [SUCCESS, SUCCESS, FINISHED]
        assert bench.query("/robot/is_finished") == {"is_finished": True}
    status, error = get(served, "/connections/move_next")
    assert (status, error["title"]) == (400, "Action 'move_next' is unavailable due to: FINISHED.")


def test_the_states_answer_before_anything_has_started(serve: Serve) -> None:
    served = serve(open_to_v2=True)
    with v2(served) as bench:
        assert bench.query("/robot/is_running") == {"is_running": True}
        assert bench.query("/robot/is_dirty") == {"is_dirty": False}
        assert bench.query("/robot/next") == {"next_success": False}
        assert bench.query("/robot/") == "Hello, I am the BenchBot robot controller"
        assert not served.hosts
        assert bench.query("/robot/prepare") == {"prepare_success": True}
        assert bench.query("/robot/start") == {"start_success": True}
        assert bench.query("/robot/start") == {"start_success": False}


def test_a_stopped_robot_does_nothing_until_it_is_started(serve: Serve) -> None:
    served = serve(sample_selection("sample:active"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        bench.step("move_distance", distance=0.2)
        assert bench.query("/robot/stop") == {"stop_success": True}
        assert bench.query("/robot/is_running") == {"is_running": False}
        assert bench.query("/robot/is_dirty") == {"is_dirty": False}
        for name in ("laser", "move_angle"):
            status, error = get(served, f"/connections/{name}")
            assert (status, error["title"]) == (400, "The robot is stopped.")
        assert bench.query("/robot/start") == {"start_success": True}
        assert bench.query("/robot/is_running") == {"is_running": True}
        assert bench.step(None)[1] == SUCCESS


def test_the_configuration_is_a_tree(serve: Serve) -> None:
    with v2(serve(open_to_v2=True)) as bench:
        whole = bench.query("/config/")
        assert list(whole) == ["environments", "results", "robot", "task"]
        assert bench.query("/config/task/actions") == ["move_next"] == whole["task"]["actions"]
        assert bench.query("/config/task/scene_count") == 1
        assert bench.query("/robot/config") == whole
        assert whole["results"]["name"] == "object_map"
        assert whole["robot"]["connections"]["image_rgb"]["callback_api"] == "api_callbacks.convert_to_rgb"
        assert not {"map_path", "options"} & set(whole["environments"][0])


@pytest.mark.parametrize(
    ("path", "body", "status"),
    [
        ("/config/nothing", {}, 404),
        ("/config/task/actions/0", {}, 404),
        ("/config/task/", {}, 404),
        ("/connections/nothing", {}, 404),
        ("/connections/move_angle", {}, 404),
        ("/connections/imu", {}, 404),
        ("/connections/move_next", {"distance": 1}, 400),
        ("/connections/move_next", [], 400),
        ("/connections/laser", {"range": 1}, 400),
        ("/results_functions/nothing", {}, 404),
        ("/results_functions/create", {"args": {}}, 400),
        ("/results_functions/create", {"wrong": []}, 400),
        ("/results_functions/create", {"kwargs": {"wrong": 1}}, 400),
        ("/results_functions/create_object", {"kwargs": {"num_classes": 10**12}}, 400),
        ("/results_functions/validate", {"args": [{"objects": 3}]}, 400),
        ("/robot/nothing", {}, 404),
        ("/robot/configure", {}, 404),
        ("/simulator/is_dirty", {}, 404),
    ],
)
def test_a_wrong_query_is_told_what_is_wrong(serve: Serve, path: str, body: Any, status: int) -> None:
    said, error = get(serve(open_to_v2=True), path, body)
    assert said == status
    assert error["title"]
    assert error["fix"]


def test_a_dead_platform_is_told_and_a_reset_starts_another(serve: Serve) -> None:
    served = serve(sample_selection(environment="faulty:crash"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
        bench.step("move_next")
        with pytest.raises(ConnectionError, match="503"):
            bench.step("move_next")
        observations, result = bench.reset()
    assert (sorted(observations), result) == (sorted([*OBSERVATIONS, "scene_number"]), SUCCESS)
    assert len(served.hosts) == 2


def test_a_real_robot_stops_when_v2s_client_hangs_up(serve: Serve) -> None:
    served = serve(sample_selection("sample:active", "faulty:halts"), open_to_v2=True)
    with v2(served) as bench:
        bench.start()
    address = httpx.URL(served.url)
    with socket.create_connection((address.host, address.port or 80)) as solution:
        body = b'{"angle": 36000.0}'
        solution.sendall(
            b"GET /connections/move_angle HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            b"Content-Length: %d\r\n\r\n%s" % (len(body), body)
        )
        assert eventually(lambda: served.run.progress.steps == 1)
    assert eventually(lambda: served.run.progress.ends_run)
    status, error = get(served, "/robot/reset")
    assert (status, error["ends_run"]) == (503, True)


def test_a_hundred_observers_are_served_while_a_solution_runs(serve: Serve) -> None:
    served = serve(open_to_v2=True)
    paths = ["/connections/image_rgb", "/connections/poses", "/robot/is_dirty", "/config/task", "/results_functions/"]
    there = threading.Barrier(101)

    def observe() -> set[int]:
        statuses = set()
        with closing(http.client.HTTPConnection(served.url.partition("//")[2], timeout=60)) as connection:
            there.wait(60)
            for path in paths:
                connection.request("GET", path, b"{}", {"Content-Type": JSON})
                response = connection.getresponse()
                response.read()
                statuses.add(response.status)
        return statuses

    with v2(served) as bench, ThreadPoolExecutor(100) as observers:
        bench.start()
        observing = [observers.submit(observe) for _ in range(100)]
        there.wait(60)
        moves = [bench.query("/connections/move_next") for _ in range(3)]
        assert {status for future in observing for status in future.result()} == {200}
    assert moves == [None] * 3
    assert served.run.progress.frames == 4
