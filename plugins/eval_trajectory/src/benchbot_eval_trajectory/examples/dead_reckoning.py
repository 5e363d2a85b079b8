"""Dead reckoning: the trajectory is the odometry, without correction. A SLAM solution should score better.

Follows the trajectory of a passive task. In an active one it drives ahead while the laser sees room, else it turns.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.api import ActionResult, BenchBot, Observations

ROOM_AHEAD_M = 1.0
DRIVE_M = 0.3
TURN_DEG = 45.0


def pick(observations: Observations, actions: Sequence[str]) -> tuple[str, dict[str, float]]:
    """Return the next action and its argument."""
    if "move_next" in actions:
        return "move_next", {}
    ranges_m, angles_rad = observations["laser"]["scans"].T
    ahead_m = np.min(ranges_m[np.abs(angles_rad) < np.pi / 4], initial=np.inf)
    if ahead_m > ROOM_AHEAD_M:
        return "move_distance", {"distance": DRIVE_M}
    return "move_angle", {"angle": TURN_DEG}


def estimate(number: int, observations: Observations, robot_frame: str) -> dict[str, Any]:
    """Return the estimated pose of the robot's base at the `number`-th observation."""
    base = observations["poses"][robot_frame]
    return {
        "observation": number,
        "translation_xyz": [float(value) for value in base["translation_xyz"]],
        "rotation_xyzw": [float(value) for value in base["rotation_xyzw"]],
    }


def main() -> None:
    """Drive, and note the pose of every observation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=40, help="take so many actions at most")
    steps = parser.parse_args().steps
    benchbot = BenchBot()
    robot_frame = benchbot.config["robot"]["robot_frame"]
    observations, result = benchbot.reset()
    poses = [estimate(0, observations, robot_frame)]
    while result is ActionResult.SUCCESS and len(poses) <= steps:
        action, arguments = pick(observations, benchbot.actions)
        observations, result = benchbot.step(action, arguments)
        poses.append(estimate(len(poses), observations, robot_frame))
    document = benchbot.empty_results()
    document["results"]["poses"] = poses
    Path(benchbot.result_filename).write_text(json.dumps(document), encoding="utf-8")


if __name__ == "__main__":
    main()
