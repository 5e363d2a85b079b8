import json

import pytest
import yaml

from tests.command_line import Here


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
