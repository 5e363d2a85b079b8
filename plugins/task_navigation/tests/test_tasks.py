"""The tasks, their results, and that all of them can be run in a room that has episodes."""

import subprocess
import sys

import pytest

from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import select

CAMERA = ["image_depth", "image_depth_info", "image_rgb", "image_rgb_info"]
SEGMENTATION = ["image_segment", "image_segment_info"]
ALWAYS = ["laser", "poses", "goal"]

# goal, suffix, observations besides the laser, poses and goal
TABLE = [
    ("point_goal", "", CAMERA),
    ("point_goal", ":laser", []),
    ("object_goal", "", CAMERA),
    ("object_goal", ":segmentation", CAMERA + SEGMENTATION),
]


@pytest.mark.parametrize(("goal", "suffix", "more"), TABLE)
@pytest.mark.parametrize("localisation", ["ground_truth", "dead_reckoning"])
def test_a_task_can_be_run_on_a_robot_in_the_miniroom(
    goal: str, suffix: str, more: list[str], localisation: str
) -> None:
    name = f"navigation:{goal}:{localisation}{suffix}"
    selection = select(
        Catalog(load()),
        RunRequest(task=name, robot="carter", environment="miniroom:1", method="navigation", episode=19),
    )

    assert selection.observations == (*more, *ALWAYS)
    assert selection.localisation == ("ground_truth" if localisation == "ground_truth" else "noisy")
    assert selection.actions == ("move_angle", "move_distance")
    assert selection.limits.steps == 500
    assert selection.episode is not None
    assert isinstance(selection.episode.goal, str) == (goal == "object_goal")


def test_there_are_no_other_tasks() -> None:
    pool = Catalog(load()).pool("tasks").values()

    assert sum(task.distribution == "benchbot-task-navigation" for task in pool) == 2 * len(TABLE)


def test_results_are_empty_and_claims_are_refused() -> None:
    declared = Catalog(load()).get("formats", "navigation")
    formats.validate(declared, formats.call(declared, "create", [], {}))

    with pytest.raises(BenchbotError, match="not a valid navigation"):
        formats.validate(declared, {"success": True})


def test_listing_what_there_is_loads_no_numerics() -> None:
    code = "import sys, benchbot_task_navigation.plugin; print({'numpy', 'scipy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout == "set()\n"
