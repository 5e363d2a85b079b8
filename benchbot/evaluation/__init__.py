"""Evaluation of results: validity, scores, intervals, comparisons, and coverage."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchbot.evaluation.score import evaluate, evaluate_files, validate_files

__all__ = ["evaluate", "evaluate_files", "validate_files"]


def __getattr__(name: str) -> Any:
    # Lists of batches need the names of files only: scoring is imported where somebody scores.
    if name in __all__:
        return getattr(import_module("benchbot.evaluation.score"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
