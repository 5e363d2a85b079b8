"""The tasks: that all can be run in a room with a trajectory, by drifting odometry."""

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load
from benchbot.core.request import RunRequest
from benchbot.core.selection import select

CAMERA = ("image_depth", "image_depth_info", "image_rgb", "image_rgb_info")
TABLE = [("passive", ("move_next",)), ("active", ("move_angle", "move_distance"))]


@pytest.mark.parametrize(("suffix", "more"), [("", CAMERA), (":laser", ())])
@pytest.mark.parametrize(("kind", "actions"), TABLE)
def test_a_task_can_be_run_on_a_robot_in_the_miniroom(
    kind: str, actions: tuple[str, ...], suffix: str, more: tuple[str, ...]
) -> None:
    name = f"trajectory:{kind}:dead_reckoning{suffix}"
    selection = select(
        Catalog(load()), RunRequest(task=name, robot="carter", environment="miniroom:1", method="trajectory")
    )

    assert selection.actions == actions
    assert selection.observations == (*more, "laser", "poses")
    assert selection.localisation == "noisy"
    assert selection.results_format is not None
    assert selection.results_format.name == "trajectory"


def test_there_are_no_other_tasks() -> None:
    pool = Catalog(load()).pool("tasks").values()

    assert sum(task.distribution == "benchbot-eval-trajectory" for task in pool) == 4
