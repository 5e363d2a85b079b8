"""Scoring: one result against its ground truths, or many files into one summary with its coverage."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchbot.core import plugins, scores
from benchbot.core.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.hookspecs import Evaluator
from benchbot.evaluation import methods
from benchbot.evaluation.collect import collect, has_valid_results
from benchbot.evaluation.coverage import Coverage
from benchbot.evaluation.ground_truths import GroundTruths, digest, environment_of
from benchbot.evaluation.inputs import Submission

Document = dict[str, Any]


def evaluate(result: Document, ground_truths: Sequence[Document], method: str = "omq") -> Document:
    """Return the scores document of one result, scored against the ground truth of each of its scenes, in order.

    Raises BenchbotError for a method that is not installed and for a result that breaks its format.
    """
    submission = Submission("", result)
    evaluator = methods.choose(plugins.load(), method, submission.results_format)
    row = _row(evaluator, submission, ground_truths) | {"source": None}
    return _document(evaluator, result, result["environment_details"], [row], row["scores"], Coverage(scored=1))


def evaluate_files(
    paths: Sequence[Path],
    *,
    catalog: Catalog,
    method: str | None = None,
    ground_truth_paths: Sequence[Path] | None = None,
    required_task: str | None = None,
    required_envs: Sequence[str] | None = None,
) -> Document:
    """Return the scores document of all results in `paths`: JSON files and ZIP archives of them.

    `required_task` leaves out results of other tasks, `required_envs` those of other environments. A file that cannot
    be scored does not stop the others: it is listed in `coverage.missing` with the reason and counts as zero, and so
    do failed episodes and required environments without a result. The method is the one for the task's results format
    unless it is named; ground truths are those of the plug-ins unless `ground_truth_paths` names others.
    Raises BenchbotError when nothing at all can be scored.
    """
    coverage = Coverage()
    submissions = collect(paths, catalog, required_task, required_envs, coverage)
    evaluator = methods.choose(catalog.plugins, method, submissions[0].results_format)
    truths = GroundTruths.of(catalog, ground_truth_paths)
    scored: list[Submission] = []
    rows: list[Document] = []
    for submission in submissions:
        if not has_valid_results(submission, catalog, coverage):
            continue
        try:
            found = [
                truths.find(environment_of(scene), evaluator.ground_truth_formats)
                for scene in submission.document["environment_details"]
            ]
            rows.append(_row(evaluator, submission, found))
            scored.append(submission)
        except BenchbotError as error:
            coverage.broken(submission, error)
    if not rows and coverage.errors:
        raise _nothing_scored(coverage)
    handed_in = {submission.environment for submission in submissions}
    for environment in dict.fromkeys(required_envs or ()):
        if environment not in handed_in:
            coverage.absent(environment)
    coverage.scored = len(rows)
    combined = evaluator.combine([*(row["scores"] for row in rows), *({} for _ in coverage.missing)])
    scenes = [submission.document["environment_details"] for submission in scored]
    return _document(evaluator, submissions[0].document, scenes, rows, combined, coverage)


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
    coverage.scored = sum(has_valid_results(submission, catalog, coverage) for submission in submissions)
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
    return {
        "version": scores.VERSION,
        "method": {
            "name": evaluator.name,
            "version": evaluator.version,
            "headline": evaluator.headline or next(iter(combined)),
        },
        "task_details": result["task_details"],
        "environment_details": environment_details,
        "scores": combined,
        "rows": rows,
        "coverage": coverage.as_dict(),
    }


def _nothing_scored(coverage: Coverage) -> BenchbotError:
    if len(coverage.errors) == 1:
        return coverage.errors[0]
    return BenchbotError(
        "None of the results can be scored.",
        "\n".join(f"{item['source']}: {item['reason']}" for item in coverage.missing),
        "\n".join(dict.fromkeys(error.fix for error in coverage.errors)),
    )
