"""A policy that drives to a point, learnt by trial and error: depth, laser and poses in, one of three moves out.

Moves are drawn more sharply than in training as long as the robot gets to places that it was not in. It ends the run
when it is within the task's distance of the goal, or has used up its moves. weights=FILE has it drive by another
policy, an ONNX file that `benchbot_baselines.policy_training` has written. seed=N draws other moves.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.api import ActionResult, Agent, BenchBot, BenchbotError, Observations
from benchbot_baselines.navigation import FORWARD_M, TURN_DEG, WEIGHTS, Navigator

ARRIVED_M = 0.18
MOST_MOVES = 400
SHARPER = 3.0
PLACE_M = 0.5
PATIENCE_MOVES = 15
"""After so many moves in places where it was, moves are drawn as in training: they get it out of dead ends."""
MOVES: tuple[tuple[str, dict[str, float]], ...] = (
    ("move_distance", {"distance": FORWARD_M}),
    ("move_angle", {"angle": TURN_DEG}),
    ("move_angle", {"angle": -TURN_DEG}),
)


class PointGoalPolicy(Agent):
    """A solution that draws its moves by the policy's logits."""

    def __init__(self, navigator: Navigator, seed: int) -> None:
        self._navigator = navigator
        self._random = np.random.default_rng(seed)
        self._moves = 0
        self._arrived = False
        self._been: set[tuple[int, int]] = set()
        self._moves_in_places_known = 0

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the goal, after enough moves, and after a collision."""
        return self._arrived or self._moves >= MOST_MOVES or action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, float]]:
        """Draw the next move."""
        logits = self._navigator.act(observations).astype(np.float64)
        self._moves += 1
        self._arrived = self._navigator.left_m <= ARRIVED_M
        if self._arrived:
            return "move_angle", {"angle": 0.0}
        if self._gets_on():
            logits *= SHARPER
        likely = np.exp(logits - logits.max())
        action = int(self._random.choice(len(MOVES), p=likely / likely.sum()))
        self._navigator.chose(action)
        return MOVES[action]

    def _gets_on(self) -> bool:
        """Return whether the robot was in a new place lately."""
        x, y = self._navigator.here_xy
        place = (round(x / PLACE_M), round(y / PLACE_M))
        self._moves_in_places_known = self._moves_in_places_known + 1 if place in self._been else 0
        self._been.add(place)
        return self._moves_in_places_known < PATIENCE_MOVES

    def save_result(
        self,
        filename: str,
        empty_results: dict[str, Any],
        results_format_fns: Mapping[str, Callable[..., Any]],
    ) -> None:
        """Write the empty result: the score depends on the robot's path."""
        print(f"Stopped after {self._moves} moves, {self._navigator.left_m:.2f} m from the goal.")
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", metavar="weights=FILE|seed=N", help="another policy, or other draws")
    named = dict(word.partition("=")[::2] for word in parser.parse_args().words)
    try:
        navigator = Navigator(Path(named.get("weights", WEIGHTS)))
    except BenchbotError as error:
        raise SystemExit(str(error)) from None
    BenchBot(agent=PointGoalPolicy(navigator, int(named.get("seed", 0)))).run()
