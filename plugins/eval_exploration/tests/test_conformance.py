"""The plug-in keeps the promises that `benchbot.testing` checks."""

from typing import Any

from benchbot.plugin import GroundTruth
from benchbot.testing import Example, check_evaluator, check_plugin, conform
from plugins.task_navigation.tests.floors import arena_truth


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-eval-exploration"))


def test_the_method_conforms() -> None:
    truth = arena_truth()
    everywhere = [[number, 0.0, x / 2, y / 2, yaw] for number, (x, y, yaw) in enumerate(_looks())]
    findings = check_evaluator(
        "exploration",
        perfect=_example(truth, everywhere),
        empty=_example(truth, []),
        others=[_example(truth, everywhere[:1]), _example(truth, everywhere[::7])],
    )
    conform(findings)


def _looks() -> list[tuple[int, int, float]]:
    """Return looks in all directions, a metre and a half apart."""
    return [(x, y, yaw) for x in range(-12, 13, 3) for y in range(-12, 13, 3) for yaw in (0.0, 1.57, 3.14, -1.57)]


def _example(truth: GroundTruth, rows: list[Any]) -> Example:
    return Example({"track": [{"rows": rows, "path_length_m": 0.5, "collisions": 0}]}, [truth])
