"""The format `object_map_ground_truth`: the objects of an environment and their places."""

from collections.abc import Iterator
from typing import Any

from benchbot.core import instance_checks as checks


def create() -> dict[str, Any]:
    """Return an empty ground truth."""
    return {"objects": [], "class_list": [], "synonyms": {}}


def create_object() -> dict[str, Any]:
    """Return an object without class and name, of no extent."""
    return {"class": "", "ID_name": "", "centroid": [0, 0, 0], "extent": [0, 0, 0], "isgroup": False}


def validate(instance: Any) -> None:
    """Raise BenchbotError that names each place of `instance` that breaks the format."""
    checks.raise_any(_problems(instance, "ground_truth"), "object_map_ground_truth")


def _problems(instance: Any, path: str) -> Iterator[str]:
    wrong = list(checks.mapping(instance, ("objects",), path))
    if wrong:
        yield from wrong
        return
    if "class_list" in instance:
        yield from checks.names(instance["class_list"], f"{path}.class_list")
    synonyms = instance.get("synonyms", {})
    if not isinstance(synonyms, dict):
        yield f"{path}.synonyms: must be a mapping of one class name to another, not {checks.kind(synonyms)}"
    else:
        for name, meaning in synonyms.items():
            if not isinstance(meaning, str) or not meaning:
                yield f"{path}.synonyms.{name}: must be the name of a class, not {checks.kind(meaning)}"
    yield from checks.each(instance["objects"], f"{path}.objects", _object_problems)


def _object_problems(item: dict[str, Any], path: str) -> Iterator[str]:
    if not isinstance(item.get("class"), str) or not item["class"]:
        yield f"{path}.class: must be the name of a class, not {checks.kind(item.get('class'))}"
    if not isinstance(item.get("isgroup", False), bool):
        yield f"{path}.isgroup: must be true or false, not {checks.kind(item['isgroup'])}"
    yield from checks.box(item, path)
