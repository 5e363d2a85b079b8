"""Scores computed again from results, whatever anybody has stated of them."""

from collections.abc import Mapping
from dataclasses import dataclass

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation.collect import has_valid_results
from benchbot.evaluation.coverage import Coverage
from benchbot.evaluation.ground_truths import GroundTruths, environment_of
from benchbot.evaluation.result_document import ResultDocument
from benchbot.evaluation.score import evaluate, method_for_task


@dataclass(frozen=True)
class Recomputed:
    """The scores of one result, and the name of its main one; without scores, `why_not` says why."""

    scores: Mapping[str, float] | None = None
    headline: str = ""
    why_not: str = ""


def recomputed(result: ResultDocument, catalog: Catalog, truths: GroundTruths, method: str | None = None) -> Recomputed:
    """Score one result by the named method, else by that of its task, where that is possible here."""
    coverage = Coverage()
    try:
        evaluator = method_for_task(catalog, method, result.document["task_details"])
        if not has_valid_results(result, catalog, coverage):
            return Recomputed(why_not=coverage.missing[0]["reason"])
        scenes = result.document["environment_details"] if evaluator.ground_truth_formats else []
        found = [truths.find(environment_of(scene), evaluator.ground_truth_formats) for scene in scenes]
        document = evaluate(result.document, found, evaluator.name)
    except BenchbotError as error:
        return Recomputed(why_not=f"{error.title} {error.why}")
    scores, headline = document["scores"], document["method"]["headline"]
    return Recomputed(scores, headline if headline in scores else next(iter(scores)))
