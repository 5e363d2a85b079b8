"""Evaluation of results: validity, scores, intervals, comparisons, and coverage."""

from benchbot.evaluation.score import evaluate, evaluate_files, validate_files

__all__ = ["evaluate", "evaluate_files", "validate_files"]
