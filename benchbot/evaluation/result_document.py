"""One result document: parsed and checked, with its environment, its condition and its failure read from provenance."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from benchbot.core import overrides, results
from benchbot.core.declarations import schema
from benchbot.core.documents import Result
from benchbot.core.errors import BenchbotError, FailureClass

DEPTH_LIMIT = 100
NUMBERS = ("seed", "episode", "repeat")
"""The keys of the numbers that tell results of one environment apart."""


@dataclass(frozen=True)
class ResultDocument:
    """A result document and its source: a path, or `archive:member`."""

    source: str
    document: Result

    @property
    def task(self) -> str:
        """The task's name."""
        return str(self.document["task_details"]["name"])

    @property
    def results_format(self) -> str | None:
        """The name of the format of its results, if the task has one."""
        name: str | None = self.document["task_details"].get("results_format")
        return name

    @property
    def environment(self) -> str:
        """The environment string: `name:variant[:variant…]`."""
        scenes = self.document["environment_details"]
        return ":".join([str(scenes[0]["name"]), *(str(scene["variant"]) for scene in scenes)])

    @property
    def selection(self) -> dict[str, Any]:
        """The selection in provenance: task, robot, environment, seed, and the repeat if there are several."""
        selection: dict[str, Any] = (self.document.get("provenance") or {}).get("selection") or {}
        return selection

    @property
    def numbers(self) -> dict[str, int | None]:
        """The seed of its episode, the number of the episode, and that of the repeat; None for what it does not say."""
        selection = self.selection
        episode = (selection.get("episode") or {}).get("number")
        return {"seed": selection.get("seed"), "episode": episode, "repeat": selection.get("repeat")}

    @property
    def settings(self) -> dict[str, Any]:
        """The overrides of its environments' declarations (`--set`): dotted key to value."""
        settings: dict[str, Any] = self.selection.get("settings") or {}
        return settings

    @property
    def condition(self) -> dict[str, Any]:
        """The keys that tell it from other results of its environment: its numbers, and its settings if it has any."""
        return {**self.numbers, **({"settings": self.settings} if self.settings else {})}

    @property
    def about(self) -> str:
        """Its environment and condition in words: `miniroom:1, seed 3`."""
        return describe(self.environment, self.condition)

    @property
    def failure(self) -> FailureClass | None:
        """The class of the episode's failure, None when the episode ended well."""
        failure = self._failure()
        return None if failure is None else FailureClass(failure["class"])

    @property
    def failure_why(self) -> str:
        """The reason of the failure, empty without one."""
        return str((self._failure() or {}).get("why", ""))

    def flaw(self) -> str | None:
        """Return why and where it cannot be written as JSON again: a number that is not finite, or its depth."""
        left: list[tuple[int, str, Any]] = [(1, "", self.document)]
        while left:
            depth, pointer, value = left.pop()
            if depth > DEPTH_LIMIT:
                return f"It is nested deeper than {DEPTH_LIMIT} levels, at {pointer:.80}."
            items: Iterable[tuple[str | int, Any]] = value.items() if isinstance(value, dict) else enumerate(value)
            for key, item in items:
                if isinstance(item, float):
                    if not math.isfinite(item):
                        return f"It holds a number that is not finite, at {pointer}/{key}."
                elif isinstance(item, dict | list):
                    left.append((depth + 1, f"{pointer}/{key}", item))
        return None

    def _failure(self) -> dict[str, Any] | None:
        return (self.document.get("provenance") or {}).get("failure")


def describe(environment: str, condition: Mapping[str, Any]) -> str:
    """Return an environment and a condition in words: `miniroom:1, seed 3, lighting.time=21:30`."""
    numbers = ((name, condition.get(name)) for name in NUMBERS)
    said = [f"{name} {number}" for name, number in numbers if number is not None]
    settings = overrides.label(condition.get("settings") or {})
    return ", ".join(filter(None, [environment, *said, settings]))


def listed(labels: Sequence[str], separator: str = ", ") -> str:
    """Return the first five labels, and how many others there are."""
    more = f" and {len(labels) - 5} more" if len(labels) > 5 else ""
    return separator.join(labels[:5]) + more


class DerivedDocumentError(BenchbotError):
    """A document that was computed from results, such as their scores, where a result should be."""

    def __init__(self, source: str, what: str) -> None:
        super().__init__(
            f"{source} is not a result.", f"It holds {what}.", "Give the results themselves, not what was made of them."
        )


def parse(source: str, content: bytes) -> ResultDocument:
    """Return the result document in `content`; raises BenchbotError that names the flaw and its place."""
    try:
        document = json.loads(content)
    except RecursionError as error:
        raise not_a_result(source, "It is nested too deeply.") from error
    except ValueError as error:  # broken JSON, text that is not Unicode, absurdly long numbers
        raise not_a_result(source, f"It is not valid JSON: {error}.") from error
    if not isinstance(document, dict):
        raise not_a_result(source, f"It holds a {type(document).__name__} where a result's mapping should be.")
    if "scores" in document and "results" not in document:
        raise DerivedDocumentError(source, "scores")
    if "method" in document and "task_details" not in document:
        raise DerivedDocumentError(source, "what a method says of results")
    version = document.get("version", results.VERSION)
    if version != results.VERSION:
        raise not_a_result(
            source,
            f"It is a result of version {version!r:.20}; this BenchBot reads version {results.VERSION} "
            "and results of BenchBot v2.",
        )
    schema.check(document, "result", Path(source))
    result = ResultDocument(source, cast(Result, document))
    for key in ("seed", "repeat"):
        value = result.selection.get(key)
        if value is not None and (isinstance(value, bool) or not isinstance(value, int)):
            raise not_a_result(source, f"{value!r:.40} is no {key}: a whole number is, at /provenance/selection/{key}.")
    return result


def not_a_result(source: str, why: str) -> BenchbotError:
    """Return the error for a file that holds no result."""
    return BenchbotError(
        f"{source} is not a result.",
        why,
        "Give JSON files that a solution saved, or ZIP archives of them.",
    )
