"""A semantic mapper that is as good as it is told to be: certificates rank some of these in two simulators.

It maps objects from depth, perfect segmentation and camera poses along the trajectory of a passive task.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.api import ActionResult, Agent, BenchBot, Observations
from benchbot.mapping import ObjectMap, describe


class RankedMapper(Agent):
    """Maps each `every`-th observation, and of it what is nearer than `reach_m`."""

    def __init__(self, every: int, reach_m: float) -> None:
        self._every, self._reach_m = every, reach_m
        self._map = ObjectMap()
        self._seen = 0

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the end of the trajectory, or when the robot has hit something."""
        return action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, float]]:
        """Map what is seen, if it is its turn, and go on."""
        if self._seen % self._every == 0:
            depth_m = observations["image_depth"]
            nearby = observations.copy()
            nearby["image_depth"] = np.where(depth_m <= self._reach_m, depth_m, np.float32(np.inf))
            self._map.add(nearby)
        self._seen += 1
        return "move_next", {}

    def save_result(
        self, filename: str, empty_results: dict[str, Any], results_format_fns: Mapping[str, Callable[..., Any]]
    ) -> None:
        """Write the map."""
        results = empty_results["results"]
        results["objects"] = [describe(item, results["class_list"]) for item in self._map.objects]
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--reach-m", type=float, default=12.0)
    given = parser.parse_args()
    BenchBot(agent=RankedMapper(given.every, given.reach_m)).run()
