"""A solution as a process of this machine, of the same user and with the same rights as BenchBot itself."""

import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.submission.modes import RESULT, Running
from benchbot.submission.solution import Solution
from benchbot.wire.run_state import Connection

if TYPE_CHECKING:
    from benchbot.submission.episode import Order


@dataclass(frozen=True)
class Native:
    """Runs a solution with everything that the user who submits it has."""

    name = "native"
    needs_socket = False

    def describe(self) -> str:
        """Return how the solution is held."""
        return "with all rights of its user"

    def check(self) -> None:
        """Do nothing: it is always possible."""

    def start(
        self, order: "Order", connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> AbstractContextManager[Running]:
        """Return the solution as a process."""
        variables = {**connection.environment(), "BENCHBOT_RESULT": str(exchange / RESULT), **order.variables}
        return Solution(order.command, order.folder, {**_environment(), **variables}, output)


NATIVE = Native()


def _environment() -> dict[str, str]:
    """Return this process's environment without the folders of add-ons: ground truths are in them."""
    kept = {name: value for name, value in os.environ.items() if name != "BENCHBOT_ADDONS"}
    return {**kept, "PYTHONUNBUFFERED": "1"}
