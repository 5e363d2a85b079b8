"""Schemas of this installation: with the names of what is installed, so that editors can complete them."""

from copy import deepcopy
from typing import Any

from benchbot.core.declarations import schema
from benchbot.plugins.authoring.checks.names import REFERENCES, Names


def schema_here(kind: str, names: Names) -> dict[str, Any]:
    """Return a schema that offers installed names where a document names something, and allows all that it allowed.

    What is valid does not change: whether a name exists is for `benchbot check` to say, which warns.
    """
    document = deepcopy(schema.schema(kind))
    filled = False
    for key, what in REFERENCES.get(kind, {}).items():
        known = sorted(names.known(what) or ())
        if not known:
            continue
        place = document["properties"][key]
        holder, part = (place, "items") if place.get("type") == "array" else (document["properties"], key)
        holder[part] = _offering(holder[part], known)
        filled = True
    if filled:
        document["$id"] += ":here"
        document["$comment"] = "With names of what is installed here; others are allowed, too."
    return document


def _offering(place: dict[str, Any], known: list[str]) -> dict[str, Any]:
    described = {key: place[key] for key in ("description",) if key in place}
    rest = {key: value for key, value in place.items() if key not in described}
    return {**described, "anyOf": [{"enum": known}, rest]}
