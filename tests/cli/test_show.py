import json
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from tests.command_line import CommandLine, Here


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("task", "sample:passive"),
        ("robot", "sample_robot"),
        ("environment", "arena:2"),
        ("format", "object_map"),
        ("example", "hello_active"),
    ],
)
def test_a_declaration_is_shown_as_written_with_its_path(kind: str, name: str, here: Here) -> None:
    text = here("show", kind, name).stdout
    document = json.loads(here("show", kind, name, "--json").stdout)

    assert text.startswith(f"# {document['path']} ({document['distribution']})\n")
    assert yaml.safe_load(text) == document["declaration"]
    assert document["name"] == name


@pytest.mark.parametrize(("kind", "name"), [("method", "omq"), ("simulator", "sim_sample")])
def test_what_a_plugin_provides_in_python_is_shown_as_yaml(kind: str, name: str, here: Here) -> None:
    assert yaml.safe_load(here("show", kind, name).stdout)["name"] == name


@pytest.mark.parametrize(("kind", "name"), [("robot", "sample_robot"), ("environment", "arena:2"), ("method", "omq")])
def test_what_alone_has_a_name_is_found_without_its_kind(kind: str, name: str, here: Here) -> None:
    for more in ((), ("--json",)):
        found = here("show", name, *more)
        assert found.returncode == 0
        assert found.stdout == here("show", kind, name, *more).stdout


@pytest.mark.parametrize(
    ("name", "nearest"), [("sample_rbot", "sample_robot"), ("arena", "arena:1"), ("rbot", "robot"), ("zzz", None)]
)
def test_a_name_that_nothing_has_is_refused_with_the_nearest(name: str, nearest: str | None, here: Here) -> None:
    done = here("show", name)

    assert done.returncode == 2
    assert f"Nothing that is installed is called '{name}'." in done.stderr
    assert ("Did you mean" in done.stderr) == (nearest is not None)
    assert nearest is None or f"Did you mean '{nearest}'?" in done.stderr


def test_a_name_that_several_have_asks_for_the_kind(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    make_plugin(
        "twin",
        "from importlib import resources\nfrom benchbot.plugin import hookimpl\n\n@hookimpl\n"
        "def benchbot_formats():\n    yield resources.files('twin') / 'omq.yaml'\n",
        {"omq.yaml": "name: omq\n"},
    )

    done = cli("show", "omq")

    assert done.returncode == 2
    assert "There is a format and a method called 'omq'. Say which: show format omq" in done.stderr
    assert cli("show", "format", "omq").stdout.endswith("name: omq\n")


def test_a_ground_truth_is_never_shown(here: Here) -> None:
    done = here("show", "ground_truth", "arena:1")

    assert done.returncode == 2
    assert done.stdout == ""


def test_schemas_are_printed(here: Here) -> None:
    assert json.loads(here("schema", "result").stdout)["$id"] == "urn:benchbot:schema:result:1"

    wrong = here("schema", "taks")
    assert wrong.returncode == 2
    assert "Did you mean 'task'?" in wrong.stderr


def test_a_method_says_how_its_scores_are_read(here: Here) -> None:
    shown = json.loads(here("show", "method", "omq", "--json").stdout)

    assert shown["scores"]["OMQ"] == {"lower_is_better": False, "least": 0.0, "greatest": 1.0}
