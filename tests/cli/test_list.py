import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.command_line import CommandLine, Here
from tests.plugin_factory import DECLARES


def test_tasks_are_a_line_each_with_what_they_allow(here: Here) -> None:
    done = here("list", "tasks")

    assert done.stderr == ""
    assert [line.split() for line in done.stdout.splitlines()] == [
        ["sample:active", "move_distance,move_angle", "ground_truth", "1", "object_map", "benchbot-sample"],
        ["sample:goal", "move_distance,move_angle", "ground_truth", "1", "-", "benchbot-sample"],
        ["sample:lost", "move_distance,move_angle", "noisy", "1", "-", "benchbot-sample"],
        ["sample:noisy", "move_distance,move_angle", "noisy", "1", "object_map", "benchbot-sample"],
        ["sample:passive", "move_next", "ground_truth", "1", "object_map", "benchbot-sample"],
        ["sample:two_scenes", "move_next", "ground_truth", "2", "object_map", "benchbot-sample"],
    ]


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("tasks", "sample:passive"),
        ("robots", "sample_robot"),
        ("environments", "arena:1"),
        ("formats", "object_map"),
        ("examples", "hello_passive"),
        ("methods", "omq"),
        ("evaluators", "omq"),
        ("simulators", "sim_sample"),
        ("executors", "local"),
        ("plugins", "sample"),
    ],
)
def test_every_kind_is_listed_for_people_and_for_programs(kind: str, name: str, here: Here) -> None:
    lines = here("list", kind).stdout.splitlines()
    rows = json.loads(here("list", kind, "--json").stdout)

    assert name in [line.split()[0] for line in lines]
    assert [line.split()[0] for line in lines] == [row["name"] for row in rows]
    assert all(row["distribution"] for row in rows)


def test_an_empty_list_is_an_empty_json_list(here: Here) -> None:
    assert here("list", "batches", "--json").stdout == "[]\n"
    assert here("list", "batches").stdout == ""


def test_a_long_list_has_its_ends_and_its_length_for_people(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    named = [f"town_{number}:1" for number in range(1, 801)]
    batches = {"batches/all.yaml": f"name: all\nenvironments: {named}\n"}
    make_plugin("towns", DECLARES.format(kind="batches"), batches)

    assert cli("list", "batches").stdout.split() == ["all", "town_1:1,town_2:1,…,town_800:1", "(800)", "towns"]
    assert json.loads(cli("list", "batches", "--json").stdout)[0]["environments"] == named


def test_a_broken_plugin_does_not_hide_the_others(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    make_plugin("broken", "import no_such_module")

    done = cli("list", "tasks")

    assert "sample:passive" in done.stdout
    assert "broken (ModuleNotFoundError: No module named 'no_such_module' (" in done.stderr


def test_episodes_are_listed_by_task_and_environment_and_shown(here: Here) -> None:
    listed = here("list", "episodes")
    assert [line.split() for line in listed.stdout.splitlines()] == [["point_goal:arena:1", "3", "benchbot-sample"]]

    shown = here("show", "episodes", "point_goal:arena:1", "--json")
    assert len(json.loads(shown.stdout)["declaration"]["episodes"]) == 3
