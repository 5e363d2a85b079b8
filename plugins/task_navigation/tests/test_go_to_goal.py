"""The example: it reaches its goals in the sample arena, learns from what stops it, and gives up in the end."""

import json
import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from benchbot.api import ActionResult, Observations
from benchbot.core import results
from benchbot.core.channels import LaserScan
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.geometry import Pose
from benchbot.core.session import Session
from benchbot_task_navigation.evaluator import evaluate
from benchbot_task_navigation.examples.go_to_goal import BACK_OFF_M, Driver, GoToGoal
from plugins.task_navigation.tests.floors import arena_session, arena_truth

NOTHING_SEEN = np.empty((0, 2))


def drive(session: Session, tmp_path: Path) -> Any:
    """Have the example drive; return the result that it hands in, completed."""
    robot = session.selection.robot.data
    agent = GoToGoal(robot["footprint"]["radius_m"], robot["robot_frame"])
    step = session.reset()
    while not agent.is_done(ActionResult[step.result.name]):
        step = session.step(*agent.pick_action(cast(Observations, step.observations), step.actions))
    path = tmp_path / "result.json"
    agent.save_result(str(path), results.empty_result(session.selection), {})
    return results.finish(json.loads(path.read_text()), session)


@pytest.mark.parametrize("episode", [0, 1, 2])
@pytest.mark.parametrize("localisation", ["ground_truth", "dead_reckoning"])
def test_it_reaches_its_goal_by_about_the_shortest_way(episode: int, localisation: str, tmp_path: Path) -> None:
    session = arena_session(episode, f"navigation:point_goal:{localisation}:laser")
    scores = evaluate(drive(session, tmp_path), [arena_truth()])

    assert scores["success"] == 1.0
    assert scores["SPL"] > 0.75
    assert scores["collisions"] == 0


def test_the_same_episode_and_seed_give_the_same_track(tmp_path: Path) -> None:
    task = "navigation:point_goal:dead_reckoning:laser"
    first, second = (drive(arena_session(1, task), tmp_path) for _ in range(2))

    assert first["track"] == second["track"]
    assert first["provenance"]["observation_digest"] == second["provenance"]["observation_digest"]


def test_the_goal_is_where_the_start_says() -> None:
    assert Driver((1.0, 2.0, math.radians(90)), [3.0, 1.0], 0.2).goal == pytest.approx((0.0, 5.0))


def test_where_nothing_is_seen_it_turns_to_the_goal_and_drives() -> None:
    driver = Driver((0.0, 0.0, 0.0), [0.0, 2.0], 0.2)

    assert driver.next_move((0.0, 0.0, 0.0), NOTHING_SEEN) == ("move_angle", {"angle": 90.0})
    action, arguments = driver.next_move((0.0, 0.0, math.pi / 2), NOTHING_SEEN) or ("", {})
    assert action == "move_distance"
    assert 0 < arguments["distance"] <= 2.0
    assert driver.next_move((0.0, 1.95, math.pi / 2), NOTHING_SEEN) is None


def test_what_stops_it_is_in_the_way_from_then_on() -> None:
    driver = Driver((0.0, 0.0, 0.0), [2.0, 0.0], 0.2)
    ahead = (0.0, 0.0, 0.0)
    assert driver.next_move(ahead, NOTHING_SEEN) == ("move_distance", {"distance": 0.6})

    action, arguments = driver.next_move(ahead, NOTHING_SEEN) or ("", {})
    assert action == "move_angle"
    assert abs(arguments["angle"]) > 20


def test_stopped_again_and_again_it_backs_off() -> None:
    driver = Driver((0.0, 0.0, 0.0), [2.0, 0.0], 0.2)
    x, y, yaw_rad = 0.0, 0.0, 0.0
    moves = []
    for _ in range(12):
        _, arguments = driver.next_move((x, y, yaw_rad), NOTHING_SEEN) or ("done", {})
        moves.append(arguments.get("distance"))
        yaw_rad += math.radians(arguments.get("angle", 0.0))

    assert -BACK_OFF_M in moves


def test_walled_in_it_gives_up() -> None:
    angles = np.linspace(0, 2 * math.pi, 200)
    wall = 0.5 * np.stack([np.cos(angles), np.sin(angles)], 1)

    assert Driver((0.0, 0.0, 0.0), [3.0, 0.0], 0.2).next_move((0.0, 0.0, 0.0), wall) is None


def test_a_way_that_leads_far_aside_is_found() -> None:
    # The wall is longer than the floor that it plans on at first; its end is 7 m to the left.
    wall = np.stack([np.full(400, 1.0), np.linspace(-20.0, 7.0, 400)], 1)
    driver = Driver((0.0, 0.0, 0.0), [2.0, 0.0], 0.2)

    action, arguments = driver.next_move((0.0, 0.0, 0.0), wall) or ("", {})

    assert action == "move_angle"
    assert 60 < arguments["angle"] < 110


def test_it_takes_no_more_than_its_budget_of_steps() -> None:
    agent = GoToGoal(0.2, "base_link", step_budget=4)
    still = Pose().record("map")
    poses = {"base_link": still, "lidar": still, "initial_pose": still}
    laser: LaserScan = {"scans": np.array([[np.inf, 0.0]]), "range_min": 0.1, "range_max": 10.0}
    steps = 0
    while not agent.is_done(ActionResult.SUCCESS):
        agent.pick_action({"poses": poses, "laser": laser, "goal": np.array([2.0, 0.0])}, [])
        steps += 1

    assert steps == 4
    assert agent.is_done(ActionResult.COLLISION)


def test_a_goal_that_is_no_point_is_refused_in_words() -> None:
    still = Pose().record("map")
    with pytest.raises(BenchbotError, match="drives to points only") as refused:
        GoToGoal(0.2, "base_link").pick_action({"poses": {"base_link": still, "lidar": still}, "goal": "chair"}, [])
    assert "'chair'" in refused.value.why
    assert refused.value.failure is FailureClass.AGENT
