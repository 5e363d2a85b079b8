"""Wandering without memory: ahead while there is room, then in the direction in which the laser sees most of it."""

import argparse
import json
from pathlib import Path

import numpy as np

from benchbot.api import ActionResult, BenchBot, Observations

ROOM_AHEAD_M = 1.0
DRIVE_M = 0.3


def pick(observations: Observations) -> tuple[str, dict[str, float]]:
    """Return the next action and its argument."""
    ranges_m, angles_rad = observations["laser"]["scans"].T
    ahead_m = np.min(ranges_m[np.abs(angles_rad) < np.pi / 6], initial=np.inf)
    if ahead_m > ROOM_AHEAD_M:
        return "move_distance", {"distance": DRIVE_M}
    aside = np.abs(angles_rad) > np.pi / 4
    if not aside.any():
        return "move_angle", {"angle": 90.0}
    best_rad = angles_rad[aside][np.argmax(ranges_m[aside])]
    return "move_angle", {"angle": round(float(np.degrees(best_rad)), 1)}


def main() -> None:
    """Drive so many actions, or until the robot hits something."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=100, help="take so many actions at most")
    steps = parser.parse_args().steps
    benchbot = BenchBot()
    observations, result = benchbot.reset()
    for _ in range(steps):
        if result is not ActionResult.SUCCESS:
            break
        action, arguments = pick(observations)
        observations, result = benchbot.step(action, arguments)
    Path(benchbot.result_filename).write_text(json.dumps(benchbot.empty_results()), encoding="utf-8")


if __name__ == "__main__":
    main()
