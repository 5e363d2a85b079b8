"""Pairs of results: what two sets have of the same episode."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

Row = dict[str, Any]


@dataclass(frozen=True)
class Pair:
    """A row of each of two sets, of the same environment and, if both say one, the same seed, repeat and episode."""

    a: Row
    b: Row

    @property
    def environment(self) -> str:
        """The environment string of both."""
        return str(self.a["environment"])

    @property
    def label(self) -> str:
        """What the pair is of, in words."""
        return label(self.a if self.a.get("seed") is not None else self.b)


@dataclass(frozen=True)
class Pairing:
    """The pairs, and the rows of each set that have no counterpart."""

    pairs: list[Pair]
    only_a: list[Row]
    only_b: list[Row]


def pair(rows_a: Sequence[Row], rows_b: Sequence[Row], *, ignore_seeds: bool = False) -> Pairing:
    """Return the rows by pairs, whatever their order.

    A row that does not say its seed pairs with one of its environment that is left, in the order of seeds; with
    `ignore_seeds` all do. What is of no known environment has no counterpart.
    """
    pairs: list[Pair] = []
    left_a: list[Row] = []
    left_b: list[Row] = []
    all_a, all_b = _by_environment(rows_a), _by_environment(rows_b)
    unknown_a, unknown_b = all_a.pop("", []), all_b.pop("", [])
    for environment in sorted({*all_a, *all_b}):
        here_a, here_b = all_a.get(environment, []), all_b.get(environment, [])
        if not ignore_seeds:
            pairs += _take(here_a, here_b, lambda a, b: _numbers(a) == _numbers(b))
        pairs += _take(here_a, here_b, lambda a, b: ignore_seeds or a.get("seed") is None or b.get("seed") is None)
        left_a += here_a
        left_b += here_b
    return Pairing(pairs, left_a + unknown_a, left_b + unknown_b)


def label(row: Row) -> str:
    """Return what a row is of, in words: `miniroom:1, seed 3`."""
    said = [f"{name} {number}" for name, number in _numbers(row).items() if number is not None]
    return ", ".join([str(row["environment"] or row.get("source")), *said])


def _by_environment(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Return the rows of each environment, sorted; those of no known one under an empty string."""
    found: dict[str, list[Row]] = {}
    for row in sorted(rows, key=_order):
        found.setdefault(row["environment"] or "", []).append(row)
    return found


def _order(row: Row) -> tuple[Any, ...]:
    return *((number is None, number or 0) for number in _numbers(row).values()), str(row.get("source"))


def _take(rows_a: list[Row], rows_b: list[Row], belong: Callable[[Row, Row], bool]) -> list[Pair]:
    """Take the rows that belong together out of both lists."""
    pairs = []
    for row in list(rows_a):
        other = next((other for other in rows_b if belong(row, other)), None)
        if other is not None:
            rows_a[:] = [kept for kept in rows_a if kept is not row]
            rows_b[:] = [kept for kept in rows_b if kept is not other]
            pairs.append(Pair(row, other))
    return pairs


def _numbers(row: Row) -> dict[str, Any]:
    """Return what tells apart the results of an environment; None for each number that is not said."""
    return {name: row.get(name) for name in ("seed", "episode", "repeat")}
