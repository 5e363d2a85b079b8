"""The keys of every kind of declaration and document, from its JSON Schema."""

import json
from collections.abc import Iterator
from importlib.resources import files
from typing import Any

from docs.tools.reference.meanings import MEANINGS
from docs.tools.reference.tables import GENERATED, code, plain, table

DECLARATIONS = ("task", "robot", "environment", "format", "example", "batch", "challenge", "ground_truth", "episodes")
_INTRODUCTION = """\
# Keys of declarations and documents

What the JSON Schemas say, which come with BenchBot: `benchbot schema KIND` prints one, `benchbot check FILE` compares
a file with it. Nested keys are written with dots, `[]` is each item of a list, `*` any key. What the keys mean together
is told in [declarations](../declarations.md) and [real robots](../ros2.md).

"""


def page() -> str:
    """Return the page of schemas: declarations first, then documents."""
    folder = files("benchbot") / "schemas"
    names = sorted(item.name.removesuffix(".json") for item in folder.iterdir() if item.name.endswith(".json"))
    ordered = [*DECLARATIONS, *(name for name in names if name not in DECLARATIONS)]
    documents = {name: json.loads((folder / f"{name}.json").read_text("utf-8")) for name in ordered}
    return GENERATED + _INTRODUCTION + "\n".join(_section(name, schema) for name, schema in documents.items())


def _section(name: str, schema: dict[str, Any]) -> str:
    rows = [
        [code(key) + (" (required)" if required else ""), _kind(part, schema), plain(_meaning(name, key, part))]
        for key, part, required in _keys(schema, schema, "")
    ]
    return f"## {name}\n\n{plain(schema.get('title', ''))}\n\n{table(['key', 'type', 'meaning'], rows)}"


def _resolved(part: Any, schema: dict[str, Any]) -> dict[str, Any]:
    if not isinstance(part, dict):
        return {}
    if "$ref" not in part:
        return part
    found: Any = schema
    for step in part["$ref"].removeprefix("#/").split("/"):
        found = found[step] if step and step != "#" else found
    return {**found, **{key: value for key, value in part.items() if key != "$ref"}}


def _keys(part: dict[str, Any], schema: dict[str, Any], prefix: str, depth: int = 0) -> Iterator[tuple[str, Any, bool]]:
    """Yield each key below a part of a schema, with its own part and whether it is required."""
    required = set(part.get("required", ()))
    children = dict(part.get("properties", {}))
    for pattern in part.get("patternProperties", {}).values():
        children["*"] = pattern
    if isinstance(part.get("additionalProperties"), dict):
        children["*"] = part["additionalProperties"]
    for name, child in children.items():
        below = _resolved(child, schema)
        yield prefix + name, below, name in required
        if depth < 4:
            yield from _below(below, schema, prefix + name, depth)


def _below(part: dict[str, Any], schema: dict[str, Any], prefix: str, depth: int) -> Iterator[tuple[str, Any, bool]]:
    yield from _keys(part, schema, f"{prefix}.", depth + 1)
    items = _resolved(part.get("items"), schema)
    if items:
        yield from _keys(items, schema, f"{prefix}[].", depth + 1)
    for option in (*part.get("oneOf", ()), *part.get("anyOf", ())):
        yield from _keys(_resolved(option, schema), schema, f"{prefix}.", depth + 1)


def _meaning(kind: str, key: str, part: dict[str, Any]) -> str:
    return str(part.get("description") or MEANINGS.get(kind, {}).get(key) or part.get("title", ""))


def _kind(part: dict[str, Any], schema: dict[str, Any]) -> str:
    """Return what values a part of a schema allows, in words and code."""
    if "const" in part:
        return code(json.dumps(part["const"]))
    if "enum" in part:
        return ", ".join(code(str(value) if value is not None else "null") for value in part["enum"])
    options = part.get("oneOf") or part.get("anyOf")
    if options:
        return ", or ".join(dict.fromkeys(filter(None, (_kind(_resolved(item, schema), schema) for item in options))))
    kind = part.get("type", "")
    kinds = [kind] if isinstance(kind, str) else kind
    said = " or ".join(kinds)
    if kinds == ["array"]:
        items = _resolved(part.get("items"), schema)
        inside = _kind(items, schema) if items else ""
        size = part.get("minItems") if part.get("minItems") == part.get("maxItems") else None
        said = f"array of {size} " if size else "array of "
        said = said + inside if inside else said.removesuffix(" of ")
    return said + _limits(part)


def _limits(part: dict[str, Any]) -> str:
    words = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    found = [f"{sign} {part[key]}" for key, sign in words.items() if key in part]
    if "pattern" in part:
        found.append(f"matches `{part['pattern']}`")
    return (", " + ", ".join(found)) if found else ""
