"""Generated projects pass their linter, type checker and tests, are found when installed, and run."""

import json
import tomllib
from pathlib import Path

import pytest

from benchbot.core.declarations import schema
from tests.plugins.authoring.scaffold.projects import ALL, Projects, name_of

# Wheels are built once, by the worker that has all of these.
pytestmark = pytest.mark.xdist_group("scaffold")

NEEDS = {
    "environment": "benchbot-sim-taichi benchbot-scenes benchbot-assets-household",
    "robot": "benchbot-sim-taichi",
    "simulator-ros2": "benchbot-robot-ros2",
}


@pytest.mark.parametrize("kind", [kind for kind in ALL if kind != "environment"])
def test_its_own_tests_pass(projects: Projects, kind: str) -> None:
    done = projects.run("-m", "pytest", "-q", "-p", "no:xdist", cwd=projects.path(kind), plugins=NEEDS.get(kind, ""))
    assert done.returncode == 0, done.stdout + done.stderr
    assert " passed" in done.stdout


@pytest.mark.xdist_group("renderer")
def test_its_own_tests_pass_where_a_scene_is_made(projects: Projects) -> None:
    done = projects.run(
        "-m", "pytest", "-q", "-p", "no:xdist", cwd=projects.path("environment"), plugins=NEEDS["environment"]
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_make_check_does_all_of_it(projects: Projects) -> None:
    code = "import subprocess, sys; sys.exit(subprocess.call(['make', 'check', f'RUN={sys.executable}']))"
    done = projects.run("-c", code, cwd=projects.path("task"))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Success: no issues found" in done.stdout


def test_everything_is_formatted_and_linted_by_its_own_rules(projects: Projects) -> None:
    for words in (["check"], ["format", "--check"]):
        done = projects.run("-m", "ruff", *words, "--no-cache", ".")
        assert done.returncode == 0, done.stdout


def test_everything_is_typed_strictly(projects: Projects) -> None:
    settings = tomllib.loads((projects.path("task") / "pyproject.toml").read_text())["tool"]["mypy"]
    assert settings["strict"] is True
    sources = [str(path) for kind in ALL for path in projects.path(kind).glob("*/**/*.py")]
    done = projects.run("-m", "mypy", "--strict", "--explicit-package-bases", *_bases(projects), *sources)
    assert done.returncode == 0, done.stdout + done.stderr


def _bases(projects: Projects) -> list[str]:
    path = projects.folder / "mypy.ini"
    folders = ":".join(str(projects.path(kind) / part) for kind in ALL for part in ("src", "tests"))
    path.write_text(f"[mypy]\nmypy_path = {folders}\n")
    return ["--config-file", str(path)]


def test_everything_is_listed_once_installed(projects: Projects) -> None:
    listed = projects.run("-m", "benchbot", "list", "plugins", "--json")
    assert {name_of(kind) for kind in ALL} <= {row["distribution"] for row in json.loads(listed.stdout)}
    for pool, kind in (("tasks", "task"), ("robots", "robot"), ("methods", "evaluator"), ("examples", "agent")):
        names = [row["name"] for row in json.loads(projects.run(*_list(pool)).stdout)]
        assert f"acme_{kind}" in names
    assert "acme_environment:1" in projects.run("-m", "benchbot", "list", "environments").stdout
    assert "acme_simulator" in projects.run("-m", "benchbot", "list", "simulators").stdout


def _list(pool: str) -> tuple[str, ...]:
    return ("-m", "benchbot", "list", pool, "--json")


def test_task_agent_simulator_recorder_and_method_work_together_in_a_run(projects: Projects, tmp_path: Path) -> None:
    place = schema.read(projects.site / "acme_simulator" / "environments" / "acme_simulator_room_1.yaml")
    thing = {"class": "chair", "centroid": [0, 0, 0.5], "extent": [1, 1, 1], "isgroup": False}
    truth = {
        "environment": place,
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {"objects": [thing], "class_list": ["chair", "background"], "synonyms": {}},
    }
    (tmp_path / "truth.json").write_text(json.dumps(truth))
    done = projects.run(
        *("-m", "benchbot", "submit", "--task", "acme_task", "--robot", "acme_simulator_robot"),
        *("--env", "acme_simulator_room:1", "--example", "acme_agent", "--record", "acme_plugin=recorded"),
        *("--results-location", "result.json"),
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert len(json.loads((tmp_path / "result.json").read_text())["results"]["objects"]) == 2
    assert [json.loads(line)["action"] for line in (tmp_path / "recorded" / "actions.jsonl").open()] == [
        None, "move_next", "move_next",
    ]  # fmt: skip
    scored = projects.run(
        *("-m", "benchbot", "eval", "result.json", "--method", "acme_evaluator"),
        *("--ground-truth", "truth.json", "--json"),
        cwd=tmp_path,
    )
    assert scored.returncode == 0, scored.stderr
    assert json.loads(scored.stdout)["scores"] == {"recall": 0.0}


def test_its_yaml_is_sound_and_names_a_schema_that_is_there(projects: Projects) -> None:
    checked = projects.run("-m", "benchbot", "check", *(str(path) for path in _declarations(projects)))
    assert checked.returncode == 0, checked.stdout
    for path in _declarations(projects):
        first = path.read_text().splitlines()[0]
        named = path.parent / first.removeprefix("# yaml-language-server: $schema=")
        assert json.loads(named.read_text()) == schema.schema(named.stem)


def _declarations(projects: Projects) -> list[Path]:
    paths = projects.folder.glob("*/src/*/*/*.yaml")
    return sorted(path for path in paths if path.parent.name != "layouts")
