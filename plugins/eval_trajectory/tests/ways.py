"""Trajectories to test with: true ones, and estimates that drift, shake and are seen from elsewhere."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from benchbot_eval_trajectory.alignment import Similarity
from benchbot_eval_trajectory.trajectory import Floats, Trajectory


def wander(count: int = 200, seed: int = 0, step_m: float = 0.05, start_s: float = 1305031102.0) -> Trajectory:
    """Return a smooth way through space, 30 poses a second."""
    random = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(np.cumsum(random.normal(0, 0.03, (count, 3)), axis=0))
    steps_m = turns.apply([step_m, 0.0, 0.0])
    return Trajectory(np.cumsum(steps_m, axis=0), turns.as_matrix(), start_s + np.arange(count) / 30)


def estimate_of(truth: Trajectory, seed: int = 1, noise_m: float = 0.01, scale: float = 1.0) -> Trajectory:
    """Return the truth with noise and drift, in another frame."""
    random = np.random.default_rng(seed)
    drift_m = np.cumsum(random.normal(0, noise_m / 10, truth.positions_m.shape), axis=0)
    shaken_m = scale * (truth.positions_m + drift_m + random.normal(0, noise_m, truth.positions_m.shape))
    turned = Rotation.from_rotvec(random.normal(0, 0.02, (len(truth), 3))).as_matrix()
    return moved(Trajectory(shaken_m, truth.rotations @ turned, truth.times_s), (0.3, -1.0, 2.0), (5.0, -3.0, 1.0))


def moved(trajectory: Trajectory, turn: Sequence[float], shift_m: Sequence[float], scale: float = 1.0) -> Trajectory:
    """Return the trajectory seen from elsewhere: turned by a rotation vector, shifted, scaled."""
    rotation: Floats = Rotation.from_rotvec(turn).as_matrix()
    return Similarity(rotation, np.array(shift_m), scale).of(trajectory)


TURNS = st.tuples(*[st.floats(-3, 3)] * 3)
SHIFTS = st.tuples(*[st.floats(-20, 20)] * 3)
SCALES = st.floats(0.1, 10)


def result(
    poses: Sequence[tuple[int, Sequence[float], float]] | None = None,
    rows: Sequence[tuple[int | None, float, float, float, float]] = (
        (0, 0.0, 0.0, 0.0, 0.0),
        (None, 1.0, 0.5, 0.0, 0.0),
        (1, 2.0, 1.0, 0.0, 0.0),
        (2, 4.0, 1.0, 1.0, np.pi / 2),
    ),
    path_length_m: float = 2.0,
) -> Any:
    """Return a result with a track, the robot's base 5 cm above the floor; an estimate's poses are (number, xyz, yaw).

    Without poses, the estimate is right.
    """
    if poses is None:
        poses = [(number, (x, y, 0.05), yaw) for number, _, x, y, yaw in rows if number is not None]
    return {
        "task_details": {"name": "trajectory:passive:dead_reckoning", "results_format": "trajectory"},
        "environment_details": [{"name": "room", "variant": 1, "start_pose": [1, 0, 0, 0, 0, 0, 0.05]}],
        "results": {
            "poses": [
                {
                    "observation": number,
                    "translation_xyz": list(position),
                    "rotation_xyzw": [0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2))],
                }
                for number, position, yaw in poses
            ]
        },
        "track": [
            {
                "scene": "room:1",
                "source": "simulation",
                "path_length_m": path_length_m,
                "collisions": 0,
                "columns": ["observation", "time_s", "x_m", "y_m", "yaw_rad"],
                "rows": [list(row) for row in rows],
            }
        ],
    }
