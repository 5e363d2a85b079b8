import json
import math
from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from benchbot.core.declarations import formats, schema
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.plugins.authoring import schema_command
from benchbot.plugins.authoring.checks.references import REFERENCES, KnownNames, schema_with_names
from tests.command_line import CommandLine, Here

FORMATS = {
    name
    for name, item in Catalog(load()).pool("formats").items()
    if item.distribution.startswith("benchbot") and "schema" in item.data
}
OF_THE_BOX = ["object_map", "object_map_ground_truth", "object_map_with_states"]
ENTRIES = {
    "object_map": ("label_probs", "centroid", "extent"),
    "object_map_with_states": ("label_probs", "centroid", "extent", "state_probs"),
    "trajectory": ("translation_xyz", "rotation_xyzw"),
}
TASK: dict[str, Any] = {"name": "tour", "actions": ["move_next"], "observations": ["image_rgb"]}
SOME = st.sampled_from(["object_map", "sample:passive", "arena:1", "a", "a:b", "a:b:c", "", 5, None, ["x"], {"x": 1}])


@cache
def declaration(name: str) -> Declaration:
    return Catalog(load()).get("formats", name)


@cache
def offered(kind: str) -> dict[str, Any]:
    return schema_with_names(kind, KnownNames(Catalog(load()), []))


def test_without_a_kind_all_are_listed(here: Here) -> None:
    assert "robot                    A robot: what it offers, and how it is built or reached." in here("schema").stdout
    assert [row["kind"] for row in json.loads(here("schema", "--json").stdout)] == [*schema.KINDS, *OF_THE_BOX]


@pytest.mark.parametrize("name", OF_THE_BOX)
def test_a_format_of_results_is_printed_as_well(here: Here, name: str) -> None:
    printed = json.loads(here("schema", name.replace("_", "-")).stdout)

    Draft202012Validator.check_schema(printed)
    assert printed["$id"] == f"urn:benchbot:format:{name}:1"


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_what_a_format_creates_has_its_schema(name: str) -> None:
    declared = declaration(name)
    printed = schema.read(declared.path.parent / declared.data["schema"])
    created = formats.call(declared, "create", [], {})
    if name == "object_map_ground_truth":
        created["class_list"] = ["chair"]

    Draft202012Validator.check_schema(printed)
    assert printed["$id"] == f"urn:benchbot:format:{name}:1"
    Draft202012Validator(printed).validate(created)


def test_a_format_without_a_schema_says_so() -> None:
    with pytest.raises(BenchbotError, match="The format 'floor_plan' brings no schema"):
        schema_command.schema("floor-plan")


LENGTHS = st.one_of(st.integers(-1, 3), st.floats(-1, 3), st.sampled_from([math.nan, math.inf, "1", None, True]))


@given(data=st.data(), name=st.sampled_from(["object_map", "object_map_with_states", "trajectory"]))
def test_what_a_format_accepts_has_its_schema(data: st.DataObject, name: str) -> None:
    """And what breaks the schema is refused; the length of label_probs is beyond a schema."""
    declared = declaration(name)
    entries = {key: data.draw(st.lists(LENGTHS, min_size=1, max_size=4)) for key in ENTRIES[name]}
    kept = {key: value for key, value in entries.items() if data.draw(st.integers(0, 5))}
    instance = {**formats.call(declared, "create", [], {}), "class_list": ["chair", "background"]}
    instance[next(iter(instance))] = [kept | ({"observation": 0} if name == "trajectory" else {})]
    printed = Draft202012Validator(schema.read(declared.path.parent / declared.data["schema"]))

    try:
        formats.validate(declared, instance)
    except BenchbotError:
        return
    printed.validate(instance)


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

    assert done.stdout.splitlines() == [f"schemas/{kind}.json" for kind in (*schema.KINDS, *OF_THE_BOX)]
    assert "# yaml-language-server: $schema=schemas/task.json" in done.stderr
    assert json.loads((cli.folder / "schemas/robot.json").read_text())["$id"] == "urn:benchbot:schema:robot:1:here"


def test_a_kind_that_is_not_and_a_folder_that_cannot_be_are_said(cli: CommandLine, here: Here) -> None:
    (cli.folder / "file").touch()

    assert "Did you mean 'evaluation_method'?" in here("schema", "evaluation-metod").stderr
    assert "Did you mean 'object_map'?" in here("schema", "objectmap").stderr
    assert "Error: The schemas cannot be written to file/schemas." in here("schema", "--write", "file/schemas").stderr
