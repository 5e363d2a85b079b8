"""A robot that is only pretended: it moves exactly as told in an empty world, and senses made-up things."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES, OBSERVATIONS
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.geometry import Pose
from benchbot.core.host import Status
from benchbot.core.motion import Outcome
from benchbot.core.request import Limits
from benchbot.core.selection import Selection
from benchbot.plugins.authoring.conformance import samples
from benchbot.plugins.authoring.conformance.bench import Found

ACTION_S = 1.0
PASSIVE = {
    "name": "testing:passive",
    "description": "Follow a trajectory.",
    "actions": ["move_next"],
    "observations": sorted(set(OBSERVATIONS) - GIVEN_BY_EPISODES - {"imu", "lidar"}),
    "localisation": "ground_truth",
    "results_format": "object_map",
}


class PretendedHost:
    """A host of any scene; hits something in its `collides_at`-th action, if that is not None."""

    def __init__(self, starts: Sequence[Pose], collides_at: int | None = None) -> None:
        self._starts = starts
        self._collides_at = collides_at
        self._acted = 0
        self._clock_s = 0.0
        self._collided = False
        self._base = starts[0]
        self._random = np.random.default_rng(0)

    def load(self, scene_index: int, seed: int) -> Status:
        """Put the robot at the start of a scene."""
        self._base, self._clock_s, self._collided = self._starts[scene_index], 0.0, False
        self._random = np.random.default_rng([seed, scene_index])
        return self._status()

    def act(self, action: str, arguments: Mapping[str, Any], goal: Pose | None) -> tuple[Outcome, Status]:
        """Be where the action leads to."""
        self._acted += 1
        self._clock_s += ACTION_S
        if self._acted == self._collides_at:
            self._collided = True
            return Outcome.COLLIDED, self._status()
        if goal is not None:
            self._base = goal
        elif action == "move_distance":
            self._base = self._base @ Pose((float(arguments["distance"]), 0.0, 0.0))
        else:
            self._base = self._base @ Pose.planar(0.0, 0.0, math.radians(float(arguments["angle"])))
        return Outcome.REACHED, self._status()

    def observe(self, channels: Iterable[str]) -> dict[str, Any]:
        """Return made-up observations that conform."""
        return samples.observations(channels, self._base, self._random)

    def halt(self, why: str) -> None:
        """Nothing moves."""

    def close(self) -> None:
        """Nothing is held."""

    def _status(self) -> Status:
        return Status(self._base, self._clock_s, self._collided)


def selection(task: Found, results_format: Declaration | None, scenes: int, steps: int) -> Selection:
    """Return a run of a task on the pretended robot: `scenes` scenes, at most `steps` steps."""
    robot = {
        "name": "pretended",
        "type": "pretended",
        "global_frame": "map",
        "robot_frame": "base_link",
        "poses": list(samples.FRAMES),
        "connections": {
            **{name: {"connection": "ros_to_api"} for name in OBSERVATIONS if name not in GIVEN_BY_EPISODES},
            **{name: {"connection": "api_to_ros"} for name in ACTIONS},
        },
    }
    environments = [
        {
            "name": "nowhere",
            "variant": number,
            "type": "pretended",
            "start_pose": [1, 0, 0, 0, 0, 0, 0],
            "trajectory_poses": [[1, 0, 0, 0, 0.5 * place, 0, 0] for place in range(1, 4)],
            "object_labels": list(samples.LABELS),
        }
        for number in range(1, scenes + 1)
    ]
    nowhere = Path("nowhere.yaml")
    return Selection(
        Declaration("tasks", str(task.data["name"]), task.path or nowhere, task.distribution, dict(task.data)),
        Declaration("robots", "pretended", nowhere, "benchbot", robot),
        tuple(
            Declaration("environments", f"nowhere:{scene['variant']}", nowhere, "benchbot", scene)
            for scene in environments
        ),
        results_format,
        limits=Limits(steps=steps),
    )
