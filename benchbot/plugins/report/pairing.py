"""Pairing the rows of two sets of results that are of the same episode under the same settings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from benchbot.core import overrides
from benchbot.evaluation.result_document import NUMBERS, describe

Row = dict[str, Any]


@dataclass(frozen=True)
class Pair:
    """A row of each of two sets: the same environment, settings and, if both say one, seed, repeat and episode."""

    a: Row
    b: Row

    @property
    def environment(self) -> str:
        """The environment string of both."""
        return str(self.a["environment"])

    @property
    def label(self) -> str:
        """The environment and the condition of the pair in words."""
        row = self.a if self.a.get("seed") is not None else self.b
        return label(row if settings(self.a) == settings(self.b) else {**row, "settings": {}})


@dataclass(frozen=True)
class Pairing:
    """The pairs, and the rows of each set that have no counterpart."""

    pairs: list[Pair]
    only_a: list[Row]
    only_b: list[Row]


def pair(
    rows_a: Sequence[Row], rows_b: Sequence[Row], *, ignore_seeds: bool = False, ignore_settings: bool = False
) -> Pairing:
    """Return the rows by pairs, whatever their order.

    A row that does not say its seed pairs with one of its environment that is left, in the order of seeds; with
    `ignore_seeds` all do. Of several robots, as of a fleet, equal ones pair first. Rows whose runs overrode their
    environment differently (`--set`) do not pair unless `ignore_settings`. A row of no known environment has no
    counterpart.
    """
    pairs: list[Pair] = []
    left_a: list[Row] = []
    left_b: list[Row] = []
    unknown_a, unknown_b = ([row for row in rows if not row["environment"]] for rows in (rows_a, rows_b))
    all_a, all_b = _by_condition(rows_a, ignore_settings), _by_condition(rows_b, ignore_settings)
    for condition in sorted({*all_a, *all_b}):
        here_a, here_b = all_a.get(condition, []), all_b.get(condition, [])
        if not ignore_seeds:
            pairs += _take_pairs(here_a, here_b, lambda a, b: _numbers(a) == _numbers(b) and _robot(a) == _robot(b))
            pairs += _take_pairs(here_a, here_b, lambda a, b: _numbers(a) == _numbers(b))
        pairs += _take_pairs(
            here_a, here_b, lambda a, b: ignore_seeds or a.get("seed") is None or b.get("seed") is None
        )
        left_a += here_a
        left_b += here_b
    return Pairing(pairs, left_a + unknown_a, left_b + unknown_b)


def label(row: Row) -> str:
    """Return the environment and the condition of a row in words: `miniroom:1, seed 3, lighting.time=21:30`."""
    return describe(str(row["environment"] or row.get("source")), row)


def settings(row: Row) -> str:
    """Return the overrides (`--set`) of a row's run in words, empty without any."""
    return overrides.label(row.get("settings") or {})


def _by_condition(rows: Sequence[Row], ignore_settings: bool) -> dict[tuple[str, str], list[Row]]:
    """Return the rows of each known environment under each choice of settings, sorted."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in sorted(rows, key=_order):
        if row["environment"]:
            found.setdefault((row["environment"], "" if ignore_settings else settings(row)), []).append(row)
    return found


def _order(row: Row) -> tuple[Any, ...]:
    numbers = ((number is None, number or 0) for number in _numbers(row).values())
    return *numbers, settings(row), str(row.get("source"))


def _take_pairs(rows_a: list[Row], rows_b: list[Row], match: Callable[[Row, Row], bool]) -> list[Pair]:
    """Remove the rows that match from both lists and return them by pairs."""
    pairs = []
    for row in list(rows_a):
        other = next((other for other in rows_b if match(row, other)), None)
        if other is not None:
            rows_a[:] = [kept for kept in rows_a if kept is not row]
            rows_b[:] = [kept for kept in rows_b if kept is not other]
            pairs.append(Pair(row, other))
    return pairs


def _robot(row: Row) -> str | None:
    selection = (row.get("provenance") or {}).get("selection") or {}
    return selection.get("robot")


def _numbers(row: Row) -> dict[str, Any]:
    """Return the numbers that tell results of an environment apart, None for each that is not said."""
    return {name: row.get(name) for name in NUMBERS}
