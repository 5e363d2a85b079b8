"""Wandering: straight drives to where the laser sees room and the robot has been least, and away from obstacles."""

import argparse
import json
from pathlib import Path

from benchbot.api import ActionResult, BenchBot
from benchbot.mapping import Roamer


def main() -> None:
    """Drive so many actions, or until the robot hits something."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=100, help="take so many actions at most")
    steps = parser.parse_args().steps
    benchbot = BenchBot()
    robot = benchbot.config["robot"]
    roamer = Roamer(robot["footprint"]["radius_m"], robot["robot_frame"])
    observations, result = benchbot.reset()
    for _ in range(steps):
        if result is not ActionResult.SUCCESS:
            break
        action, arguments = roamer.next_move(observations, benchbot.last_outcome)
        observations, result = benchbot.step(action, arguments)
    Path(benchbot.result_filename).write_text(json.dumps(benchbot.empty_results()), encoding="utf-8")


if __name__ == "__main__":
    main()
