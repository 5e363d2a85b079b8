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
_SHAPE = {"task_details", "environment_details", "results", "provenance"}
"""The keys of a result, of which it has two at least: that of a failed episode has no results, v2's no provenance."""
_OWN = {
    "scores": "scores",
    "explanation": "what a method says of results",
    "comparison": "a comparison of results",
    "bundle": "the manifest of a bundle",
    "plan": "the plan of a batch",
    "recording": "the note of a recording",
    "ground_truth": "a ground truth",
    "episodes": "a list of episodes",
}
"""The documents that BenchBot writes beside results, by their schemas, in words."""
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
    def is_replay(self) -> bool:
        """True when nothing was driven: the solution was shown a recording."""
        return "replay" in (self.document.get("provenance") or {})

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


class OtherDocumentError(BenchbotError):
    """A JSON document that is not shaped like a result; `is_own` says that BenchBot wrote it, by its schema."""

    def __init__(self, source: str, why: str, *, is_own: bool = False) -> None:
        fix = "Give JSON files that a solution saved, or ZIP archives of them; not what was made of them."
        super().__init__(f"{source} is not a result.", why, fix)
        self.is_own = is_own


def is_own(document: Any, kind: str) -> bool:
    """Say whether a document has the keys that the schema of a kind requires; those of v2's scores are enough."""
    required = {"scores"} if kind == "scores" else set(schema.schema(kind)["required"])
    return isinstance(document, dict) and required <= document.keys()


def parse(source: str, content: bytes) -> ResultDocument:
    """Return the result document in `content`; raises BenchbotError that names the flaw and its place.

    It is an OtherDocumentError for JSON that is not shaped like a result: that is no result, not even a broken one.
    """
    try:
        document = json.loads(content)
    except RecursionError as error:
        raise not_a_result(source, "It is nested too deeply.") from error
    except ValueError as error:  # broken JSON, text that is not Unicode, absurdly long numbers
        raise not_a_result(source, f"It is not valid JSON: {error}.") from error
    if not isinstance(document, dict):
        raise OtherDocumentError(source, f"It holds a {type(document).__name__} where a result's mapping should be.")
    if not document.keys() >= {"task_details", "results"}:
        own = next((words for kind, words in _OWN.items() if is_own(document, kind)), None)
        if own is not None:
            raise OtherDocumentError(source, f"It holds {own}.", is_own=True)
    if len(document.keys() & _SHAPE) < 2:
        raise OtherDocumentError(source, "It has no task_details and results, as a result has.")
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


def not_a_result(
    source: str, why: str, fix: str = "Give JSON files that a solution saved, or ZIP archives of them."
) -> BenchbotError:
    """Return the error for a file that holds no result."""
    return BenchbotError(f"{source} is not a result.", why, fix)
