"""The plug-in keeps the promises that `benchbot.testing` checks."""

from benchbot.testing import Example, check_evaluator, check_plugin, conform
from plugins.eval_trajectory.tests.ways import result


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-eval-trajectory"))


def test_the_method_conforms() -> None:
    nothing = result()
    nothing["results"]["poses"] = []
    findings = check_evaluator(
        "trajectory",
        perfect=Example(result()),
        empty=Example(nothing),
        others=[Example(result([(0, (0.0, 0.0, 0.1), 0.0), (1, (1.2, 0.0, 0.1), 0.0), (2, (1.0, 1.3, 0.1), 1.5)]))],
    )
    conform(findings)
