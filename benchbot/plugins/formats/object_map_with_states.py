"""The format `object_map_with_states`: an object map with probabilities of the change of each object."""

from collections.abc import Iterator
from typing import Any

from benchbot.core import instance_checks as checks
from benchbot.plugins.formats import object_map

STATE_LIST = ("added", "removed", "unchanged")


def create(class_list: list[str] | None = None, state_list: list[str] | None = None) -> dict[str, Any]:
    """Return an empty map over `class_list` and `state_list` (added, removed, unchanged)."""
    states = list(STATE_LIST if state_list is None else state_list)
    return {**object_map.create(class_list), "state_list": states}


def create_object(num_classes: int | None = None, num_states: int | None = None) -> dict[str, Any]:
    """Return an object as in `object_map`, with `num_states` state probabilities, all zero."""
    count = len(STATE_LIST) if num_states is None else checks.count(num_states, "num_states")
    return {**object_map.create_object(num_classes), "state_probs": [0] * count}


def validate(instance: Any) -> None:
    """Raise BenchbotError that names each place of `instance` that breaks the format."""
    checks.raise_any(_problems(instance, "results"), "object_map_with_states")


def _problems(instance: Any, path: str) -> Iterator[str]:
    wrong = list(checks.mapping(instance, ("objects", "class_list", "state_list"), path))
    if wrong:
        yield from wrong
        return
    yield from object_map.problems(instance, path)
    if instance["state_list"] != list(STATE_LIST):
        yield f"{path}.state_list: must be {list(STATE_LIST)}, not {instance['state_list']!r:.80}"
    yield from checks.each(instance["objects"], f"{path}.objects", _state_problems)


def _state_problems(item: dict[str, Any], path: str) -> Iterator[str]:
    return checks.probabilities(item.get("state_probs"), f"{path}.state_probs", len(STATE_LIST), "state_list")
