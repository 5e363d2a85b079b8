"""The plug-in's hooks. Its numpy is imported when something is scored."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Evaluator, Score, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""

_FOLDER = Path(__file__).parent


@hookimpl
def benchbot_tasks() -> Iterator[Path]:
    """Yield `tidy_up`."""
    yield _FOLDER / "tasks"


@hookimpl
def benchbot_formats() -> Iterator[Path]:
    """Yield the format of results."""
    yield _FOLDER / "formats"


@hookimpl
def benchbot_environments() -> Iterator[Path]:
    """Yield a room with tables."""
    yield _FOLDER / "environments"


@hookimpl
def benchbot_episodes() -> Iterator[Path]:
    """Yield where objects begin, and where they are to be put."""
    yield _FOLDER / "episodes"


@hookimpl
def benchbot_examples() -> Iterator[Path]:
    """Yield a solution by rules."""
    yield _FOLDER / "examples"


@hookimpl
def benchbot_evaluators() -> Iterator[Evaluator]:
    """Yield success and what it took."""
    ends = ("success", "placed", "picked")
    costs = ("time_s", "path_length_m", "end_effector_path_m", "energy_j", "distance_m")
    counts = ("collisions", "drops", "disturbed")
    yield Evaluator(
        name="tidy_up",
        version="1.0",
        headline="success",
        result_formats=frozenset({"tidy_up"}),
        ground_truth_formats=frozenset(),
        evaluate=target("benchbot_task_manipulation.evaluator:evaluate"),
        combine=target("benchbot_task_manipulation.evaluator:combine"),
        description="Tidying up: whether the object stands where it belongs, what was dropped or hit, what it took.",
        scores={
            **dict.fromkeys(ends, Score(lower_is_better=False, least=0.0, greatest=1.0)),
            **dict.fromkeys((*costs, *counts), Score(lower_is_better=True, least=0.0)),
        },
    )
