"""The smallest solution of an active task: take a short walk, or let a person drive."""

import argparse
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, Agent, BenchBot, Observations

Move = tuple[str, dict[str, float]]

WALK: tuple[Move, ...] = (
    ("move_angle", {"angle": 45.0}),
    ("move_angle", {"angle": -90.0}),
    ("move_angle", {"angle": 45.0}),
    ("move_distance", {"distance": 0.2}),
    ("move_distance", {"distance": -0.2}),
)


class ActiveAgent(Agent):
    """Makes one move after another until there are no more."""

    def __init__(self, moves: Iterable[Move]) -> None:
        self._moves = iter(moves)
        self._move: Move | None = None

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop after the last move, or when the robot has hit something."""
        if action_result is not ActionResult.SUCCESS:
            return True
        self._move = next(self._moves, None)
        return self._move is None

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> Move:
        """Tell what was observed and make the next move."""
        if self._move is None:
            raise RuntimeError("is_done() comes before pick_action()")
        print(f"Observed {', '.join(sorted(observations))}; going on with {self._move[0]}.", flush=True)
        return self._move

    def save_result(
        self, filename: str, empty_results: dict[str, Any], results_format_fns: Mapping[str, Callable[..., Any]]
    ) -> None:
        """Write a map without objects."""
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


def typed_moves() -> Iterator[Move]:
    """Yield the moves that a person types: `d 1` drives 1 m, `a 90` turns by 90°, an empty line ends."""
    actions = {"d": ("move_distance", "distance"), "a": ("move_angle", "angle")}
    while line := input("d METRES, a DEGREES, or nothing to end: ").strip():
        letter, _, number = line.partition(" ")
        try:
            action, argument = actions[letter]
            yield action, {argument: float(number)}
        except (KeyError, ValueError):
            print(f"'{line}' is neither 'd 1' nor 'a 90'.")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--interactive", action="store_true", help="read the moves from the terminal")
    BenchBot(agent=ActiveAgent(typed_moves() if parser.parse_args().interactive else WALK)).run()
