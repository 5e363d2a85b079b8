"""The smallest solution of a passive task: follow the trajectory, find nothing."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, Agent, BenchBot, Observations


class PassiveAgent(Agent):
    """Takes the one action there is until the trajectory ends."""

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the end of the trajectory, or when the robot has hit something."""
        return action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, float]]:
        """Tell what was observed and drive on."""
        print(f"Observed {', '.join(sorted(observations))}; going on with {action_list[0]}.", flush=True)
        return action_list[0], {}

    def save_result(
        self, filename: str, empty_results: dict[str, Any], results_format_fns: Mapping[str, Callable[..., Any]]
    ) -> None:
        """Write a map without objects."""
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


if __name__ == "__main__":
    BenchBot(agent=PassiveAgent()).run()
