"""Evaluation: is it valid, how good is it, and what is missing?"""

from benchbot.evaluation.score import evaluate, evaluate_files, validate_files

__all__ = ["evaluate", "evaluate_files", "validate_files"]
