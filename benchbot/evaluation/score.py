"""Scoring: one result against its ground truths, or many files into one summary with its coverage and explanation."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Required, TypedDict, Unpack, cast

from benchbot.core import long_work, plugin_manager, results
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.documents import GroundTruth, Result
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.evaluation import intervals
from benchbot.evaluation.collect import collect, has_valid_results
from benchbot.evaluation.coverage import Coverage, Missing, counted_rows, means_of
from benchbot.evaluation.ground_truths import GroundTruths, digest, environment_of
from benchbot.evaluation.result_document import ResultDocument

EXPLANATION_VERSION = 1
_CHECKED_OBJECTS = 1000

Document = dict[str, Any]


def evaluate(result: Mapping[str, Any], ground_truths: Sequence[Mapping[str, Any]], method: str = "omq") -> Document:
    """Return the scores document of one result, scored against the ground truth of each of its scenes, in order.

    Raises BenchbotError for a method that is not installed and for a result that breaks its format.
    """
    scored = ResultDocument("", cast(Result, result))
    evaluator = choose_method(plugin_manager.load(), method, scored.results_format)
    row = _row(evaluator, scored, cast(Sequence[GroundTruth], ground_truths)) | {"source": None}
    coverage = Coverage(scored=[scored])
    return _document(evaluator, result, result["environment_details"], [row], row["scores"], coverage)


class Options(TypedDict, total=False):
    """Options of `score_files`; `catalog` is required."""

    catalog: Required[Catalog]
    method: str | None
    """Its name; the one that fits the task when it is None."""
    ground_truth_paths: Sequence[Path] | None
    """Files to use instead of the ground truths of the plug-ins."""
    required_task: str | None
    """Leave out results of other tasks."""
    required_envs: Sequence[str] | None
    """Leave out results of other environments, and count those of these that are missing."""
    missing: Missing
    """How results count that are missing, broken or of failed episodes: as zero without it."""
    over: intervals.Over
    """The units that intervals take for a sample of many; places without it."""


@dataclass(frozen=True)
class Evaluation:
    """The scores document of files, and every scored result with its ground truths, in the order of the rows."""

    document: Document
    evaluator: Evaluator
    scored: Sequence[tuple[ResultDocument, Sequence[GroundTruth]]]


def evaluate_files(paths: Sequence[Path], **options: Unpack[Options]) -> Document:
    """Return the scores document of all results in `paths`: JSON files, ZIP archives and folders of them.

    A file that cannot be scored does not stop the others: it is listed in `coverage.missing` with the reason, and so
    are failed episodes and required environments without a result; `missing` says whether these count as zero or are
    left out. Raises BenchbotError when nothing at all can be scored.
    """
    return score_files(paths, **options).document


def score_files(paths: Sequence[Path], **options: Unpack[Options]) -> Evaluation:
    """Score as `evaluate_files` does; return the results and the ground truths with the scores document."""
    catalog, missing = options["catalog"], options.get("missing", "zero")
    coverage = Coverage(missing_counts=missing)
    collected = collect(paths, catalog, options.get("required_task"), options.get("required_envs"), coverage)
    if not collected:
        raise _nothing_scored(coverage)
    evaluator = method_for_task(catalog, options.get("method"), collected[0].document["task_details"])
    truths = GroundTruths.of(catalog, options.get("ground_truth_paths"))
    scored: list[tuple[ResultDocument, Sequence[GroundTruth]]] = []
    rows: list[Document] = []
    for result in long_work.counted("Scoring results", collected):
        if not has_valid_results(result, catalog, coverage):
            continue
        try:
            scenes = result.document["environment_details"] if evaluator.ground_truth_formats else []
            found = [truths.find(environment_of(scene), evaluator.ground_truth_formats) for scene in scenes]
            rows.append(_row(evaluator, result, found))
            scored.append((result, found))
        except BenchbotError as error:
            coverage.broken(result, error)
    if not rows and (coverage.errors or missing == "leave-out"):
        raise _nothing_scored(coverage)
    coverage.scored = [result for result, _ in scored]
    counted = counted_rows(rows, coverage.as_dict())
    combined = evaluator.combine([row["scores"] for row in counted])
    details = [result.document["environment_details"] for result in coverage.scored]
    document = _document(evaluator, collected[0].document, details, rows, combined, coverage)
    over = options.get("over", intervals.Over.PLACES)
    means = means_of(combined, counted, document["coverage"]["expected"], evaluator.combine([{}]))
    document["coverage"] |= {"means_of": means} if means else {}
    document |= intervals.of_rows(counted, evaluator.combine, over=over, scores=evaluator.scores)
    return Evaluation(document, evaluator, scored)


def validate_files(
    paths: Sequence[Path],
    *,
    catalog: Catalog,
    required_task: str | None = None,
    required_envs: Sequence[str] | None = None,
) -> Document:
    """Return the coverage of `evaluate_files` before any scoring: how many results are valid, why others are not."""
    coverage = Coverage()
    collected = collect(paths, catalog, required_task, required_envs, coverage)
    checked = long_work.counted("Checking results", collected)
    coverage.scored = [result for result in checked if has_valid_results(result, catalog, coverage)]
    return coverage.as_dict()


def method_for_task(catalog: Catalog, name: str | None, task_details: Mapping[str, Any]) -> Evaluator:
    """Return the named method, or the task's `evaluation_method`, or the only one that scores its results format.

    The task is the one in the result, else the installed one of its name. Raises BenchbotError as `choose_method`.
    """
    named = name or task_details.get("evaluation_method")
    if named is None and task_details["name"] in catalog.names("tasks"):
        named = catalog.get("tasks", task_details["name"]).data.get("evaluation_method")
    return choose_method(catalog.plugins, named, task_details.get("results_format"))


def choose_method(plugins: plugin_manager.Plugins, name: str | None, results_format: str | None) -> Evaluator:
    """Return the named method, or the only installed one that scores results of this format.

    Raises BenchbotError when there is none, when there are several, and when the named one does not read the format.
    """
    if name is not None:
        method: Evaluator = plugins.record("evaluators", name)
        if results_format not in method.result_formats:
            raise BenchbotError(
                f"The method '{name}' cannot score these results.",
                f"They have the format {results_format!r}; it reads: {', '.join(sorted(method.result_formats))}.",
                "Leave the method out to have the right one chosen.",
            )
        return method
    installed: list[Evaluator] = [provided.value for provided in plugins.pool("evaluators").values()]
    fitting = [method for method in installed if results_format in method.result_formats]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        raise BenchbotError(
            "There are several methods that score these results.",
            f"For the format '{results_format}': {', '.join(sorted(method.name for method in fitting))}.",
            "Choose one with --method.",
        )
    known = ", ".join(sorted(method.name for method in installed)) or "none"
    raise BenchbotError(
        "There is no method that scores these results.",
        f"They have the format {results_format!r}. Installed methods: {known}.{plugins.broken_hint()}",
        "Install one, for object maps: benchbot install benchbot-eval-omq",
    )


def explain(evaluation: Evaluation, catalog: Catalog | None = None, frames: Path | None = None) -> Document:
    """Return how the scores of all results came about (schema `explanation`), in the order of rows; holds ground truth.

    With a catalog, which knows robots and walls, objects have the evidence of what was recorded beside their results,
    or in the folder `frames`.
    Raises BenchbotError for a method that does not explain its scores.
    """
    evaluator = evaluation.evaluator
    if evaluator.explain is None:
        raise BenchbotError(
            f"The method '{evaluator.name}' does not explain its scores.",
            "It has no function 'explain'.",
            "Leave --explain out.",
        )
    entries = []
    absent = [item["source"] for item in evaluation.document["coverage"]["missing"]]
    sources = [source for source in [*(result.source for result, _ in evaluation.scored), *absent] if source]
    folders = Counter(Path(source).parent for source in sources)
    for result, ground_truths in long_work.counted("Explaining scores", evaluation.scored):
        entry = evaluator.explain(result.document, ground_truths)
        if entry.get("objects"):
            from benchbot.evaluation import breakdown, evidence
            from benchbot.evaluation.frames import folders_of

            if catalog is not None:
                alone = folders[Path(result.source or "").parent] == 1
                places = folders_of(result.source, alone=alone) if frames is None else [frames]
                entry = evidence.with_evidence(entry, result.document, places, catalog)
            told = entry.get("diagnosis", {})
            entry["diagnosis"] = {**told, "breakdown": breakdown.breakdown(entry["objects"])}
        about = {"source": result.source, "environment": result.environment, **result.condition}
        entries.append({**entry, **about})
    method = {"name": evaluator.name, "version": evaluator.version}
    return {"version": EXPLANATION_VERSION, "method": method, "results": entries}


def write_explanation(path: Path, document: Document) -> None:
    """Write an explanation atomically; raises BenchbotError when it is not valid or cannot be written."""
    # Checking takes 0.3 ms for each object, and all are alike.
    entries = [
        {**entry, "objects": entry["objects"][:_CHECKED_OBJECTS]} if isinstance(entry.get("objects"), list) else entry
        for entry in document["results"]
    ]
    schema.check({**document, "results": entries}, "explanation", path)
    results.write_json(path, document)


def _row(evaluator: Evaluator, result: ResultDocument, ground_truths: Sequence[GroundTruth]) -> Document:
    values = evaluator.evaluate(result.document, ground_truths)
    for name, value in values.items():
        if not math.isfinite(value):
            raise BenchbotError(
                f"The method '{evaluator.name}' gave no usable score.",
                f"{name} of {result.source or 'the result'} is {value}.",
                f"Report this to the author of the method '{evaluator.name}'.",
            )
    return {
        "source": result.source,
        "environment": result.environment,
        **result.condition,
        "scores": {name: float(value) for name, value in values.items()},
        "ground_truths": [
            {"environment": environment_of(truth["environment"]), "sha256": digest(truth)} for truth in ground_truths
        ],
        "failure": result.failure,
        "provenance": result.document.get("provenance"),
    }


def _document(
    evaluator: Evaluator,
    result: Mapping[str, Any],
    environment_details: list[Any],
    rows: list[Document],
    combined: dict[str, float],
    coverage: Coverage,
) -> Document:
    method = {
        "name": evaluator.name,
        "version": evaluator.version,
        "headline": evaluator.headline or next(iter(combined)),
    }
    reading = {name: asdict(evaluator.scores[name]) for name in combined if name in evaluator.scores}
    return {
        "version": results.SCORES_VERSION,
        "method": method | ({"scores": reading} if reading else {}),
        "task_details": result["task_details"],
        "environment_details": environment_details,
        "scores": combined,
        "rows": rows,
        "coverage": coverage.as_dict(),
    }


def _nothing_scored(coverage: Coverage) -> BenchbotError:
    fixes = "\n".join(dict.fromkeys(error.fix for error in coverage.errors))
    otherwise = "Hand in the result of an episode that did not fail, or count what is missing as zero."
    return coverage.nothing("None of the results can be scored.", coverage.missing, fixes or otherwise)
