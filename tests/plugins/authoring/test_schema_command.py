import json
from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load
from benchbot.plugins.authoring.checks.references import REFERENCES, KnownNames, schema_with_names
from tests.command_line import CommandLine, Here

TASK: dict[str, Any] = {"name": "tour", "actions": ["move_next"], "observations": ["image_rgb"]}
SOME = st.sampled_from(["object_map", "sample:passive", "arena:1", "a", "a:b", "a:b:c", "", 5, None, ["x"], {"x": 1}])


@cache
def offered(kind: str) -> dict[str, Any]:
    return schema_with_names(kind, KnownNames(Catalog(load()), []))


def test_without_a_kind_all_are_listed(here: Here) -> None:
    assert "robot              A robot: what it offers, and how it is built or reached." in here("schema").stdout
    assert [row["kind"] for row in json.loads(here("schema", "--json").stdout)] == list(schema.KINDS)


def test_names_that_are_installed_are_offered_and_others_allowed(here: Here) -> None:
    offering = json.loads(here("schema", "task").stdout)
    plain = json.loads(here("schema", "task", "--plain").stdout)

    assert "object_map" in offering["properties"]["results_format"]["anyOf"][0]["enum"]
    assert offering["properties"]["evaluation_method"]["description"].startswith("How results are scored")
    assert Draft202012Validator(offering).is_valid({**TASK, "results_format": "of_another_machine"})
    assert plain == schema.schema("task")


@pytest.mark.parametrize("kind", REFERENCES)
def test_a_schema_with_names_is_a_schema(kind: str) -> None:
    Draft202012Validator.check_schema(offered(kind))


@given(kind=st.sampled_from(sorted(REFERENCES)), data=st.data())
def test_offering_names_changes_nothing_of_what_is_valid(kind: str, data: st.DataObject) -> None:
    plain, offering = schema.schema(kind), offered(kind)
    document = {key: data.draw(SOME | st.lists(SOME, max_size=2)) for key in REFERENCES[kind]}

    def wrong(checked: dict[str, Any]) -> set[tuple[str | int, ...]]:
        return {tuple(error.absolute_path) for error in Draft202012Validator(checked).iter_errors(document)}

    assert wrong(plain) == wrong(offering)


def test_editors_get_files(cli: CommandLine, here: Here) -> None:
    done = here("schema", "--write", "schemas")

    assert done.stdout.splitlines() == [f"schemas/{kind}.json" for kind in schema.KINDS]
    assert "# yaml-language-server: $schema=schemas/task.json" in done.stderr
    assert json.loads((cli.folder / "schemas/robot.json").read_text())["$id"] == "urn:benchbot:schema:robot:1:here"


def test_a_kind_that_is_not_and_a_folder_that_cannot_be_are_said(cli: CommandLine, here: Here) -> None:
    (cli.folder / "file").touch()

    assert "Did you mean 'evaluation_method'?" in here("schema", "evaluation-metod").stderr
    assert "Error: The schemas cannot be written to file/schemas." in here("schema", "--write", "file/schemas").stderr
