"""The results in the folder of a batch: its plan says which episodes there are, and their names where each result is.

plan.json                     has `episodes`, each with its `label`, its `key` and what was selected for it
episodes/LABEL-KEY8/          result.json (there: done), attempts.jsonl, attempt-N/ (failed), work/ (of the solution)
results/LABEL-KEY8.json       copies of the results, made at the end (of several solutions: results/SOLUTION/…)
"""

import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from benchbot.evaluation.result_document import NUMBERS, is_own

PLAN, EPISODES, RESULTS = "plan.json", "episodes", "results"
RESULT, JOURNAL, ATTEMPT, WORK = "result.json", "attempts.jsonl", "attempt-", "work"
SNAPSHOT = "snapshot.json"
"""The file beside the files of a solution that was kept."""
KEY_DIGITS = 8
MOST_LEVELS = 3
"""A result is at most so many folders below that of its batch: in `episodes/NAME`, or `results/SOLUTION`."""
ADDED_TO = "was added to: it had"
"""In the warning about a batch whose number of episodes was not fixed before; scores documents keep it."""


@dataclass(frozen=True)
class PlannedResult:
    """An episode of a plan, and where its result is, or will be."""

    batch: Path
    task: str
    episode: dict[str, Any]

    @property
    def path(self) -> Path:
        """The result, or its copy where only that is there."""
        name = episode_name(self.episode["label"], self.episode["key"])
        path = self.batch / EPISODES / name / RESULT
        copy = self.batch / RESULTS / (self.solution or "") / f"{name}.json"
        return copy if copy.is_file() and not path.is_file() else path

    @property
    def source(self) -> str:
        """The path as that of a result."""
        return str(self.path)

    @property
    def solution(self) -> str | None:
        """The name of its solution, in a batch of several."""
        name: str | None = self.episode.get("solution")
        return name

    @property
    def environment(self) -> str:
        """The environment string."""
        return str(self.episode["environment"])

    @property
    def condition(self) -> dict[str, Any]:
        """The keys that tell it from other episodes of its environment, as those of a result."""
        numbers: dict[str, Any] = {name: self.episode.get(name) for name in NUMBERS}
        return {**numbers, **({"settings": self.episode["settings"]} if self.episode.get("settings") else {})}


def episode_name(label: str, key: str) -> str:
    """Return the name of an episode's folder."""
    return f"{label}-{key[:KEY_DIGITS]}"


def planned(folder: Path) -> list[PlannedResult] | None:
    """Return the episodes of the batch in a folder; None for a folder without a plan that can be read."""
    try:
        document = json.loads((folder / PLAN).read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    episodes = document["episodes"] if is_own(document, "plan") else None
    if not isinstance(episodes, list) or not all(map(_is_planned, episodes)):
        return None
    return [PlannedResult(folder, str(document["task"]), episode) for episode in episodes]


def added_to(paths: Iterable[Path]) -> list[str]:
    """Return what statistics do not hold for, of each batch that has these results and to which episodes were added."""
    plans: dict[Path, None] = {}
    for path in map(Path.absolute, paths):
        found = (folder / PLAN for folder in (path, *path.parents[:MOST_LEVELS]) if (folder / PLAN).is_file())
        plans |= dict.fromkeys(islice(found, 1))
    return [note for plan in plans if (note := _added_to(plan)) is not None]


def _added_to(path: Path) -> str | None:
    with suppress(OSError, ValueError, RecursionError):
        document = json.loads(path.read_bytes())
        if is_own(document, "plan") and document.get("grown_from"):
            sizes = ", then ".join(map(str, document["grown_from"]))
            return (
                f"The batch {path.parent.name} {ADDED_TO} {sizes} episodes of {len(document['episodes'])} when results "
                "of it could be seen. Intervals and p-values hold for a number of episodes that was fixed before."
            )
    return None


def _is_planned(episode: Any) -> bool:
    """Say whether an entry of a plan names an episode, whose folder is below that of the batch."""
    texts = [episode.get(key) for key in ("key", "label", "environment")] if isinstance(episode, dict) else [None]
    if not all(isinstance(text, str) for text in texts):
        return False
    return not set(episode["label"] + episode["key"] + str(episode.get("solution"))) & set("/\0")


def of_no_plan(folder: Path, found: list[PlannedResult]) -> Iterator[Path]:
    """Yield the results of episodes that the plan has no more, since the batch was changed."""
    known = {episode.path for episode in found}
    with suppress(OSError):
        for path in sorted((folder / EPISODES).glob(f"*/{RESULT}")):
            if path not in known:
                yield path
