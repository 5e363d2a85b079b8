"""Where each episode of a batch lies in its matrix: a row for each environment, a column for robot, seed and repeat."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

from benchbot.plugins.watching.views import EpisodeCell

PENDING, RUNNING, DONE = "pending", "running", "done"
LETTERS = {
    PENDING: "·", RUNNING: "R", DONE: "D",
    "agent": "A", "collision": "C", "timeout": "T", "platform": "P", "infrastructure": "I",
}  # fmt: skip
"""What stands for a state; a failure that is not among them is an F."""
ORDER = (DONE, "agent", "collision", "timeout", "platform", "infrastructure", RUNNING, PENDING)

Column = tuple[str, int, int, int]
"""Robot, seed, repeat, and a number for what differs in something else, such as an episode of the task."""


@dataclass(frozen=True)
class Grid:
    """Which cell is where: `places[row][column]` is an index into the cells, or None where the plan has nothing."""

    environments: tuple[str, ...]
    columns: tuple[Column, ...]
    places: tuple[tuple[int | None, ...], ...]

    @classmethod
    def of(cls, cells: Sequence[EpisodeCell]) -> Self:
        """Return the grid of a batch's cells: environments and robots in their order, then seeds and repeats."""
        robots = {robot: place for place, robot in enumerate(dict.fromkeys(cell.robot for cell in cells))}
        found: dict[str, dict[Column, int]] = {}
        for index, cell in enumerate(cells):
            row = found.setdefault(cell.environment, {})
            number = 0
            while (column := (cell.robot, cell.seed, cell.repeat, number)) in row:
                number += 1
            row[column] = index
        every = {column for row in found.values() for column in row}
        columns = tuple(sorted(every, key=lambda column: (robots[column[0]], *column[1:])))
        places = tuple(tuple(row.get(column) for column in columns) for row in found.values())
        return cls(tuple(found), columns, places)

    @cached_property
    def position(self) -> dict[int, tuple[int, int]]:
        """Row and column of each cell."""
        return {
            index: (row, column)
            for row, places in enumerate(self.places)
            for column, index in enumerate(places)
            if index is not None
        }

    def index(self, row: int, column: int) -> int | None:
        """Return which cell is at a place."""
        return self.places[row][column]


def letter(state: str) -> str:
    """Return the letter of a state."""
    return LETTERS.get(state, "F")


def counts(grid: Grid, states: Sequence[str], row: int) -> dict[str, int]:
    """Return how many cells of a row are in which state, those that went well first."""
    counted = Counter(states[index] for index in grid.places[row] if index is not None)
    known = [state for state in ORDER if state in counted]
    return {state: counted[state] for state in [*known, *sorted(counted.keys() - set(known))]}


def tally(states: Sequence[str]) -> dict[str, int]:
    """Return how many of all cells are in which state."""
    counted = Counter(states)
    known = [state for state in ORDER if state in counted]
    return {state: counted[state] for state in [*known, *sorted(counted.keys() - set(known))]}


def shares(numbers: Sequence[int], width: int) -> list[int]:
    """Return how many of `width` columns stand for each number: all of them, and at least one for what is not 0.

    Where there are fewer columns than that, the greatest numbers have them.
    """
    total = sum(numbers)
    present = sorted((place for place, number in enumerate(numbers) if number), key=lambda place: -numbers[place])
    found = [0] * len(numbers)
    if len(present) >= width:
        for place in present[: max(width, 0)]:
            found[place] = 1
        return found
    for place in present:
        found[place] = max(1, numbers[place] * width // total)
    while present and sum(found) > width:
        found[max(present, key=found.__getitem__)] -= 1
    rest = sorted(present, key=lambda place: found[place] - numbers[place] * width / total)
    for place in rest[: width - sum(found)]:
        found[place] += 1
    return found
