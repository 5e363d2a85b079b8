"""Scoring: one result against its ground truths, or many files into one summary with its coverage."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Required, TypedDict, Unpack

from benchbot.core import plugin_manager, scores
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.evaluation import intervals, methods
from benchbot.evaluation.collect import collect, has_valid_results
from benchbot.evaluation.coverage import Coverage, Missing
from benchbot.evaluation.ground_truths import GroundTruths, digest, environment_of
from benchbot.evaluation.inputs import Submission

Document = dict[str, Any]


def evaluate(result: Document, ground_truths: Sequence[Document], method: str = "omq") -> Document:
    """Return the scores document of one result, scored against the ground truth of each of its scenes, in order.

    Raises BenchbotError for a method that is not installed and for a result that breaks its format.
    """
    submission = Submission("", result)
    evaluator = methods.choose(plugin_manager.load(), method, submission.results_format)
    row = _row(evaluator, submission, ground_truths) | {"source": None}
    coverage = Coverage(scored=[submission])
    return _document(evaluator, result, result["environment_details"], [row], row["scores"], coverage)


class Options(TypedDict, total=False):
    """How files are scored; `catalog` is required."""

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
    """How results count that are missing, broken or of failed episodes; zero without it."""
    over: intervals.Over
    """What intervals take for a sample of many; places without it."""


@dataclass(frozen=True)
class Evaluation:
    """What came of scoring files: the scores document, and every scored result with its ground truths, as its rows."""

    document: Document
    evaluator: Evaluator
    scored: Sequence[tuple[Submission, Sequence[Document]]]


def evaluate_files(paths: Sequence[Path], **options: Unpack[Options]) -> Document:
    """Return the scores document of all results in `paths`: JSON files, ZIP archives and folders of them.

    A file that cannot be scored does not stop the others: it is listed in `coverage.missing` with the reason, and so
    are failed episodes and required environments without a result; `missing` says whether these count as zero or are
    left out. Raises BenchbotError when nothing at all can be scored.
    """
    return score_files(paths, **options).document


def score_files(paths: Sequence[Path], **options: Unpack[Options]) -> Evaluation:
    """Score as `evaluate_files` does, and keep what the scores came from."""
    catalog, missing = options["catalog"], options.get("missing", "zero")
    coverage = Coverage(missing_counts=missing)
    submissions = collect(paths, catalog, options.get("required_task"), options.get("required_envs"), coverage)
    if not submissions:
        raise _nothing_scored(coverage)
    evaluator = methods.for_task(catalog, options.get("method"), submissions[0].document["task_details"])
    truths = GroundTruths.of(catalog, options.get("ground_truth_paths"))
    scored: list[tuple[Submission, Sequence[Document]]] = []
    rows: list[Document] = []
    for submission in submissions:
        if not has_valid_results(submission, catalog, coverage):
            continue
        try:
            scenes = submission.document["environment_details"] if evaluator.ground_truth_formats else []
            found = [truths.find(environment_of(scene), evaluator.ground_truth_formats) for scene in scenes]
            rows.append(_row(evaluator, submission, found))
            scored.append((submission, found))
        except BenchbotError as error:
            coverage.broken(submission, error)
    if not rows and (coverage.errors or missing == "leave-out"):
        raise _nothing_scored(coverage)
    coverage.scored = [submission for submission, _ in scored]
    counted = [*rows, *coverage.rows_of_missing()]
    combined = evaluator.combine([row["scores"] for row in counted])
    details = [submission.document["environment_details"] for submission in coverage.scored]
    document = _document(evaluator, submissions[0].document, details, rows, combined, coverage)
    over = options.get("over", intervals.Over.PLACES)
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
    submissions = collect(paths, catalog, required_task, required_envs, coverage)
    coverage.scored = [submission for submission in submissions if has_valid_results(submission, catalog, coverage)]
    return coverage.as_dict()


def _row(evaluator: Evaluator, submission: Submission, ground_truths: Sequence[Document]) -> Document:
    values = evaluator.evaluate(submission.document, ground_truths)
    for name, value in values.items():
        if not math.isfinite(value):
            raise BenchbotError(
                f"The method '{evaluator.name}' gave no usable score.",
                f"{name} of {submission.source or 'the result'} is {value}.",
                f"Report this to the author of the method '{evaluator.name}'.",
            )
    return {
        "source": submission.source,
        "environment": submission.environment,
        **submission.condition,
        "scores": {name: float(value) for name, value in values.items()},
        "ground_truths": [
            {"environment": environment_of(truth["environment"]), "sha256": digest(truth)} for truth in ground_truths
        ],
        "failure": submission.failure,
        "provenance": submission.document.get("provenance"),
    }


def _document(
    evaluator: Evaluator,
    result: Document,
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
        "version": scores.VERSION,
        "method": method | ({"scores": reading} if reading else {}),
        "task_details": result["task_details"],
        "environment_details": environment_details,
        "scores": combined,
        "rows": rows,
        "coverage": coverage.as_dict(),
    }


def _nothing_scored(coverage: Coverage) -> BenchbotError:
    if len(coverage.errors) == 1 == len(coverage.missing):
        return coverage.errors[0]
    fixes = dict.fromkeys(error.fix for error in coverage.errors)
    return BenchbotError(
        "None of the results can be scored.",
        "\n".join(f"{item['source'] or item['environment']}: {item['reason']}" for item in coverage.missing),
        "\n".join(fixes) or "Hand in the result of an episode that did not fail, or count what is missing as zero.",
    )
