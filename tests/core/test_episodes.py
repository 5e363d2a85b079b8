"""Episodes: which one a run has, where it starts, what the solution is shown, and what pins it."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core import episodes
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.plugin_manager import Plugins, installed, load
from benchbot.core.provenance import distributions_used
from benchbot.core.request import RunRequest
from benchbot.core.selection import Selection, select
from tests.core.test_track import started
from tests.plugin_factory import DECLARES, PluginFactory


def chosen(episode: int | None = None, task: str = "sample:goal", environment: str = "arena:1") -> Selection:
    return select(
        Catalog(load()), RunRequest(task=task, robot="sample_robot", environment=environment, episode=episode)
    )


def listed(**changes: Any) -> dict[str, Any]:
    goal = {"position": [1.0, 2.0, 0.0]}
    episode = {"id": "a", "start_pose": [1, 0, 0, 0, 0, 0, 0], "goal": goal, "shortest_path_m": 2.5}
    document = {"version": 1, "task": "point_goal", "environment": "room:1", "robot_radius_m": 0.3}
    return {**document, "success_distance_m": 0.2, "episodes": [episode], **changes}


def test_a_run_has_the_first_episode_unless_it_is_told_another() -> None:
    assert [chosen(number).episode.number for number in (None, 0, 2)] == [0, 0, 2]  # type: ignore[union-attr]
    assert chosen(task="sample:active").episode is None
    assert [chosen(2).request.episode, chosen(task="sample:active").request.episode] == [2, None]


def test_the_scene_starts_where_the_episode_does(tmp_path: Path) -> None:
    selection = chosen(1)
    session = started(selection, tmp_path)

    assert selection.episode is not None
    assert selection.environments[0].data["start_pose"] == selection.episode.data["start_pose"]
    assert session.progress.pose_xyyaw[:2] == tuple(selection.episode.data["start_pose"][4:6])
    # The declaration itself is as it was: another run may take another episode.
    assert Catalog(load()).get("environments", "arena:1").data["start_pose"] == [1, 0, 0, 0, -2, 0, 0]


def test_a_solution_sees_the_goal_from_its_start_and_nothing_else_of_the_episode(tmp_path: Path) -> None:
    selection = chosen()
    step = started(selection, tmp_path).step(None)

    assert list(step.observations) == ["laser", "poses", "goal"]
    assert selection.episode is not None
    start = Pose.from_wxyz_xyz(selection.episode.data["start_pose"])
    goal = step.observations["goal"]
    assert isinstance(goal, np.ndarray)
    x, y = goal
    there = start @ Pose.planar(float(x), float(y), 0.0)
    np.testing.assert_allclose(there.translation_xyz, selection.episode.data["goal"]["position"], atol=1e-6)
    assert goal.dtype == np.float64


def test_forward_is_x_and_left_is_y() -> None:
    half = math.radians(90) / 2
    facing_up = [math.cos(half), 0, 0, math.sin(half), 1.0, 1.0, 0.0]
    entry = {"id": "a", "start_pose": facing_up, "goal": {"position": [0.0, 3.0, 0.0]}, "shortest_path_m": 3.0}
    declared = Declaration("episodes", "point_goal:room:1", Path("x.json"), "acme", listed(episodes=[entry]))

    np.testing.assert_allclose(episodes.Episode(declared, 0).goal, [2.0, 1.0], atol=1e-12)


def test_an_object_goal_is_the_name_of_its_class(tmp_path: Path) -> None:
    box = {"centroid": [1, 1, 1], "extent": [1, 1, 1]}
    entry = {**listed()["episodes"][0], "goal": {"class": "chair", "instances": [box]}}
    declared = Declaration("episodes", "object_goal:room:1", Path("x.json"), "acme", listed(episodes=[entry]))

    session = started(replace(chosen(), episode=episodes.Episode(declared, 0)), tmp_path)

    assert session.step(None).observations["goal"] == "chair"
    assert schema.problems(declared.data, "episodes", declared.path) == []


def test_a_result_names_its_episode_and_the_content_of_its_list() -> None:
    episode = chosen(2).episode
    assert episode is not None
    said = episode.provenance()

    assert (said["list"], said["number"], said["id"]) == ("point_goal:arena:1", 2, "point_goal/arena_1/002")
    reordered = json.loads(json.dumps(dict(reversed(episode.listed.data.items()))))
    assert said["sha256"] == episodes.digest(reordered)
    assert said["sha256"] != episodes.digest({**episode.listed.data, "robot_radius_m": 0.21})


def test_a_number_that_there_is_not_is_refused_with_the_range() -> None:
    with pytest.raises(BenchbotError, match="no episode 3 in 'arena:1'") as caught:
        chosen(3)
    assert "0 to 2" in caught.value.why


def test_a_task_without_episodes_takes_no_number() -> None:
    with pytest.raises(BenchbotError, match="'sample:active' has no episodes"):
        chosen(0, task="sample:active")


def test_an_environment_without_episodes_is_refused_and_others_named() -> None:
    with pytest.raises(BenchbotError, match="no episodes of the task 'sample:goal' in 'arena:2'") as caught:
        chosen(environment="arena:2")
    assert "arena:1" in caught.value.why


def test_a_robot_that_is_wider_than_the_paths_is_refused() -> None:
    catalog = Catalog(load())
    task, robot = catalog.get("tasks", "sample:goal"), catalog.get("robots", "sample_robot")
    wide = replace(robot, data={**robot.data, "footprint": {"radius_m": 0.5}})

    with pytest.raises(BenchbotError, match="too wide"):
        episodes.choose(catalog, task, wide, catalog.get("environments", "arena:1"), 0)


def test_lists_come_from_plugins_and_count_among_what_was_used(plugin_factory: PluginFactory) -> None:
    document = json.dumps(listed())
    plugin_factory.make("acme-lists", DECLARES.format(kind="episodes"), {"episodes/room.json": document})
    catalog = Catalog(Plugins([info for info in installed() if info.distribution == "acme-lists"]))

    assert catalog.names("episodes") == ["point_goal:room:1"]
    assert catalog.get("episodes", "point_goal:room:1").distribution == "acme-lists"
    foreign = replace(chosen(), episode=episodes.Episode(catalog.get("episodes", "point_goal:room:1"), 0))
    assert "acme-lists" in distributions_used(foreign)


@pytest.mark.parametrize(
    "change",
    [
        {"version": 2},
        {"episodes": []},
        {"robot_radius_m": 0},
        {"environment": "room"},
        {"episodes": [{**listed()["episodes"][0], "goal": {"position": [0, 0, 0], "class": "chair"}}]},
        {"episodes": [{**listed()["episodes"][0], "goal": {"class": "chair", "instances": []}}]},
        {"episodes": [{**listed()["episodes"][0], "shortest_path_m": 0}]},
    ],
)
def test_a_list_that_makes_no_sense_breaks_the_schema(change: dict[str, Any]) -> None:
    assert schema.problems(listed(), "episodes", Path("a.json")) == []
    assert schema.problems(listed(**change), "episodes", Path("a.json")) != []


def test_a_task_that_shows_a_goal_says_which_episodes_it_is_of() -> None:
    task = {"name": "x", "actions": ["move_angle"], "observations": ["poses", "goal"]}

    assert schema.problems(task, "task", Path("x.yaml")) != []
    assert schema.problems({**task, "episodes": "point_goal"}, "task", Path("x.yaml")) == []


def test_a_goal_to_fetch_is_two_classes_and_objects_begin_where_the_episode_says() -> None:
    place = {"class": "tray", "centroid": [1.0, 2.0, 0.7], "extent": [0.3, 0.4, 0.02]}
    goal = {"fetch": {"name": "cup_3", "class": "cup"}, "place": place}
    objects = [{"name": "cup_3", "position": [0.1, 0.2, 0.7], "turn_deg": 30.0}]
    start = {"id": "a", "start_pose": [1, 0, 0, 0, 1, 2, 0], "shortest_path_m": 3.0}
    document = listed(task="tidy_up", episodes=[{**start, "goal": goal, "objects": objects}])
    schema.check(document, "episodes", Path("x.json"))
    episode = episodes.Episode(Declaration("episodes", "tidy_up:room:1", Path("x.json"), "acme", document), 0)
    assert episode.goal == {"object": "cup", "place": "tray"}
    scene = Declaration("environments", "room:1", Path("x.yaml"), "acme", {"name": "room", "start_pose": []})
    start_pose = [1, 0, 0, 0, 1, 2, 0]
    assert episode.placed(scene).data == {"name": "room", "start_pose": start_pose, "loose_objects": objects}
