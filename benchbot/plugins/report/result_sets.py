"""Named sets of results to compare, read as scores documents or scored now, all by one method on one task."""

import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.core.results import read_scores
from benchbot.evaluation.coverage import counted_rows
from benchbot.evaluation.result_files import SIZE_LIMIT_BYTES, named
from benchbot.evaluation.score import Evaluation, Options, score_files

Document = dict[str, Any]


@dataclass(frozen=True)
class ResultSet:
    """A name and the scores document of all results of the set.

    `evaluation` has the results and their ground truths, None of a set that was given as a scores document.
    """

    name: str
    document: Document
    evaluation: Evaluation | None = None

    @property
    def rows(self) -> list[Document]:
        """The rows that count: the missing ones among them without scores, unless they were left out."""
        return counted_rows(self.document["rows"], self.document["coverage"])

    @property
    def failures(self) -> dict[str, int]:
        """The number of failed episodes by class."""
        items = [*self.document["rows"], *self.document["coverage"]["missing"]]
        return dict(sorted(Counter(str(item["failure"]) for item in items if item["failure"] is not None).items()))

    @property
    def robots(self) -> list[str]:
        """The names of the robots, as far as the results say."""
        selections = [(row["provenance"] or {}).get("selection") or {} for row in self.document["rows"]]
        return sorted({str(selection["robot"]) for selection in selections if "robot" in selection})

    @property
    def replays(self) -> int:
        """The number of results of recordings, where nothing was driven."""
        return sum("replay" in (row["provenance"] or {}) for row in self.document["rows"])


def read(texts: Sequence[str], **options: Unpack[Options]) -> list[ResultSet]:
    """Return the sets that `texts` name: `PATH` or `NAME=PATH`, of result files, folders, archives or scores documents.

    Results are scored as `evaluate_files` does with `options`. Raises BenchbotError for fewer than two sets, for equal
    names and for sets that were not scored alike.
    """
    sets_named = distinct(texts)
    sets = [_scored(name, path, options) for name, path in sets_named]
    for other in sets[1:]:
        require_alike(sets[0], other)
    return sets


def distinct(texts: Sequence[str]) -> list[tuple[str, Path]]:
    """Return names and paths of sets; raises BenchbotError for fewer than two, and for equal names."""
    sets_named = [named(text) for text in texts]
    if len(sets_named) < 2:
        raise BenchbotError(
            "There is nothing to compare with.",
            "One set of results was given.",
            "Name two or more: benchbot compare A B",
        )
    for name, count in Counter(name for name, _ in sets_named).items():
        if count > 1:
            raise BenchbotError(
                f"{count} sets are called '{name}'.",
                f"They are: {', '.join(str(path) for other, path in sets_named if other == name)}.",
                "Give them names: benchbot compare before=PATH after=PATH",
            )
    return sets_named


def are_named(texts: Sequence[str]) -> bool:
    """Say whether sets to be held against one another are given, `NAME=PATH`, and not just files."""
    return any(named(text)[1] != Path(text) for text in texts)


def evaluator_of(sets: Sequence[ResultSet], catalog: Catalog) -> Evaluator:
    """Return the method that the sets were scored by.

    Raises BenchbotError when it is not installed as it was then, or does not get the sets' scores from their rows.
    """
    method = sets[0].document["method"]
    evaluator: Evaluator = catalog.plugins.record("evaluators", method["name"])
    if evaluator.version != method["version"]:
        raise BenchbotError(
            f"The scores are of another version of the method '{evaluator.name}'.",
            f"They are of version {method['version']}; installed is {evaluator.version}.",
            "Give the results instead of their scores, or install that version.",
        )
    for results in sets:
        _require_sum(results, evaluator)
    return evaluator


def _scored(name: str, path: Path, options: Options) -> ResultSet:
    if path.suffix.lower() == ".json" and _holds_scores(path):
        return ResultSet(name, read_scores(path))
    evaluation = score_files([path], **options)
    return ResultSet(name, evaluation.document, evaluation)


def _holds_scores(path: Path) -> bool:
    """Say whether a file is a scores document. An unreadable file is none; scoring it raises the error."""
    try:
        document = json.loads(path.read_bytes()) if path.stat().st_size <= SIZE_LIMIT_BYTES else None
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(document, dict) and "scores" in document and "results" not in document


def require_alike(a: ResultSet, b: ResultSet) -> None:
    """Raise BenchbotError when two sets are not of one task, or were not scored alike."""
    alike_a, alike_b = _must_agree(a), _must_agree(b)
    for what, value in alike_a.items():
        if value != alike_b[what]:
            raise BenchbotError(
                f"'{a.name}' and '{b.name}' cannot be compared.",
                f"The {what} differs: {value} and {alike_b[what]}.",
                "Compare results of one task that were scored alike; given as results, they are scored anew.",
            )
    truths = {truth["environment"]: truth["sha256"] for row in a.document["rows"] for truth in row["ground_truths"]}
    for row in b.document["rows"]:
        for truth in row["ground_truths"]:
            if truths.get(truth["environment"], truth["sha256"]) != truth["sha256"]:
                raise BenchbotError(
                    f"'{a.name}' and '{b.name}' cannot be compared.",
                    f"They were scored against different ground truths of {truth['environment']}.",
                    "Score both anew: give the results instead of their scores.",
                )

    lists = dict(_episode_lists(a))
    for name, sha256 in _episode_lists(b):
        if lists.get(name, sha256) != sha256:
            raise BenchbotError(
                f"'{a.name}' and '{b.name}' cannot be compared.",
                f"They are of different versions of the episodes {name}: the same numbers start and end elsewhere.",
                "Run the episodes of one of them again, with the version that made the other.",
            )


def _episode_lists(results: ResultSet) -> Iterator[tuple[str, str]]:
    """Yield the name and the SHA-256 of the list of each row that is of an episode of one."""
    for row in results.document["rows"]:
        chosen = ((row["provenance"] or {}).get("selection") or {}).get("episode")
        if chosen is not None:
            yield chosen["list"], chosen["sha256"]


def _require_sum(results: ResultSet, evaluator: Evaluator) -> None:
    combined = evaluator.combine([row["scores"] for row in results.rows])
    for name, value in results.document["scores"].items():
        if not math.isclose(combined.get(name, math.nan), value, rel_tol=1e-9, abs_tol=1e-12):
            raise BenchbotError(
                f"The scores of '{results.name}' do not follow from its rows.",
                f"{name} is {value:.6g}; its rows give {combined.get(name, math.nan):.6g}.",
                "The document was changed: score the results again with benchbot eval.",
            )


def _must_agree(results: ResultSet) -> dict[str, str]:
    method, coverage = results.document["method"], results.document["coverage"]
    return {
        "task": results.document["task_details"]["name"],
        "method": method["name"],
        "version of the method": method["version"],
        "way in which missing results count": coverage.get("missing_counts", "zero"),
    }
