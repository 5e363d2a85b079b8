"""A loop of its own, in the manner of Gymnasium: reset, then step until done, then save a result."""

import json
from pathlib import Path

import numpy as np

from benchbot.api import ActionResult, BenchBot, Observations

STEPS = 10
ROOM_AHEAD_M = 0.8


def policy(observations: Observations, actions: list[str]) -> tuple[str, dict[str, float]]:
    """Follow the trajectory if there is one; else drive where the laser sees room ahead, and turn where it does not."""
    if "move_next" in actions:
        return "move_next", {}
    ranges_m, angles_rad = observations["laser"]["scans"].T
    ahead_m = np.min(ranges_m[np.abs(angles_rad) < np.pi / 4], initial=np.inf)
    return ("move_distance", {"distance": 0.3}) if ahead_m > ROOM_AHEAD_M else ("move_angle", {"angle": 45.0})


def main() -> None:
    """Run one episode and save a map without objects."""
    benchbot = BenchBot()
    observations, result = benchbot.reset()
    for _ in range(STEPS):
        if result is not ActionResult.SUCCESS:
            break
        action, arguments = policy(observations, benchbot.actions)
        observations, result = benchbot.step(action, arguments)
    print(f"The episode ended with {result.name}.")
    Path(benchbot.result_filename).write_text(json.dumps(benchbot.empty_results()), encoding="utf-8")


if __name__ == "__main__":
    main()
