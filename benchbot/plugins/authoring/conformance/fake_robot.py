"""A fake robot: it moves exactly as told in an empty world, and observes made-up things that conform."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES, MANIPULATION, OBSERVATIONS, CameraModel, Observations
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.geometry import Pose
from benchbot.core.host import Status
from benchbot.core.motion import Outcome
from benchbot.core.request import Limits
from benchbot.core.selection import Selection

ACTION_S = 1.0
HEIGHT, WIDTH, FOCAL_PX = 48, 64, 32.0
LABELS = ("bottle", "chair")
BEAMS = 36
CAMERA_IN_BASE = Pose((0.1, 0.0, 0.5), (-0.5, 0.5, -0.5, 0.5))

TASK: dict[str, Any] = {
    "name": "testing:passive",
    "description": "Follow a trajectory.",
    "actions": ["move_next"],
    "observations": sorted(set(OBSERVATIONS) - GIVEN_BY_EPISODES - {"imu", "lidar", "joint_states"}),
    "localisation": "ground_truth",
    "results_format": "object_map",
}
ROBOT: dict[str, Any] = {
    "name": "fake",
    "type": "fake",
    "global_frame": "map",
    "robot_frame": "base_link",
    "poses": ["base_link", "initial_pose", "camera", "lidar"],
    "connections": {
        **{name: {"connection": "ros_to_api"} for name in OBSERVATIONS if name not in GIVEN_BY_EPISODES},
        **{name: {"connection": "api_to_ros"} for name in ACTIONS if name not in MANIPULATION},
    },
}
ENVIRONMENT: dict[str, Any] = {
    "name": "nowhere",
    "type": "fake",
    "start_pose": [1, 0, 0, 0, 0, 0, 0],
    "trajectory_poses": [[1, 0, 0, 0, x_m, 0, 0] for x_m in (0.5, 1.0, 1.5)],
    "object_labels": list(LABELS),
}


def fake_selection(task: Declaration, results_format: Declaration | None, scenes: int, steps: int) -> Selection:
    """Return a run of a task on the fake robot: `scenes` scenes, at most `steps` steps."""
    nowhere = Path("nowhere.yaml")
    return Selection(
        task,
        Declaration("robots", "fake", nowhere, "benchbot", ROBOT),
        tuple(
            Declaration("environments", f"nowhere:{number}", nowhere, "benchbot", {**ENVIRONMENT, "variant": number})
            for number in range(1, scenes + 1)
        ),
        results_format,
        limits=Limits(steps=steps),
    )


class FakeHost:
    """A host of scenes that start at the origin; in its `collides_at`-th action, if any, the robot hits something."""

    def __init__(self, collides_at: int | None = None) -> None:
        self._collides_at = collides_at
        self._action_count = 0
        self._clock_s = 0.0
        self._collided = False
        self._base = Pose()
        self._random = np.random.default_rng(0)

    def prepare(self) -> None:
        """Do nothing: there is nothing to diagnose."""

    def load(self, scene_index: int, seed: int) -> Status:
        """Put the robot at the start of a scene."""
        self._base, self._clock_s, self._collided = Pose(), 0.0, False
        self._random = np.random.default_rng([seed, scene_index])
        return self._status()

    def act(self, action: str, arguments: Mapping[str, float], goal: Pose | None) -> tuple[Outcome, Status]:
        """Put the robot where the action leads to."""
        self._action_count += 1
        self._clock_s += ACTION_S
        if self._action_count == self._collides_at:
            self._collided = True
            return Outcome.COLLIDED, self._status()
        if goal is not None:
            self._base = goal
        elif action == "move_distance":
            self._base = self._base @ Pose((float(arguments["distance"]), 0.0, 0.0))
        elif action == "move_sideways":
            self._base = self._base @ Pose((0.0, float(arguments["distance"]), 0.0))
        else:
            self._base = self._base @ Pose.planar(0.0, 0.0, math.radians(float(arguments["angle"])))
        return Outcome.REACHED, self._status()

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return made-up observations that conform."""
        return fake_observations(channels, self._base, self._random)

    def halt(self, why: str) -> None:
        """Do nothing: nothing moves."""

    def close(self) -> None:
        """Do nothing: nothing is held."""

    def _status(self) -> Status:
        return Status(self._base, self._clock_s, self._collided)


def fake_observations(channels: Iterable[str], base: Pose, random: np.random.Generator) -> Observations:
    """Return a new value of each channel, as a robot at `base` in the map frame might observe it."""
    depth_m = random.uniform(0.5, 8.0, (HEIGHT, WIDTH)).astype(np.float32)
    depth_m[0] = np.inf
    depth_m[:, 0] = np.nan
    classes = random.integers(0, len(LABELS) + 1, (HEIGHT, WIDTH)).astype(np.uint8)
    azimuths_rad = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
    ranges_m = random.uniform(1.0, 8.0, BEAMS)
    ranges_m[0] = np.inf
    poses = {"base_link": base, "initial_pose": Pose(), "camera": base @ CAMERA_IN_BASE, "lidar": base}
    values: Observations = {
        "image_rgb": random.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8),
        "image_rgb_info": _camera_model(),
        "image_depth": depth_m,
        "image_depth_info": _camera_model(),
        "image_segment": {
            "class_segment_img": classes,
            "instance_segment_img": classes.astype(np.uint16) * 1000 + (classes > 0),
            "class_ids": {name: number for number, name in enumerate(LABELS, 1)},
        },
        "image_segment_info": _camera_model(),
        "laser": {"scans": np.stack([ranges_m, azimuths_rad], 1), "range_min": 0.1, "range_max": 10.0},
        "lidar": {
            "frame_id": "lidar",
            "ranges_m": np.tile(ranges_m.astype(np.float32), (4, 1)),
            "elevations_rad": np.linspace(-0.2, 0.2, 4),
            "azimuths_rad": azimuths_rad,
        },
        "imu": {
            "orientation_xyzw": np.array(base.rotation_xyzw),
            "angular_velocity_radps": np.zeros(3),
            "linear_acceleration_mps2": np.array([0.0, 0.0, 9.81]),
        },
        "joint_states": {
            "names": ["shoulder", "gripper"],
            "positions": np.array([0.5, 0.04]),
            "velocities": np.zeros(2),
            "efforts": np.array([3.0, 0.0]),
        },
        "poses": {name: pose.record("map") for name, pose in poses.items()},
        "goal": np.array([1.0, 0.5]),
    }
    by_name: Mapping[str, object] = values
    return cast(Observations, {name: by_name[name] for name in channels})


def _camera_model() -> CameraModel:
    intrinsics = np.array([[FOCAL_PX, 0.0, WIDTH / 2], [0.0, FOCAL_PX, HEIGHT / 2], [0.0, 0.0, 1.0]])
    return {
        "frame_id": "camera",
        "height": HEIGHT,
        "width": WIDTH,
        "matrix_intrinsics": intrinsics,
        "matrix_projection": np.hstack([intrinsics, np.zeros((3, 1))]),
    }
