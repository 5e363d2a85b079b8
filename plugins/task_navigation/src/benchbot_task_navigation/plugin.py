"""The plug-in's hooks. Its numpy and scipy are imported when something is scored."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Evaluator, Score, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""

_FOLDER = Path(__file__).parent


@hookimpl
def benchbot_tasks() -> Iterator[Path]:
    """Yield navigation to a point and to an object of a class."""
    yield _FOLDER / "tasks"


@hookimpl
def benchbot_formats() -> Iterator[Path]:
    """Yield the formats of results and of floor plans."""
    yield _FOLDER / "formats"


@hookimpl
def benchbot_episodes() -> Iterator[Path]:
    """Yield starts and goals."""
    yield _FOLDER / "episodes" / "point_goal"
    yield _FOLDER / "episodes" / "object_goal"


@hookimpl
def benchbot_ground_truths() -> Iterator[Path]:
    """Yield floor plans."""
    yield _FOLDER / "ground_truths"


@hookimpl
def benchbot_examples() -> Iterator[Path]:
    """Yield a solution that drives to a point."""
    yield _FOLDER / "examples"


@hookimpl
def benchbot_evaluators() -> Iterator[Evaluator]:
    """Yield success, SPL and related scores."""
    yield Evaluator(
        name="navigation",
        version="1.1",
        headline="SPL",
        result_formats=frozenset({"navigation"}),
        ground_truth_formats=frozenset({"floor_plan"}),
        evaluate=target("benchbot_task_navigation.evaluator:evaluate"),
        combine=target("benchbot_task_navigation.evaluator:combine"),
        description="Navigation: whether the robot stopped at its goal, and how short its way there was (SPL).",
        explain=target("benchbot_task_navigation.ending:explain"),
        scores={
            **dict.fromkeys(("SPL", "success", "SoftSPL"), Score(lower_is_better=False, least=0.0, greatest=1.0)),
            **dict.fromkeys(("distance_to_goal_m", "collisions"), Score(lower_is_better=True, least=0.0)),
            "path_length_m": Score(least=0.0),
        },
    )
