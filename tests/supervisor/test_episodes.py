"""Over the wire: the goal of an episode is shown, where the robot really went is not, before a result is handed in."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchbot.wire import encoding
from tests.supervisor.harness import Served, sample_selection
from tests.supervisor.http.test_app import post, read

Serve = Callable[..., Served]


def test_a_solution_is_shown_the_goal_and_told_the_episodes_number(serve: Serve) -> None:
    served = serve(sample_selection("sample:goal", episode=1))
    with served.http() as http:
        observations = post(http, "reset")[1]["observations"]
        session = read(http.get("/api/v1/session"))[1]

    assert list(observations) == ["laser", "poses", "goal"]
    assert observations["goal"].shape == (2,)
    assert np.linalg.norm(observations["goal"]) == pytest.approx(2.0, abs=0.01)
    assert session["selection"]["episode"] == 1
    assert "goal" in session["observations"]
    assert "shortest_path_m" not in str(session)


def test_the_clients_of_v2_find_the_goal_among_the_connections(serve: Serve) -> None:
    served = serve(sample_selection("sample:goal"))
    with served.http() as http:
        configuration = http.request("GET", "/config/", json={}).json()
        goal = http.request("GET", "/connections/goal", json={}).json()

    assert "goal" in configuration["robot"]["connections"]
    assert len(goal["values"]) == 2


@pytest.mark.parametrize(("task", "tells"), [("sample:goal", True), ("sample:lost", False)])
def test_the_track_is_told_with_the_result_where_the_task_tells_true_poses(
    serve: Serve, tmp_path: Path, task: str, tells: bool
) -> None:
    with serve(sample_selection(task)).http() as http:
        said = [
            post(http, "reset")[1],
            post(http, "step", {"action": "move_distance", "arguments": {"distance": 0.1}})[1],
        ]
        said.append(read(http.get("/api/v1/session"))[1])
        assert all("track" not in answer and "track" not in answer.get("progress", {}) for answer in said)
        document = post(http, "result", {"result": {"results": None}})[1]["document"]

    kept = json.loads((tmp_path / "result.json").read_text())
    assert ("track" in document) == tells
    assert len(kept["track"][0]["rows"]) > 2
    assert encoding.encode(kept)
