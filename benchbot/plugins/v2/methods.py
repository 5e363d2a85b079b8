"""v2's evaluation methods as evaluators.

v2's `evaluate(results, ground_truths)` returns a document `{task_details, environment_details, scores}`, and
`combine(documents)` makes one of many, `{}` standing for a missing result.
"""

from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.documents import GroundTruth, Result
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Document, Evaluator
from benchbot.core.resources import declaration_files
from benchbot.plugins.v2 import trust
from benchbot.plugins.v2.addons import Addon


@dataclass
class Method:
    """A declared evaluation method. Its code is imported when something is scored, if the user trusts it."""

    name: str
    functions: dict[str, str]
    path: Path
    addon: Addon
    headline: str = ""
    _scored: list[tuple[dict[str, float], Document]] = field(default_factory=list)

    def evaluate(self, result: Result, ground_truths: Sequence[GroundTruth]) -> dict[str, float]:
        """Return the scores of a result; raises BenchbotError for what the method cannot score."""
        # v2's methods may work inside of what they are given.
        document = self._function("evaluate")(deepcopy(result), deepcopy(list(ground_truths)))
        scores = self._scores(document, "evaluate")
        if self.headline and self.headline not in scores:
            raise self._useless("evaluate", f"Its headline '{self.headline}' is missing.")
        self._scored.append((scores, document))
        return scores

    def combine(self, scores: Sequence[dict[str, float]]) -> dict[str, float]:
        """Return the method's own summary, or else the mean of each score; a missing result counts as zero.

        Where nothing was scored there is a zero by the method's own name.
        """
        if "combine" in self.functions:
            documents = [self._document(one) for one in scores]
            return self._scores(self._function("combine")(documents), "combine")
        names = dict.fromkeys(name for one in scores for name in one) or [self.headline or self.name]
        return {name: sum(one.get(name, 0.0) for one in scores) / len(scores) for name in names}

    def _function(self, name: str) -> Callable[..., Any]:
        trust.require(self.addon)
        return self.addon.code.functions(self.path, {name: self.functions[name]})[name]

    def _document(self, scores: dict[str, float]) -> Document:
        """Return the document that `evaluate` returned with these scores: `combine` may use more of it."""
        if not scores:
            return {}
        for kept, document in self._scored:
            if kept == scores:
                return deepcopy(document)
        return {"task_details": {}, "environment_details": [], "scores": dict(scores)}

    def _scores(self, document: Any, function: str) -> dict[str, float]:
        found = document.get("scores", document) if isinstance(document, dict) else None
        if not isinstance(found, dict) or not found:
            raise self._useless(function, f"It returned {document!r:.200}.")
        scores = {}
        for name, value in found.items():
            try:
                scores[str(name)] = float(value)
            except (TypeError, ValueError) as error:
                raise self._useless(function, f"Its score '{name}' is {value!r:.100}, which is no number.") from error
        return scores

    def _useless(self, function: str, why: str) -> BenchbotError:
        return BenchbotError(
            f"The method '{self.name}' gave no scores.",
            f"{self.path}: {self.functions[function]}() must return a mapping with 'scores', names to numbers. {why}",
            "Mend the method, or report it to the add-on's author.",
        )


def evaluators(addon: Addon) -> Iterator[Evaluator | BenchbotError]:
    """Yield the evaluation methods of an add-on, and an error for each that cannot be read. Imports nothing."""
    for path in declaration_files(addon.sources("evaluation_methods")):
        try:
            data = schema.read(path)
            schema.check(data, "evaluation_method", path)
            method = Method(data["name"], data["functions"], path, addon, data.get("headline", ""))
            yield Evaluator(
                name=method.name,
                version=f"v2-{addon.code.digest[:12]}",
                headline=method.headline,
                result_formats=frozenset(data["valid_result_formats"]),
                ground_truth_formats=frozenset(data["valid_ground_truth_formats"]),
                evaluate=method.evaluate,
                combine=method.combine,
                description=data.get("description", ""),
            )
        except BenchbotError as error:
            yield error
