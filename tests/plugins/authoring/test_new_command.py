import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.plugins.authoring.scaffold.render import KINDS, package_of
from tests.command_line import CommandLine, Here


@pytest.mark.parametrize("kind", KINDS)
def test_the_folder_is_the_answer_and_what_to_do_next_is_said_beside_it(
    here: Here, cli: CommandLine, kind: str
) -> None:
    done = here("new", kind, "acme-kitchen", "--output-location", "made/here")
    assert done.stdout == "made/here/acme-kitchen\n"
    assert "cd made/here/acme-kitchen && make test" in done.stderr
    folder = cli.folder / "made" / "here" / "acme-kitchen"
    names = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert {"pyproject.toml", "README.md", "Makefile", ".gitignore", ".github/workflows/test.yml"} <= names
    assert {"src/acme_kitchen/plugin.py", "src/acme_kitchen/py.typed", "tests/test_acme_kitchen.py"} <= names
    assert [path.name for path in folder.parent.iterdir()] == ["acme-kitchen"]
    text = "".join(path.read_text() for path in folder.rglob("*") if path.is_file())
    assert "<<" not in text
    assert "PACKAGE" not in text


def test_names_are_those_that_benchbots_own_distributions_would_give(here: Here, cli: CommandLine) -> None:
    here("new", "simulator", "benchbot-sim-maze")
    folder = cli.folder / "benchbot-sim-maze"
    assert 'sim_maze = "benchbot_sim_maze.plugin"' in (folder / "pyproject.toml").read_text()
    assert 'Simulator("sim_maze", create)' in (folder / "src/benchbot_sim_maze/plugin.py").read_text()
    robot = folder / "src" / "benchbot_sim_maze" / "robots" / "sim_maze_robot.yaml"
    assert "name: sim_maze_robot\ntype: sim_maze\n" in robot.read_text()


def test_nothing_is_overwritten(here: Here, cli: CommandLine) -> None:
    (cli.folder / "acme-kitchen").mkdir()
    (cli.folder / "acme-kitchen" / "mine.txt").write_text("mine")
    done = here("new", "task", "acme-kitchen")
    assert (done.returncode, done.stdout) == (2, "")
    assert "acme-kitchen is there already" in done.stderr
    assert [path.name for path in (cli.folder / "acme-kitchen").iterdir()] == ["mine.txt"]


def test_a_folder_that_cannot_be_written_is_told_and_nothing_is_left(here: Here, cli: CommandLine) -> None:
    (cli.folder / "file").write_text("")
    done = here("new", "task", "acme-kitchen", "-o", "file/deeper")
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    assert [path.name for path in cli.folder.iterdir()] == ["file"]


def test_an_unknown_kind_is_told_with_the_nearest(here: Here) -> None:
    done = here("new", "evaluater", "acme-metric")
    assert done.returncode == 2
    assert "Did you mean 'evaluator'?" in done.stderr


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Acme", "such as acme."),
        ("acme_kitchen", "such as acme-kitchen."),
        ("acme--kitchen", "such as acme-kitchen."),
        ("acme-", "such as acme."),
        ("3d-rooms", "such as d-rooms."),
        ("../acme", "such as acme."),
        ("", "such as my-lab."),
        ("a" * 61, "60 at most"),
        ("class", "taken by Python"),
        ("json", "taken by Python"),
        ("benchbot", "taken by Python or by BenchBot"),
        ("numpy", "something that is installed here"),
    ],
)
def test_a_name_that_cannot_be_is_told_with_one_that_can(here: Here, cli: CommandLine, name: str, words: str) -> None:
    done = here("new", "task", "--", name)
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split())
    assert list(cli.folder.iterdir()) == []


@given(st.text(max_size=70))
def test_a_package_can_be_written_in_python_whatever_the_name(name: str) -> None:
    try:
        package = package_of(name)
    except BenchbotError:
        return
    assert package.isidentifier()
    assert package == name.replace("-", "_")
    assert Path(name).name == name


def test_the_schema_beside_a_declaration_is_that_of_this_installation(here: Here, cli: CommandLine) -> None:
    here("new", "robot", "acme-robot")
    written = json.loads((cli.folder / "acme-robot" / ".schemas" / "robot.json").read_text())
    assert written == json.loads(here("schema", "robot", "--plain").stdout)
