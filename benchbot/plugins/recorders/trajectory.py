"""The recorder `trajectory`: observed and true poses of the robot, as files of the TUM RGB-D benchmark.

A pose a line, `time x y z qx qy qz qw`, seconds by the robot's clock, metres, in the map frame.
Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

import math
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.plugins.recorders.files import LineFile

if TYPE_CHECKING:
    from benchbot.core.progress import Progress, Step

OBSERVED, TRUE = "observed.tum", "true.tum"
HEAD = "# timestamp tx ty tz qx qy qz qw"
BASE = "base_link"


class TrajectoryRecording:
    """Writes `observed.tum` step by step, and `true.tum` when the recording ends.

    The true poses are kept back until then: a solution could read them while it drives.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._true: list[str] = []
        self._time_s = -math.inf
        self._closed = False
        self._observed = LineFile("trajectories", folder / OBSERVED, HEAD)

    def reset(self) -> None:
        """Start over."""
        self._true.clear()
        self._time_s = -math.inf
        self._observed.restart()

    def step(self, action: str | None, arguments: Mapping[str, float], step: "Step", progress: "Progress") -> None:
        """Add a pose to each, unless no time has passed: a robot is in one place at a time."""
        if progress.simulated_time_s <= self._time_s:
            return
        self._time_s = progress.simulated_time_s
        x, y, yaw_rad = progress.pose_xyyaw
        turned = (0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2))
        self._true.append(_line(self._time_s, (x, y, 0.0), turned))
        pose = step.observations.get("poses", {}).get(BASE)
        if pose is not None:
            self._observed.add(_line(self._time_s, pose["translation_xyz"], pose["rotation_xyzw"]))

    def close(self) -> None:
        """Write the true poses."""
        if self._closed:
            return
        self._closed = True
        self._observed.close()
        with closing(LineFile("trajectories", self._folder / TRUE, HEAD)) as true:
            for line in self._true:
                true.add(line)


def _line(time_s: float, translation_xyz: Iterable[float], rotation_xyzw: Iterable[float]) -> str:
    # All digits: the same number is read back.
    return " ".join(repr(float(value)) for value in (time_s, *translation_xyz, *rotation_xyzw))
