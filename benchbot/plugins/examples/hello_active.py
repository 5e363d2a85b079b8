"""The smallest solution of an active task: take a short walk, or let a person drive."""

import argparse
import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, Agent, BenchBot

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
        self._next = next(self._moves, None)

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop after the last move, or when the robot has hit something."""
        return self._next is None or action_result is not ActionResult.SUCCESS

    def pick_action(self, observations: Mapping[str, Any], action_list: list[str]) -> Move:
        """Tell what was observed and make the next move."""
        move = self._next
        if move is None:
            raise RuntimeError("there are no more moves to pick from")
        self._next = next(self._moves, None)
        print(f"Observed {', '.join(sorted(observations))}; going on with {move[0]}.", flush=True)
        return move

    def save_result(self, filename: str, empty_results: dict[str, Any], results_format_fns: Mapping[str, Any]) -> None:
        """Write a map without objects."""
        results = results_format_fns["create"]() if "create" in results_format_fns else {}
        Path(filename).write_text(json.dumps({**empty_results, "results": results}), encoding="utf-8")


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
