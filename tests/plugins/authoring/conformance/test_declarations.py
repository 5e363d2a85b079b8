"""The sample plug-in's declarations conform; each change to one that breaks it is found out."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from benchbot.testing import check_environment, check_robot, check_task
from tests.plugins.authoring.conformance.reading import all_is_well, broken, warned

SAMPLE = Path(__file__).parents[3] / "sample_plugin" / "benchbot_sample"
PASSIVE = schema.read(SAMPLE / "tasks" / "passive.yaml")
ROBOT = schema.read(SAMPLE / "robots" / "sample_robot.yaml")
ARENA = schema.read(SAMPLE / "environments" / "arena_1.yaml")


def test_declarations_conform_by_name_by_file_and_as_they_are() -> None:
    for task in ("sample:passive", SAMPLE / "tasks" / "passive.yaml", PASSIVE):
        assert broken(check_task(task)) == {}
    for robot in ("sample_robot", SAMPLE / "robots" / "sample_robot.yaml", ROBOT):
        assert all_is_well(check_robot(robot))
    for environment in ("arena:1", SAMPLE / "environments" / "arena_1.yaml"):
        assert broken(check_environment(environment, robot="sample_robot")) == {}


def test_a_file_that_breaks_its_schema_is_told_by_line(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text("name: mine\nactions: [move_nxt]\nobservations: [poses]\n")
    assert (
        f"{path}:2: 'move_nxt' is not allowed here. Did you mean 'move_next'?"
        in broken(check_task(path))["declaration"]
    )


@pytest.mark.parametrize(
    ("changes", "subject", "words"),
    [
        ({"results_format": "object_mop"}, "results format", "Did you mean 'object_map'?"),
        ({"evaluation_method": "omg"}, "evaluation", "'omg' is not an installed evaluator"),
        ({"evaluation_method": "trajectory"}, "evaluation", "does not read results of the format 'object_map'"),
        ({"episodes": "no_such"}, "episodes", "no list of episodes 'no_such'"),
    ],
)
def test_what_is_wrong_with_a_task_is_found_out(changes: dict[str, Any], subject: str, words: str) -> None:
    assert words in broken(check_task(PASSIVE | changes))[subject]


def test_what_is_odd_about_a_task_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    # The sample robot alone, which has no inertial measurement unit.
    monkeypatch.setenv("BENCHBOT_PLUGINS", "benchbot-sample")
    odd = PASSIVE | {"description": "", "observations": ["imu"]}
    assert "people choose by it" in warned(check_task(odd))["description"]
    assert "No installed robot" in warned(check_task(odd))["robots"]


@pytest.mark.parametrize(
    ("changes", "subject", "words"),
    [
        ({"type": "sim_smaple"}, "type", "Neither a simulator nor a driver is called 'sim_smaple'"),
        ({"robot_frame": "base"}, "frames", "lacks the robot's own frame 'base'"),
        (
            {"connections": {"laser": {"connection": "api_to_ros"}}},
            "connections",
            "'laser' is connected by 'api_to_ros'",
        ),
        ({"limits": {"linear_mps": [0.6, 1.5]}}, "limits", "[0.6, 1.5]"),
        ({"limits": {"angular_radps": 0}}, "limits", "angular_radps"),
    ],
)
def test_what_is_wrong_with_a_robot_is_found_out(changes: dict[str, Any], subject: str, words: str) -> None:
    assert words in broken(check_robot(ROBOT | changes))[subject]


def test_what_is_odd_about_a_robot_is_a_warning() -> None:
    odd = ROBOT | {
        "poses": ["base_link"],
        "connections": {"image_rgb": {"connection": "ros_to_api"}},
        "limits": {"angular_radps": 90},
    }
    found = warned(check_robot(odd))
    assert "initial_pose" in found["frames"]
    assert "It offers no action" in found["connections"]
    assert "image_rgb comes without a camera model" in found["camera models"]
    assert "not degrees" in found["limits"]


def environment(tmp_path: Path, **changes: Any) -> Path:
    """Write the arena, changed, beside a map of its own."""
    (tmp_path / "map.yaml").write_text((SAMPLE / "maps" / "arena_1.yaml").read_text())
    path = tmp_path / "arena.yaml"
    path.write_text(json.dumps(ARENA | {"map_path": "map.yaml"} | changes))
    return path


@pytest.mark.parametrize(
    ("changes", "subject", "words"),
    [
        ({"map_path": "mop.yaml"}, "files", "map_path is 'mop.yaml'"),
        ({"start_pose": [0, 0, 0, 0, 0, 0, 2]}, "start pose", "has the norm 0"),
        ({"start_pose": [0.7071, 0.7071, 0, 0, -2, 0, 0]}, "start pose", "tilts the robot by 90 degrees"),
        ({"trajectory_poses": [[0, 0, 0, 2, 0, 0, 0]]}, "start pose", "trajectory pose 1 has the norm 2"),
        ({"trajectory_poses": [[1, 0, 0, 0, 400, 0, 0]]}, "trajectory", "trajectory pose 1 is 402 m away"),
    ],
)
def test_what_is_wrong_with_an_environment_is_found_out(
    tmp_path: Path, changes: dict[str, Any], subject: str, words: str
) -> None:
    assert words in broken(check_environment(environment(tmp_path, **changes)))[subject]


def test_a_start_in_a_post_is_found_out(tmp_path: Path) -> None:
    from benchbot_sample.world import read

    x, y, _ = read(SAMPLE / "maps" / "arena_1.yaml").posts[0]
    path = environment(tmp_path, start_pose=[1, 0, 0, 0, float(x), float(y), 0])
    assert "touches something at the start pose" in broken(check_environment(path, robot=ROBOT))["start"]


def test_what_is_odd_about_an_environment_is_a_warning(tmp_path: Path) -> None:
    path = environment(tmp_path, type="sim_smaple", robots=["carter_3000"], trajectory_poses=[], variant=77)
    found = warned(check_environment(path))
    assert "carter_3000" in found["type"]
    assert "no trajectory" in found["trajectory"]
    assert "benchbot_ground_truths" in found["ground truth"]
    assert "'sim_smaple'" in warned(check_environment(environment(tmp_path, type="sim_smaple")))["type"]
