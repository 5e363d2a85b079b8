"""The shipped episodes are those that the command makes, and the robot can do each of them."""

import json
from pathlib import Path
from typing import Any

import pytest

import benchbot_task_manipulation
from benchbot_task_manipulation.make_episodes import OBJECTS, PLACES, Room, as_text, episodes, is_possible, open_room

SHIPPED = Path(str(benchbot_task_manipulation.__file__)).parent / "episodes" / "tidyroom_1.json"


@pytest.fixture(scope="module")
def room() -> Room:
    return open_room("tidyroom:1")


@pytest.fixture(scope="module")
def listed() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(SHIPPED.read_text("utf-8"))
    return document


def test_the_same_seed_makes_the_same_bytes(listed: dict[str, Any]) -> None:
    made = episodes("tidyroom:1", seed=0, count=3)
    assert made["episodes"] == listed["episodes"][:3]
    assert as_text(listed) == SHIPPED.read_text("utf-8")


def test_every_object_and_every_place_is_asked_for(listed: dict[str, Any]) -> None:
    goals = [episode["goal"] for episode in listed["episodes"]]
    assert len(goals) == 50
    assert {goal["fetch"]["class"] for goal in goals} == {*OBJECTS}
    assert {goal["place"]["class"] for goal in goals} == {*PLACES}


@pytest.mark.parametrize("number", range(0, 50, 10))
def test_the_robot_can_do_it(room: Room, listed: dict[str, Any], number: int) -> None:
    assert is_possible(room, listed["episodes"][number])


def test_what_is_out_of_reach_is_not_an_episode(room: Room, listed: dict[str, Any]) -> None:
    episode = json.loads(json.dumps(listed["episodes"][0]))
    episode["goal"]["place"]["centroid"][2] += 1.5
    assert not is_possible(room, episode)
    episode = json.loads(json.dumps(listed["episodes"][0]))
    episode["objects"][0]["position"] = [0.0, 0.0, 0.745]
    assert not is_possible(room, episode)
