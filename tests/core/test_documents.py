"""The types of declarations and documents are what their schemas accept: neither can drift from the other."""

from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import pytest

from benchbot.core import documents
from benchbot.core.declarations.schema import schema

UNREAD = {
    "persistent_cmds",
    "persistent_status",
    "run_cmd",
    "stop_cmd",
    "start_cmds",
    "file_dirty_state",
    "file_collisions",
    "logs_dir",
}
"""Keys by which BenchBot v2 started a robot; its declarations may have them, and nothing reads them."""

SCHEMAS: dict[str, tuple[type, dict[str, Any]]] = {
    "robot": (documents.RobotDeclaration, schema("robot")),
    "environment": (documents.EnvironmentDeclaration, schema("environment")),
    "ground truth": (documents.GroundTruth, schema("ground_truth")),
    "result": (documents.Result, schema("result")),
    "track": (documents.TrackedScene, schema("result")["properties"]["track"]["items"]),
}
every_type = pytest.mark.parametrize(("kind", "accepted"), SCHEMAS.values(), ids=SCHEMAS.keys())


@every_type
def test_the_keys_are_those_of_the_schema(kind: type, accepted: dict[str, Any]) -> None:
    assert set(kind.__annotations__) == set(accepted["properties"]) - UNREAD
    assert vars(kind)["__required_keys__"] == set(accepted["required"])


@every_type
def test_the_values_are_of_the_types_of_the_schema(kind: type, accepted: dict[str, Any]) -> None:
    hints = get_type_hints(kind)
    for key, form in accepted["properties"].items():
        if "type" in form and key not in UNREAD:
            said = form["type"] if isinstance(form["type"], list) else [form["type"]]
            assert json_types(hints[key]) == set(said), key


def json_types(hint: Any) -> set[str]:
    """Return the names that JSON Schema has for the values of a type."""
    if get_origin(hint) in (Union, UnionType):
        return {name for part in get_args(hint) for name in json_types(part)}
    names = {str: "string", bool: "boolean", int: "integer", float: "number", list: "array", NoneType: "null"}
    return {names.get(get_origin(hint) or hint, "object")}
