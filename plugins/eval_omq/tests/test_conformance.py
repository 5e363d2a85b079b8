"""The plug-in keeps the promises that `benchbot.testing` checks."""

from benchbot.testing import Example, check_evaluator, check_plugin, conform
from plugins.eval_omq.tests.omq_maps import change_map, found, semantic_map, thing, truth

TRUTH = [truth(thing("chair"), thing("table", 3.0))]


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-eval-omq"))


def test_object_map_quality_conforms() -> None:
    findings = check_evaluator(
        "omq",
        perfect=Example(semantic_map(found("chair"), found("table", 3.0)), TRUTH),
        empty=Example(semantic_map(), TRUTH),
        others=[
            Example(semantic_map(found("chair", 0.5), found("tv", 3.0), found("table", 9.0)), TRUTH),
            Example(semantic_map(found("chair", 0.2, sure=0.4)), TRUTH),
        ],
        unordered=["objects"],
    )
    conform(findings)


def test_object_map_quality_of_changes_conforms() -> None:
    truths = [truth(thing("chair")), truth(thing("chair"), thing("table", 3.0))]
    added = found("table", 3.0) | {"state_probs": [1.0, 0.0, 0.0]}
    findings = check_evaluator(
        "omq",
        perfect=Example(change_map(added), truths),
        empty=Example(change_map(), truths),
        others=[Example(change_map(added, found("tv", 5.0) | {"state_probs": [0.0, 1.0, 0.0]}), truths)],
        unordered=["objects"],
    )
    conform(findings)
