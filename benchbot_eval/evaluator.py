"""The import name of BenchBot v2: scoring of validated results, an alias of `benchbot.evaluation.evaluate_files`."""

from os import PathLike
from pathlib import Path
from typing import Any

from benchbot_eval.validator import Validator, latest

__all__ = ["Evaluator", "Validator"]


class Evaluator:
    """Scores what the last Validator has found valid, by a method's name (None: by the one that fits the task).

    With `skip_load`, `load_validator` is to be called before `evaluate`. `print_all` prints the scores of each result
    besides the summary. Raises BenchbotError when nothing was validated.
    """

    def __init__(
        self,
        evaluation_method: str | None,
        scores_filename: str | PathLike[str],
        skip_load: bool = False,
        print_all: bool = True,
    ) -> None:
        self.evaluation_method = evaluation_method
        self.scores_filename = scores_filename
        self.print_all = print_all
        self.validator: Validator | None = None
        if not skip_load:
            self.load_validator()

    def load_validator(self) -> None:
        """Take what was validated last."""
        self.validator = latest()

    def evaluate(self) -> dict[str, Any]:
        """Write the scores document, print it, and return it; a required environment without a result counts as zero.

        Raises BenchbotError when nothing can be scored.
        """
        from benchbot.cli.kit import console, scoring
        from benchbot.core.declarations.catalog import Catalog
        from benchbot.core.plugin_manager import load
        from benchbot.core.results import write_scores
        from benchbot.evaluation import evaluate_files

        validated = self.validator or latest()
        document = evaluate_files(
            validated.paths,
            catalog=Catalog(load()),
            method=self.evaluation_method,
            required_task=validated.required_task,
            required_envs=validated.required_envs,
        )
        write_scores(Path(self.scores_filename), document)
        console.data(*(scoring.table(document) if self.print_all else [scoring.headline(document)]))
        return document
