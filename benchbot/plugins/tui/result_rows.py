"""Rows for a list of results, and their scores, explanations and reports."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.results import read_scores, write_scores

if TYPE_CHECKING:
    from benchbot.plugins.drawing.map_model import SceneMap

SCORES = "scores.json"
MOST_OBJECTS = 400
"""The most objects in an explanation on a screen; the file has them all."""


@dataclass(frozen=True)
class ResultRow:
    """One result, or a file that is not a result."""

    source: str
    """Its path, or `archive:member`."""
    task: str = ""
    robot: str = ""
    about: str = ""
    """Environment and seed, in words."""
    failure: str = ""
    score: str = ""
    """The headline score, where a scores document beside it tells."""
    steps: int | None = None
    problem: str = ""
    """The reason why it is not a result."""

    @property
    def value(self) -> float | None:
        """The number in its score."""
        number = self.score.split(" ")[1] if " " in self.score else ""
        with suppress(ValueError):
            return float(number)
        return None

    @property
    def path(self) -> Path:
        """The file that it is in."""
        path = Path(self.source)
        return path if path.exists() else Path(self.source.rpartition(":")[0])


@dataclass(frozen=True)
class Group:
    """Results that have something in common."""

    title: str
    count: int
    failed: int
    mean: float | None
    """The mean of the headline scores that are known."""
    score: str
    """The mean in words, and how many scores it is of."""


def grouped(found: Sequence[ResultRow], field: str) -> list[Group]:
    """Return the results by what a field of them says; files that are no results are left out."""
    parts: dict[str, list[ResultRow]] = {}
    for row in found:
        if not row.problem:
            parts.setdefault(str(getattr(row, field)) or "none", []).append(row)
    return [_group(title, rows) for title, rows in sorted(parts.items())]


def _group(title: str, found: Sequence[ResultRow]) -> Group:
    names = {row.score.partition(" ")[0] for row in found if row.value is not None}
    values = [row.value for row in found if row.value is not None]
    # Scores of several methods have no mean.
    mean = sum(values) / len(values) if len(names) == 1 else None
    said = "-" if mean is None else f"{names.pop()} {mean:.4f} of {len(values)}"
    return Group(title, len(found), sum(bool(row.failure) for row in found), mean, said)


def rows(paths: Sequence[Path]) -> Iterator[ResultRow]:
    """Yield the results in files, archives and folders as they are read; other files have a `problem`."""
    from benchbot.evaluation import result_files
    from benchbot.evaluation.result_document import ResultDocument

    known = _known_scores(paths)
    for item in result_files.read(paths):
        if isinstance(item, result_files.Unreadable):
            yield ResultRow(item.source, problem=f"{item.error.title} {item.error.why}")
        elif isinstance(item, result_files.OtherFile) and not item.is_own:
            yield ResultRow(item.source, problem=f"{item.source}: {item.why}")
        elif isinstance(item, ResultDocument):
            provenance = item.document.get("provenance") or {}
            yield ResultRow(
                source=item.source,
                task=item.task,
                robot=str(item.selection.get("robot", "")),
                about=item.about,
                failure=item.failure or "",
                score=known.get(_key(Path(item.source)), ""),
                steps=provenance.get("steps"),
            )


def scores_path(result: Path) -> Path:
    """Return the file for the scores of a result: beside it, with a name of its own."""
    if result.is_dir():
        return result / SCORES
    return result.with_name(SCORES if result.stem == "result" else f"{result.stem}.{SCORES}")


def evaluate(paths: Sequence[Path], catalog: Catalog, method: str | None = None) -> tuple[str, Path]:
    """Score results and write the document; return its table and its path. Raises BenchbotError."""
    from benchbot.cli.kit import scoring
    from benchbot.evaluation.score import evaluate_files

    document = evaluate_files(paths, catalog=catalog, method=method)
    target = scores_path(paths[0])
    write_scores(target, document)
    return "\n".join(scoring.table(document)), target


def explain(path: Path, catalog: Catalog) -> str:
    """Return why a result has its scores, object by object, in lines. It shows the truth. Raises BenchbotError."""
    from benchbot.cli.kit import scoring
    from benchbot.evaluation import score

    evaluation = score.score_files([path], catalog=catalog)
    lines = scoring.table(evaluation.document)
    explained = score.explain(evaluation)
    lines += ["", *scoring.diagnosis(explained, evaluation.document["method"]["headline"])]
    for entry in explained["results"]:
        objects = entry.get("objects")
        if objects is None:
            rest = {key: value for key, value in entry.items() if key not in ("source", "environment", "seed")}
            lines += ["", json.dumps(rest, indent=1, ensure_ascii=False)]
            continue
        lines.append("")
        lines += [_object_line(each) for each in objects[:MOST_OBJECTS]]
        if len(objects) > MOST_OBJECTS:
            lines.append(f"… and {len(objects) - MOST_OBJECTS} more: benchbot eval {path} --explain why.json")
    return "\n".join(lines)


def costs(paths: Sequence[Path], catalog: Catalog) -> str:
    """Return what went wrong in results, by kind of error, and the score that each kind costs: the dearest first.

    It shows the truth. Raises BenchbotError.
    """
    from benchbot.cli.kit import scoring
    from benchbot.evaluation import score

    evaluation = score.score_files(paths, catalog=catalog)
    explained = score.explain(evaluation)
    name = evaluation.document["method"]["headline"]
    counts: Counter[str] = Counter()
    gains: dict[str, float] = {}
    for entry in explained["results"]:
        for error in entry.get("diagnosis", {}).get("errors", []):
            counts[error["kind"]] += error["count"]
            gains[error["kind"]] = gains.get(error["kind"], 0.0) + error["gain"]
    number = max(len(explained["results"]), 1)
    total = [f"All {number} results: errors by kind, and the mean {name} that each kind costs"]
    total += [
        f"  {kind:<12} {counts[kind]:>6}  {gain / number:+.3f}"
        for kind, gain in sorted(gains.items(), key=lambda item: -item[1])
    ]
    if not gains:
        total = ["Nothing went wrong, or the method does not tell errors by kind."]
    return "\n".join([*total, "", *scoring.diagnosis(explained, name)])


def maps(paths: Mapping[str, Path], catalog: Catalog) -> dict[str, "SceneMap"]:
    """Return the maps of the first scenes of results, by title, with the truth where it is known."""
    from benchbot.plugins.drawing.scene_maps import maps_of_result

    return {title: maps_of_result(path, catalog)[0] for title, path in paths.items()}


def report(paths: Sequence[Path], catalog: Catalog) -> Path:
    """Write the report of results beside them; return its path. Raises BenchbotError."""
    from benchbot.core.atomic import write_text
    from benchbot.evaluation.score import score_files
    from benchbot.plugins.report.episodes import gather
    from benchbot.plugins.report.rendering import render

    first = paths[0]
    target = first / "report.html" if first.is_dir() else scores_path(first).with_name(f"{first.stem}-report.html")
    evaluation = score_files(paths, catalog=catalog)
    write_text(target, render(gather(evaluation, paths, catalog=catalog), "html"))
    return target


def headline_of(path: Path) -> str:
    """Return the headline score in a scores document, empty when it cannot be read."""
    from benchbot.cli.kit import scoring

    with suppress(BenchbotError):
        return scoring.headline(read_scores(path))
    return ""


def _object_line(item: dict[str, Any]) -> str:
    verdict = str(item["verdict"]).replace("_", " ")
    return f"{verdict:<16}{item['label'] or item['truth_label'] or '-'}\n    {item['why']}"


def _known_scores(paths: Sequence[Path]) -> dict[Path, str]:
    """Return the headline score of each result that a scores document in or beside `paths` tells of."""
    from benchbot.cli.kit import scoring

    known: dict[Path, str] = {}
    folders = [path if path.is_dir() else path.parent for path in paths]
    # Documents further down are of fewer results and newer: they come last and win.
    for found in sorted(file for folder in folders for file in folder.rglob(f"*{SCORES}")):
        with suppress(BenchbotError):
            document = read_scores(found)
            for row in document["rows"]:
                if row["source"] is not None:
                    known[_key(Path(row["source"]))] = scoring.headline({**document, "scores": row["scores"]})
            if len(document["rows"]) == 1:
                known[_key(found.with_name("result.json"))] = scoring.headline(document)
    return known


def _key(path: Path) -> Path:
    return path.absolute()
