import json
from pathlib import Path

import pytest

from benchbot.core.declarations import schema
from benchbot.plugins.authoring.checks.documents import kind_of
from tests.command_line import CommandLine, Here

TASK = """\
name: "my:task"
actions: [move_next]
observatons: [image_rgb]
observations: [laser]
scene_count: none
"""


def test_a_wrong_key_is_told_with_file_line_and_the_nearest_name(cli: CommandLine, here: Here) -> None:
    (cli.folder / "task.yaml").write_text(TASK)

    done = here("check", "task.yaml")

    assert done.returncode == 2
    assert done.stdout.startswith("task.yaml:3: unknown key 'observatons'. Did you mean 'observations'? Allowed: ")
    assert "\ntask.yaml:5: 'none' is not of type 'integer'" in done.stdout
    assert done.stderr == "1 file checked: 2 problems.\n"


def test_problems_are_data_for_programs(cli: CommandLine, here: Here) -> None:
    (cli.folder / "task.yaml").write_text(TASK)

    problems = json.loads(here("check", "task.yaml", "--json").stdout)

    assert [(problem["path"], problem["line"]) for problem in problems] == [("task.yaml", 3), ("task.yaml", 5)]


def test_a_folder_is_checked_with_all_that_is_in_it(here: Here) -> None:
    sample = Path(__file__).parents[2] / "sample_plugin" / "benchbot_sample"

    done = here("check", str(sample / "tasks"), str(sample / "robots"), str(sample / "environments"))

    assert (done.returncode, done.stdout) == (0, "")
    assert "files checked: nothing is wrong." in done.stderr


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.yaml", "name: [1, 2", "a.yaml:2: not valid YAML. did not find expected"),
        ("a.yaml", "- 1\n- 2\n", "expected a mapping of keys to values. The file holds a list."),
        ("a.yaml", "name: x\n", "cannot tell what this file declares; say it with --kind"),
        ("a.json", '{"task_details": ', "not valid JSON."),
        ("a.yaml", "\0", "not valid YAML."),
    ],
)
def test_files_that_cannot_be_understood_are_problems_too(
    name: str, text: str, message: str, cli: CommandLine, here: Here
) -> None:
    (cli.folder / name).write_text(text)

    done = here("check", name)

    assert done.returncode == 2
    assert message in done.stdout
    assert "Traceback" not in done.stderr


def test_a_missing_file_and_an_empty_folder_are_said(here: Here) -> None:
    assert "nowhere.yaml: there is no such file." in here("check", "nowhere.yaml").stdout
    assert "There is nothing to check in ." in here("check", ".").stderr


def test_a_result_is_checked_by_its_own_format(cli: CommandLine, here: Here) -> None:
    result = {
        "task_details": {"name": "sample:passive", "results_format": "object_map"},
        "environment_details": [{"name": "arena", "variant": 1}],
        "results": {"class_list": ["cup", "background"], "objects": [{"label_probs": [1], "centroid": [0, 0, 0]}]},
    }
    (cli.folder / "result.json").write_text(json.dumps(result))

    done = here("check", "result.json")

    assert done.returncode == 2
    assert "objects[0]" in done.stdout


def test_an_unknown_kind_is_refused(cli: CommandLine, here: Here) -> None:
    (cli.folder / "a.yaml").write_text(TASK)

    done = here("check", "a.yaml", "--kind", "taks")

    assert done.returncode == 2
    assert "Did you mean 'task'?" in done.stderr


@pytest.mark.parametrize(
    ("kind", "document"),
    [
        ("task", {"name": "x", "actions": [], "observatons": []}),
        ("robot", {"name": "x", "type": "real", "connections": {}}),
        ("environment", {"name": "x", "variant": 1, "start_pose": []}),
        ("format", {"name": "x", "functions": {}}),
        ("ground_truth", {"environment": {}, "format": {}, "ground_truth": {}}),
        ("example", {"name": "x", "native_command": ""}),
        ("batch", {"name": "x", "environments": []}),
        ("episodes", {"version": 1, "task": "x", "environment": "y:1", "episodes": []}),
        ("result", {"task_details": {}, "environment_details": [], "results": {}}),
        ("scores", {"task_details": {}, "environment_details": [], "scores": {}}),
    ],
)
def test_the_kind_of_a_file_is_told_from_its_keys(kind: str, document: dict[str, object]) -> None:
    assert kind in schema.KINDS
    assert kind_of(document, Path("anywhere/file.yaml")) == kind


def test_the_folder_says_more_than_the_keys() -> None:
    assert kind_of({"name": "x"}, Path("plugin/robots/x.yaml")) == "robot"


def test_a_name_that_nothing_here_has_is_a_warning_and_no_failure(cli: CommandLine, here: Here) -> None:
    (cli.folder / "task.yaml").write_text(
        "name: mine\nactions: [move_next]\nobservations: [laser]\nresults_format: object_mp\n"
    )

    done = here("check", "task.yaml")

    assert (done.returncode, done.stderr) == (0, "1 file checked: 1 warning.\n")
    assert done.stdout.startswith(
        "task.yaml:4: warning: 'object_mp' is none of the formats that are installed. Did you"
    )
    (problem,) = json.loads(here("check", "task.yaml", "--json").stdout)
    assert (problem["level"], problem["pointer"]) == ("warning", "/results_format")


def test_what_a_folder_has_besides_is_left_out_by_name(cli: CommandLine, here: Here) -> None:
    for name in ("a", "b", "c", "d"):
        (cli.folder / f"{name}.json").write_text("[]")

    done = here("check", ".")

    assert (done.returncode, done.stdout) == (0, "")
    assert "Left out, since they declare nothing that BenchBot knows: a.json, b.json, c.json and 1 more." in done.stderr


def test_an_installed_plug_in_is_checked_by_its_name(here: Here) -> None:
    assert "files checked: nothing is wrong." in here("check", "benchbot-sample").stderr
    wrong = here("check", "benchbot-sampel")
    assert "There is no file, no folder and no installed plug-in 'benchbot-sampel'." in wrong.stderr
