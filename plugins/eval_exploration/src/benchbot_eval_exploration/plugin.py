"""The plug-in's hooks. Its numpy is imported when something is scored."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Evaluator, Score, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""

_FOLDER = Path(__file__).parent
_SHARES = ("coverage", "coverage_over_10m", "visited")


@hookimpl
def benchbot_tasks() -> Iterator[Path]:
    """Yield exploration."""
    yield _FOLDER / "tasks"


@hookimpl
def benchbot_formats() -> Iterator[Path]:
    """Yield the format of its results."""
    yield _FOLDER / "formats"


@hookimpl
def benchbot_examples() -> Iterator[Path]:
    """Yield a solution that wanders."""
    yield _FOLDER / "examples"


@hookimpl
def benchbot_evaluators() -> Iterator[Evaluator]:
    """Yield coverage."""
    yield Evaluator(
        name="exploration",
        version="1.1",
        headline="coverage",
        result_formats=frozenset({"exploration"}),
        ground_truth_formats=frozenset({"floor_plan"}),
        evaluate=target("benchbot_eval_exploration.evaluator:evaluate"),
        combine=target("benchbot_eval_exploration.evaluator:combine"),
        description="Exploration: the share of the floor that the robot has seen and been to.",
        scores={
            **dict.fromkeys(_SHARES, Score(lower_is_better=False, least=0.0, greatest=1.0)),
            "seen_m2": Score(lower_is_better=False, least=0.0),
            "path_length_m": Score(least=0.0),
            "collisions": Score(lower_is_better=True, least=0.0),
        },
    )
