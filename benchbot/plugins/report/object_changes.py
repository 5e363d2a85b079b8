"""The true objects that one set of results found and another did not; they show the ground truth."""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, Unpack

from benchbot.evaluation import score
from benchbot.evaluation.score import Options
from benchbot.plugins.report.pairing import label

Document = dict[str, Any]
Place = tuple[str, int]
"""A scene, and the number of an object among those of its ground truth."""
FOUND, MISSED = "match", "false_negative"


def object_changes(sets: Mapping[str, Path], **options: Unpack[Options]) -> list[Document]:
    """Return for each two sets, by name, which objects the first found and the second did not, and the reverse.

    Only results of the same episode are held against each other. `sets` are files or folders of results, as scores
    documents do not say which objects were found. Raises BenchbotError for a method that does not explain its scores.
    """
    verdicts = {name: _verdicts(path, options) for name, path in sets.items()}
    return [_changes(a, b, verdicts) for a, b in combinations(sets, 2)]


def _changes(a: str, b: str, verdicts: Mapping[str, Mapping[str, Mapping[Place, Document]]]) -> Document:
    won: list[Document] = []
    lost: list[Document] = []
    both = neither = 0
    episodes = verdicts[a].keys() & verdicts[b].keys()
    for episode in episodes:
        here, there = verdicts[a][episode], verdicts[b][episode]
        for place in here.keys() & there.keys():
            found, was = here[place]["verdict"] == FOUND, there[place]["verdict"] == FOUND
            if found == was:
                both, neither = both + found, neither + (not found)
                continue
            why = (there if found else here)[place]["why"]
            row = {"episode": episode, "class": here[place]["truth_label"] or "", "truth": place[1], "why": why}
            (won if found else lost).append(row)
    counts = {"episodes": len(episodes), "both": both, "neither": neither}
    return {"a": a, "b": b, "won": _ordered(won), "lost": _ordered(lost), **counts}


def _verdicts(path: Path, options: Options) -> dict[str, dict[Place, Document]]:
    """Return what became of each true object, by the words of its episode; what is ignored is left out."""
    evaluation = score.score_files([path], **options)
    entries = score.explain(evaluation)["results"]
    robots = [str(result.selection.get("robot", "")) for result, _ in evaluation.scored]
    several = {name for name, count in Counter(map(label, entries)).items() if count > 1}
    found: dict[str, dict[Place, Document]] = {}
    for entry, robot in zip(entries, robots, strict=True):
        name = label(entry)
        # As of a fleet: without its robot, one result would stand for all of them.
        key = f"{name}, {robot}" if name in several else name
        counted = (item for item in entry.get("objects", ()) if item["verdict"] in (FOUND, MISSED))
        found[key] = {(str(item["scene"]), int(item["truth"])): item for item in counted if item["truth"] is not None}
    return found


def _ordered(rows: Sequence[Document]) -> list[Document]:
    return sorted(rows, key=lambda row: (row["class"], row["episode"], row["truth"]))
