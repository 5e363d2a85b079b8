"""Dead reckoning: the trajectory is the odometry, without correction. A SLAM solution should score better.

Follows the trajectory of a passive task. In an active one it drives to where the laser sees room and it has been least.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, BenchBot, Observations
from benchbot.mapping import Roamer


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
    robot = benchbot.config["robot"]
    robot_frame = robot["robot_frame"]
    roamer = Roamer(robot["footprint"]["radius_m"], robot_frame)
    observations, result = benchbot.reset()
    poses = [estimate(0, observations, robot_frame)]
    while result is ActionResult.SUCCESS and len(poses) <= steps:
        passive = "move_next" in benchbot.actions
        action, arguments = ("move_next", {}) if passive else roamer.next_move(observations, benchbot.last_outcome)
        observations, result = benchbot.step(action, arguments)
        poses.append(estimate(len(poses), observations, robot_frame))
    document = benchbot.empty_results()
    document["results"]["poses"] = poses
    Path(benchbot.result_filename).write_text(json.dumps(document), encoding="utf-8")


if __name__ == "__main__":
    main()
