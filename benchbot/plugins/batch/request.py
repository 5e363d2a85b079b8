"""What is asked of a batch: the axes of its matrix, from the words of a command line or a file."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from benchbot.core import overrides
from benchbot.core.errors import BenchbotError
from benchbot.core.request import Limits
from benchbot.plugins.batch.plan import Hold, Policy

_RANGE = re.compile(r"(\d+)(?:\.\.(\d+))?")
_LONGEST_RANGE = 1_000_000


@dataclass(frozen=True)
class Request:
    """The axes of a batch, and what runs in each episode."""

    task: str
    robots: Sequence[str]
    environments: Sequence[str]
    native: str | None = None
    """The command, also one that a sandbox holds."""
    example: str | None = None
    hold: Hold = Hold()  # noqa: RUF009 - it is frozen
    words: Sequence[str] = ()
    seeds: Sequence[int] = (0,)
    repeats: int = 1
    episodes: Sequence[int] | None = None
    settings: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    method: str | None = None
    limits: Limits = field(default_factory=Limits)
    timeout_s: float | None = None
    record: Sequence[str] = ()
    policy: Policy = field(default_factory=Policy)


def names(text: str) -> list[str]:
    """Return the names in `a,b,c`, each once."""
    return list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))


def numbers(option: str, text: str) -> list[int]:
    """Return the numbers in `0..4` or `0,2,7..9` (both ends count), each once; raises BenchbotError."""
    found: list[int] = []
    for part in text.split(","):
        match = _RANGE.fullmatch(part.strip())
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last < first + _LONGEST_RANGE:
            raise BenchbotError(
                f"{option} {text} names no numbers.",
                f"'{part.strip()}' is neither a number nor a range, such as 0..4, from low to high.",
                f"Write it like this: {option} 0..4   or: {option} 0,3,7",
            )
        found += range(first, last + 1)
    return list(dict.fromkeys(found))


def settings_axes(texts: Sequence[str]) -> dict[str, list[Any]]:
    """Return dotted key to values from `KEY=VALUE` or `KEY=VALUE,VALUE` texts; raises BenchbotError.

    A comma inside brackets or quotes is part of a value: `lighting.on=[lamp_1, lamp_2]` is one.
    """
    axes: dict[str, list[Any]] = {}
    for text in texts:
        key, _, values = text.partition("=")
        parsed = [overrides.parse([f"{key}={value}" if "=" in text else text]) for value in split_values(values)]
        if key in axes:
            raise BenchbotError(
                f"--set {key} is given twice.",
                "All values of a setting are named together.",
                f"Write it like this: --set {text}",
            )
        axes[key] = list({repr(one[key]): one[key] for one in parsed}.values())
    return axes


def split_values(text: str) -> list[str]:
    """Return the parts of a text between commas, but for those inside brackets, braces and quotes."""
    parts, depth, quote = [""], 0, ""
    for character in text:
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        elif character in "[{":
            depth += 1
        elif character in "]}":
            depth -= 1
        elif character == "," and depth == 0:
            parts.append("")
            continue
        parts[-1] += character
    return [part.strip() for part in parts]
