"""The plug-in's hooks. Its numpy and scipy are imported when something is scored."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Command, Evaluator, Score, hookimpl, target

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""

_FOLDER = Path(__file__).parent
_POSITION_ERRORS = ("ATE_RMSE_m", "ATE_mean_m", "ATE_median_m", "ATE_max_m", "ATE_sim3_RMSE_m", "ATE_map_RMSE_m")
_RELATIVE_ERRORS = ("RPE_1m_m", "RPE_1m_deg", "RPE_frame_m", "RPE_frame_deg")


@hookimpl
def benchbot_tasks() -> Iterator[Path]:
    """Yield the tasks whose result is the robot's trajectory."""
    yield _FOLDER / "tasks"


@hookimpl
def benchbot_formats() -> Iterator[Path]:
    """Yield the format of trajectories."""
    yield _FOLDER / "formats"


@hookimpl
def benchbot_examples() -> Iterator[Path]:
    """Yield the baseline solution."""
    yield _FOLDER / "examples"


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command for files of the TUM and KITTI benchmarks."""
    yield Command("trajectory", "benchbot_eval_trajectory.command:app", "Trajectory errors of TUM and KITTI files.")


@hookimpl
def benchbot_evaluators() -> Iterator[Evaluator]:
    """Yield absolute and relative trajectory error."""
    yield Evaluator(
        name="trajectory",
        version="1.0",
        headline="ATE_RMSE_m",
        result_formats=frozenset({"trajectory"}),
        ground_truth_formats=frozenset(),
        evaluate=target("benchbot_eval_trajectory.evaluator:evaluate"),
        explain=target("benchbot_eval_trajectory.evaluator:explain"),
        combine=target("benchbot_eval_trajectory.evaluator:combine"),
        description="Trajectory error, less is better: how far estimated poses are from the robot's track (ATE, RPE).",
        scores={
            **dict.fromkeys((*_POSITION_ERRORS, *_RELATIVE_ERRORS), Score(lower_is_better=True, least=0.0)),
            "path_length_m": Score(least=0.0),
            "completeness": Score(lower_is_better=False, least=0.0, greatest=1.0),
        },
    )
