"""The errors of failed episodes, equal ones together."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

LONGEST = 300
SHOWN = 5
_VARYING = re.compile(r"0x[0-9a-fA-F]+|\d+(\.\d+)?")
_NO_MODULE = re.compile(r"ModuleNotFoundError: No module named '([\w.]+)'")
_NO_MEMORY = re.compile(r"\b(MemoryError|OutOfMemoryError|out of memory)\b", re.IGNORECASE)


@dataclass(frozen=True)
class ErrorGroup:
    """Episodes that failed alike: how many, the class, the error of the first of them, and its name."""

    count: int
    failure: str
    error: str
    episode: str


def cause(why: str) -> str:
    """Return the line of a failure's reason that says most: the last, which names a program's exception."""
    said = [line.strip() for line in why.splitlines() if line.strip()]
    return said[-1][:LONGEST] if said else ""


def grouped(failed: Iterable[tuple[str, str, str]]) -> tuple[ErrorGroup, ...]:
    """Return groups of (class, error, episode), the largest first; errors that differ in numbers only are equal."""
    groups: dict[tuple[str, str], ErrorGroup] = {}
    for failure, error, episode in failed:
        key = failure, _VARYING.sub("#", error)
        group = groups.get(key, ErrorGroup(0, failure, error, episode))
        groups[key] = replace(group, count=group.count + 1)
    return tuple(sorted(groups.values(), key=lambda group: -group.count))


def lines(groups: Sequence[ErrorGroup], folder: str) -> list[str]:
    """Return the groups in words, each with one fix."""
    found = []
    for group in groups[:SHOWN]:
        counted = f"{group.count} episode{'s' * (group.count != 1)}"
        found.append(f"{counted}: {group.error or group.failure}")
        found.append(f"  {remedy(group.error) or f'Look into its log: benchbot batch logs {folder} {group.episode}'}")
    left = sum(group.count for group in groups[SHOWN:])
    return [*found, *([f"{left} more, of {len(groups) - SHOWN} other errors"] if left else [])]


def remedy(error: str) -> str:
    """Return the fix of an error that is known; an empty text for others."""
    module = _NO_MODULE.search(error)
    if module is not None:
        name = module[1].partition(".")[0]
        return f"Install it for the Python that runs the solution: python -m pip install {name}"
    if _NO_MEMORY.search(error):
        return "Let fewer run at once: --jobs N; or give it more: --memory SIZE where it is held."
    return ""
