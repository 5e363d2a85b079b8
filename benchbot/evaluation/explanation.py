"""Explanations: how the scores of results came about. They hold ground truth."""

from pathlib import Path
from typing import Any

from benchbot.core import results
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator, Explain
from benchbot.evaluation.score import Evaluation

VERSION = 1
_CHECKED = 1000


def explainer(evaluator: Evaluator) -> Explain:
    """Return what explains the scores of a method; raises BenchbotError when it has nothing that does."""
    if evaluator.explain is None:
        raise BenchbotError(
            f"The method '{evaluator.name}' does not explain its scores.",
            "It has no function 'explain'.",
            "Leave --explain out.",
        )
    return evaluator.explain


def explain(evaluation: Evaluation) -> dict[str, Any]:
    """Return the explanation (schema `explanation`) of all scored results, in the order of their rows.

    Raises BenchbotError for a method that does not explain its scores.
    """
    evaluator = evaluation.evaluator
    said_by = explainer(evaluator)
    entries = []
    for submission, ground_truths in evaluation.scored:
        said = said_by(submission.document, ground_truths)
        about = {"source": submission.source, "environment": submission.environment, **submission.condition}
        entries.append({**said, **about})
    method = {"name": evaluator.name, "version": evaluator.version}
    return {"version": VERSION, "method": method, "results": entries}


def write(path: Path, document: dict[str, Any]) -> None:
    """Write an explanation atomically; raises BenchbotError when it is not valid or cannot be written."""
    schema.check({**document, "results": [_beginning(entry) for entry in document["results"]]}, "explanation", path)
    results.write_json(path, document)


def _beginning(entry: dict[str, Any]) -> dict[str, Any]:
    """Return an entry with its first objects only: what one of them is, all are, and checking takes 0.3 ms for each."""
    objects = entry.get("objects")
    return {**entry, "objects": objects[:_CHECKED]} if isinstance(objects, list) else entry
