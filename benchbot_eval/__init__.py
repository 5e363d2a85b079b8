"""The import name of BenchBot v2's evaluation: thin aliases of `benchbot.evaluation`."""

from benchbot_eval.evaluator import Evaluator
from benchbot_eval.ground_truth_creator import GroundTruthCreator
from benchbot_eval.validator import Validator

__all__ = ["Evaluator", "GroundTruthCreator", "Validator"]
