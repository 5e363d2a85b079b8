"""The plug-in's hooks: one method of evaluation. Its numpy and scipy are imported when something is scored."""

from collections.abc import Iterator

from benchbot.plugin import Evaluator, Score, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""

_SCORES = ("OMQ", "avg_pairwise", "avg_label", "avg_spatial", "avg_fp_quality", "avg_state_quality")


@hookimpl
def benchbot_evaluators() -> Iterator[Evaluator]:
    """Yield object map quality."""
    yield Evaluator(
        name="omq",
        version="1.0",
        headline="OMQ",
        result_formats=frozenset({"object_map", "object_map_with_states"}),
        ground_truth_formats=frozenset({"object_map_ground_truth"}),
        evaluate=target("benchbot_eval_omq.omq:evaluate"),
        combine=target("benchbot_eval_omq.omq:combine"),
        description="Object map quality: how well boxes, classes and states of a map agree with the truth.",
        explain=target("benchbot_eval_omq.explanation:explain"),
        scores=dict.fromkeys(_SCORES, Score(lower_is_better=False, least=0.0, greatest=1.0)),
    )
