"""The true objects that one set of results found and another did not; they show the ground truth."""

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, Generic, TypeVar, Unpack

from benchbot.evaluation import score
from benchbot.evaluation.score import Options
from benchbot.plugins.drawing.map_model import FALSE_NEGATIVE, MATCH
from benchbot.plugins.report.pairing import label

Document = dict[str, Any]
Place = tuple[str, int]
"""A scene, and the number of an object among those of its ground truth."""
Name = TypeVar("Name", bound=Hashable)


@dataclass(frozen=True)
class Changes(Generic[Name]):
    """The true objects that one of two results found alone, and how many both or neither found."""

    won: list[Name]
    lost: list[Name]
    both: int
    neither: int


def changes(mine: Mapping[Name, str | None], theirs: Mapping[Name, str | None]) -> Changes[Name]:
    """Hold the verdicts on true objects against each other; what either result is not judged by is left out."""
    judged = [name for name, verdict in mine.items() if {verdict, theirs.get(name)} <= {MATCH, FALSE_NEGATIVE}]
    found = {name: (mine[name] == MATCH, theirs[name] == MATCH) for name in judged}
    named = {kind: [name for name, each in found.items() if each == kind] for kind in {*found.values()}}
    won, lost, both, neither = (
        named.get(kind, []) for kind in ((True, False), (False, True), (True, True), (False, False))
    )
    return Changes(won, lost, len(both), len(neither))


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
        found = changes(*({place: str(item["verdict"]) for place, item in each.items()} for each in (here, there)))
        both, neither = both + found.both, neither + found.neither
        for rows, places, missed in ((won, found.won, there), (lost, found.lost, here)):
            rows += [
                {
                    "episode": episode,
                    "class": here[place]["truth_label"] or "",
                    "truth": place[1],
                    "why": missed[place]["why"],
                }
                for place in places
            ]
    counts = {"episodes": len(episodes), "both": both, "neither": neither}
    return {"a": a, "b": b, "won": _ordered(won), "lost": _ordered(lost), **counts}


def _verdicts(path: Path, options: Options) -> dict[str, dict[Place, Document]]:
    """Return what became of each true object, by the words of its episode."""
    evaluation = score.score_files([path], **options)
    entries = score.explain(evaluation)["results"]
    robots = [str(result.selection.get("robot", "")) for result, _ in evaluation.scored]
    several = {name for name, count in Counter(map(label, entries)).items() if count > 1}
    found: dict[str, dict[Place, Document]] = {}
    for entry, robot in zip(entries, robots, strict=True):
        name = label(entry)
        # As of a fleet: without its robot, one result would stand for all of them.
        key = f"{name}, {robot}" if name in several else name
        true = (item for item in entry.get("objects", ()) if item["truth"] is not None)
        found[key] = {(str(item["scene"]), int(item["truth"])): item for item in true}
    return found


def _ordered(rows: Sequence[Document]) -> list[Document]:
    return sorted(rows, key=lambda row: (row["class"], row["episode"], row["truth"]))
