"""Checks that the object map formats share; each yields a line per problem: the place in the document, and why."""

from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import Any

from benchbot.core.errors import BenchbotError

LENGTH_LIMIT_M = 1e6
WEIGHT_LIMIT = 1e9
COUNT_LIMIT = 100_000
_SHOWN = 10


def raise_any(problems: Iterable[str], format_name: str) -> None:
    """Raise BenchbotError that lists the first problems, if there is one."""
    found = list(islice(problems, _SHOWN + 1))
    if not found:
        return
    more = ["… and more."] if len(found) > _SHOWN else []
    raise BenchbotError(
        f"This is not a valid {format_name}.",
        "\n".join(found[:_SHOWN] + more),
        f"Build it with the functions of the format; benchbot show format {format_name} names them.",
    )


def mapping(value: Any, keys: tuple[str, ...], path: str) -> Iterator[str]:
    """Yield what keeps `value` from being a mapping that has all `keys`."""
    if not isinstance(value, dict):
        yield f"{path}: must be a mapping, not {kind(value)}"
        return
    for key in keys:
        if key not in value:
            yield f"{path}.{key}: is missing"


def each(items: Any, path: str, check: Callable[[dict[str, Any], str], Iterator[str]]) -> Iterator[str]:
    """Yield what `check` finds in each mapping of a list."""
    if not isinstance(items, list):
        yield f"{path}: must be a list, not {kind(items)}"
        return
    for i, item in enumerate(items):
        wrong = list(mapping(item, (), f"{path}[{i}]"))
        yield from wrong or check(item, f"{path}[{i}]")


def names(value: Any, path: str) -> Iterator[str]:
    """Yield what keeps `value` from being a list of distinct, non-empty strings with at least one."""
    if not isinstance(value, list):
        yield f"{path}: must be a list of strings, not {kind(value)}"
        return
    if not value:
        yield f"{path}: must name at least one"
    seen = set()
    for i, name in enumerate(value):
        if not isinstance(name, str) or not name:
            yield f"{path}[{i}]: must be a non-empty string, not {'empty' if name == '' else kind(name)}"
        elif name in seen:
            yield f"{path}[{i}]: '{name}' is named twice"
        else:
            seen.add(name)


def box(item: dict[str, Any], path: str) -> Iterator[str]:
    """Yield what is wrong with an axis-aligned box: `centroid` and full `extent`, metres, 3 numbers each."""
    for key, lowest in (("centroid", -LENGTH_LIMIT_M), ("extent", 0.0)):
        yield from numbers(item.get(key), f"{path}.{key}", 3, "must be", lowest, LENGTH_LIMIT_M)


def probabilities(value: Any, path: str, length: int, counted: str) -> Iterator[str]:
    """Yield what keeps `value` from being `length` finite, non-negative numbers. They need not sum to 1."""
    yield from numbers(value, path, length, f"{counted} has", 0.0, WEIGHT_LIMIT)


def numbers(value: Any, path: str, length: int, expected: str, lowest: float, highest: float) -> Iterator[str]:
    """Yield what keeps `value` from being a list of `length` numbers in [lowest, highest]."""
    if not isinstance(value, list | tuple):
        yield f"{path}: " + ("is missing" if value is None else f"must be a list, not {kind(value)}")
        return
    if len(value) != length:
        yield f"{path}: {len(value)} numbers, {expected} {length}"
        return
    for i, number in enumerate(value):
        if isinstance(number, bool) or not isinstance(number, int | float):
            yield f"{path}[{i}]: must be a number, not {kind(number)}"
        elif not lowest <= number <= highest:
            fault = "NaN" if number != number else f"below {lowest:g}" if number < lowest else f"above {highest:g}"
            yield f"{path}[{i}]: must be from {lowest:g} to {highest:g}, not {fault}"


def kind(value: Any) -> str:
    """Return a JSON value's type in plain words."""
    known = {
        type(None): "nothing",
        bool: "true or false",
        int: "a number",
        float: "a number",
        str: "text",
        list: "a list",
        dict: "a mapping",
    }
    return known.get(type(value), type(value).__name__)


def count(value: Any, name: str) -> int:
    """Return how many classes or states an object has; raises BenchbotError for a number that makes no sense."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= COUNT_LIMIT:
        raise BenchbotError(
            f"{name} is not a number of things.",
            f"It must be an integer from 0 to {COUNT_LIMIT}.",
            "Pass the length of the map's list of them.",
        )
    return value
