"""A policy that drives to a point by depth and laser: what it is given, and how its ONNX file is run.

The network keeps a map of the obstacles that it was shown, around the start; the map goes out of one step and into the
next. The functions here take arrays of numpy, or tensors of torch, with any number of leading dimensions.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.api import Observations
from benchbot.mapping import rotation_matrix
from benchbot.plugin import BenchbotError, FailureClass

WEIGHTS = Path(__file__).parent / "weights" / "point_goal.onnx"
"""The policy that comes with this distribution; `point_goal.md` beside it says how it was trained."""
FORWARD_M, TURN_DEG = 0.25, 15.0
"""The actions in the order of the logits: ahead, a turn to the left, a turn to the right."""
BEAMS, COLUMNS, ROWS = 180, 64, 36
REACH_M = 5.0
LOWEST_M, HIGHEST_M = 0.06, 1.10
BLOCKED_M = 0.1
FELT_M = ((0.35, -0.1), (0.35, 0.0), (0.35, 0.1))
"""Where an obstacle is that no sensor has seen: before a robot that was stopped."""
POINTS = BEAMS + COLUMNS * ROWS + len(FELT_M)
CELLS = 384
"""The map is of so many cells of 0.1 m a side, with three marks: obstacle, floor that was seen free, the way so far."""


@dataclass(frozen=True)
class Rig:
    """From where the sensors see, in the robot's frame: arrays, or tensors where they are to be used.

    `beams` (BEAMS, 2) are directions, `rays` (ROWS, COLUMNS, 3) what a metre of depth is, `laser_m` (2,) and
    `camera_m` (3,) the places of the sensors.
    """

    beams: Any
    laser_m: Any
    rays: Any
    camera_m: Any

    def points(self, ranges_m: Any, depth_m: Any) -> tuple[Any, Any, Any, Any]:
        """Return the ends of beams (…, BEAMS, 2), which of them hit (…, BEAMS), and the same of pixels.

        `ranges_m` (…, BEAMS) and `depth_m` (…, ROWS, COLUMNS) are 0 where nothing was measured. Beams end within
        REACH_M; pixels hit what the robot cannot pass, not the floor, nor what it drives beneath.
        """
        near = (ranges_m > 0) & (ranges_m < REACH_M)
        ends = self.laser_m + ranges_m.clip(0, REACH_M)[..., None] * self.beams
        seen = self.camera_m + depth_m[..., None] * self.rays
        height_m = seen[..., 2]
        stops = (depth_m > 0) & (depth_m < REACH_M) & (height_m > LOWEST_M) & (height_m < HIGHEST_M)
        flat = depth_m.shape[:-2]
        return ends, near, seen[..., :2].reshape(*flat, -1, 2), stops.reshape(*flat, -1)


def sampled(count: int, of: int) -> NDArray[np.intp]:
    """Return so many numbers below `of`, evenly spaced."""
    chosen: NDArray[np.intp] = ((np.arange(count) + 0.5) * of / count).astype(np.intp)
    return chosen


def rig(angles_rad: NDArray[Any], camera_matrix: NDArray[Any], size: tuple[int, int], frames: dict[str, Any]) -> Rig:
    """Return where a robot sees from.

    `angles_rad` are those of all beams, `camera_matrix` (3, 3) is of pictures of `size` (height, width), and `frames`
    are poses in the map frame of `base`, `laser` and `camera`, as (rotation (3, 3), place (3,)).
    """
    (turned, at), laser, camera = frames["base"], frames["laser"], frames["camera"]
    height, width = size
    chosen = angles_rad[sampled(BEAMS, len(angles_rad))]
    directions = np.stack([np.cos(chosen), np.sin(chosen), np.zeros(BEAMS)], 1)
    matrix = np.asarray(camera_matrix, np.float64).reshape(3, 3)
    x = (sampled(COLUMNS, width) - matrix[0, 2]) / matrix[0, 0]
    y = (sampled(ROWS, height) - matrix[1, 2]) / matrix[1, 1]
    rays = np.stack([*np.meshgrid(x, y), np.ones((ROWS, COLUMNS))], -1)
    return Rig(
        (directions @ (turned.T @ laser[0]).T)[:, :2].astype(np.float32),
        (turned.T @ (laser[1] - at))[:2].astype(np.float32),
        (rays @ (turned.T @ camera[0]).T).astype(np.float32),
        (turned.T @ (camera[1] - at)).astype(np.float32),
    )


class Navigator:
    """The policy of one episode: `act` says what to do next. Raises BenchbotError for a file that is no such policy."""

    def __init__(self, weights: Path = WEIGHTS) -> None:
        import onnxruntime

        state = onnxruntime.capi.onnxruntime_pybind11_state
        try:
            self._session = onnxruntime.InferenceSession(str(weights), providers=["CPUExecutionProvider"])
        except (state.Fail, state.InvalidGraph, state.InvalidProtobuf, state.NoSuchFile) as error:
            raise BenchbotError(
                f"{weights} cannot be run.",
                f"onnxruntime says: {error}",
                "Name a policy that benchbot_baselines.policy_training has written: --args weights=FILE",
                failure=FailureClass.AGENT,
            ) from error
        given = [each.name for each in self._session.get_inputs()]
        if given != ["grid", "points", "hits", "pose", "goal", "last"]:
            raise BenchbotError(
                f"{weights} is no policy that drives to a point.",
                f"Its inputs are {', '.join(given)}.",
                "Name one that benchbot_baselines.policy_training has written.",
                failure=FailureClass.AGENT,
            )
        self._grid = np.zeros((1, 3, CELLS * CELLS), np.float32)
        self._rig: Rig | None = None
        self._last = np.zeros((1, 4), np.float32)
        self._before: NDArray[np.float64] | None = None
        self.left_m = math.inf
        """The straight distance to the goal when `act` was called last."""
        self.here_xy = (0.0, 0.0)
        """Where the robot was then, from its start."""

    def act(self, observations: Observations) -> NDArray[np.float32]:
        """Return the logits (3,) of the actions."""
        poses = observations["poses"]
        base = placed(poses["base_link"])
        depth_m = np.asarray(observations["image_depth"])
        scans = observations["laser"]["scans"]
        if self._rig is None:
            frames = {"base": base, "laser": placed(poses["lidar"]), "camera": placed(poses["camera"])}
            matrix = observations["image_depth_info"]["matrix_intrinsics"]
            self._rig = rig(scans[:, 1], matrix, depth_m.shape, frames)
            self._start = placed(poses["initial_pose"])
        chosen = np.nan_to_num(scans[sampled(BEAMS, len(scans)), 0], nan=0.0, posinf=2 * REACH_M, neginf=0.0)
        rows, columns = (sampled(count, of) for count, of in zip((ROWS, COLUMNS), depth_m.shape, strict=True))
        seen = np.nan_to_num(depth_m[np.ix_(rows, columns)], nan=0.0, posinf=2 * REACH_M, neginf=0.0)
        turned, at = self._start
        x, y, _ = turned.T @ (base[1] - at)
        ahead = turned.T @ base[0][:, 0]
        here = np.array([x, y, math.atan2(ahead[1], ahead[0])])
        self._notice(here)
        goal = np.asarray(observations["goal"], np.float64)
        self.left_m = math.dist(here[:2], goal)
        self.here_xy = (float(x), float(y))
        ends, near, low, stops = self._rig.points(chosen.astype(np.float32), seen.astype(np.float32))
        felt = np.full(len(FELT_M), self._last[0, 3] > 0)
        grid, logits = self._session.run(
            ["grid_next", "logits"],
            {
                "grid": self._grid,
                "points": np.concatenate([ends, low, np.array(FELT_M, np.float32)])[None].astype(np.float32),
                "hits": np.concatenate([near, stops, felt])[None],
                "pose": here[None].astype(np.float32),
                "goal": goal[None].astype(np.float32),
                "last": self._last,
            },
        )
        self._grid = grid
        found: NDArray[np.float32] = logits[0]
        return found

    def chose(self, action: int) -> None:
        """Remember what was done."""
        self._last[:] = 0
        self._last[0, action] = 1

    def _notice(self, here: NDArray[np.float64]) -> None:
        moved_m = math.inf if self._before is None else math.dist(here[:2], self._before[:2])
        self._last[0, 3] = float(self._last[0, 0] > 0 and moved_m < BLOCKED_M)
        self._before = here


def placed(pose: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rotation (3, 3) and the place (3,) of one of an observation's poses."""
    return rotation_matrix(pose["rotation_xyzw"]), np.asarray(pose["translation_xyz"], np.float64)
