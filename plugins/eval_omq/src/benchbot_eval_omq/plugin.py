"""The plug-in's hooks: one method of evaluation. Its numpy and scipy are imported when something is scored."""

from collections.abc import Iterator, Sequence
from typing import Any

from benchbot.plugin import Evaluator, Score, hookimpl

_SCORES = ("OMQ", "avg_pairwise", "avg_label", "avg_spatial", "avg_fp_quality", "avg_state_quality")


def _evaluate(result: dict[str, Any], ground_truths: Sequence[dict[str, Any]]) -> dict[str, float]:
    from benchbot_eval_omq import omq

    return omq.evaluate(result, ground_truths)


def _combine(scores: Sequence[dict[str, float]]) -> dict[str, float]:
    from benchbot_eval_omq import omq

    return omq.combine(scores)


def _explain(result: dict[str, Any], ground_truths: Sequence[dict[str, Any]]) -> dict[str, Any]:
    from benchbot_eval_omq import explanation

    return explanation.explain(result, ground_truths)


@hookimpl
def benchbot_evaluators() -> Iterator[Evaluator]:
    """Yield object map quality."""
    yield Evaluator(
        name="omq",
        version="1.0",
        headline="OMQ",
        result_formats=frozenset({"object_map", "object_map_with_states"}),
        ground_truth_formats=frozenset({"object_map_ground_truth"}),
        evaluate=_evaluate,
        combine=_combine,
        description="Object map quality: how well boxes, classes and states of a map agree with the truth.",
        explain=_explain,
        scores=dict.fromkeys(_SCORES, Score(lower_is_better=False, least=0.0, greatest=1.0)),
    )
