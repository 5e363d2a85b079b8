"""How a solution takes arguments: `benchbot submit --example hello_args --args "--steps 5 --greeting Hi"`."""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, Agent, BenchBot, Observations


class PoliteAgent(Agent):
    """Takes as many steps as it was told to, with a greeting for each."""

    def __init__(self, steps: int, greeting: str) -> None:
        self._left = steps
        self._greeting = greeting

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop after the steps that were asked for, at the end of the trajectory, or after a collision."""
        return self._left == 0 or action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, float]]:
        """Greet, and follow the trajectory; without one, look around."""
        x, y, _ = observations["poses"]["camera"]["translation_xyz"]
        print(f"{self._greeting} from ({x:.2f}, {y:.2f}) m, {self._left} to go.", flush=True)
        self._left -= 1
        return ("move_next", {}) if "move_next" in action_list else ("move_angle", {"angle": 30.0})

    def save_result(
        self, filename: str, empty_results: dict[str, Any], results_format_fns: Mapping[str, Callable[..., Any]]
    ) -> None:
        """Write a map without objects."""
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=3, help="how many steps to take")
    parser.add_argument("--greeting", default="Hello", help="what to say at each")
    given = parser.parse_args()
    BenchBot(agent=PoliteAgent(given.steps, given.greeting)).run()
