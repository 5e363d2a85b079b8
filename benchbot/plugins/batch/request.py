"""A request for a batch, from a YAML file (schema `batch`) and options, which override the file."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchbot.cli.kit.holding import size_in_bytes
from benchbot.core import overrides
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.randomness import HOW_TO_MAKE_ONE, read_secret
from benchbot.core.request import AUTO, Limits
from benchbot.plugins.batch.early_end import failure_limit
from benchbot.plugins.batch.plan import Hold, Policy
from benchbot.submission.modes import split_words

Wanted = dict[str, Any]
"""The content of a batch file, or of options by the same keys."""

SOLUTIONS = ("native", "sandbox", "containerised", "example")
"""The keys that name the solution: one of them."""

_RANGE = re.compile(r"(\d+)(?:\.\.(\d+))?")
_LONGEST_RANGE = 1_000_000


@dataclass(frozen=True)
class BatchRequest:
    """The axes of a batch, and what runs in each episode."""

    task: str
    robots: Sequence[str]
    environments: Sequence[str]
    native: str | None = None
    """The command, also one that a sandbox holds."""
    example: str | None = None
    hold: Hold = Hold()  # noqa: RUF009 - it is frozen
    words: Sequence[str] = ()
    source: Sequence[str] = ()
    """Globs of files that belong to the solution, beside those that its command leads to."""
    seeds: Sequence[int] = (0,)
    repeats: int = 1
    episodes: Sequence[int] | None = None
    settings: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    method: str | None = None
    limits: Limits = field(default_factory=Limits)
    timeout_s: float | None = None
    record: Sequence[str] = ()
    policy: Policy = field(default_factory=Policy)
    secret: str = field(default="", repr=False)
    device: str = AUTO


def read_file(path: Path) -> Wanted:
    """Return the content of a batch file; raises BenchbotError naming file and line of everything wrong with it."""
    document = schema.read(path)
    schema.check(document, "batch", path)
    return document


def merged(told: Wanted, given: Mapping[str, Any]) -> Wanted:
    """Return the content of a file, overridden by options; an option that is None was not given."""
    named = (*SOLUTIONS, "solutions")
    if any(given.get(key) is not None for key in named):
        told = {key: value for key, value in told.items() if key not in named}
    limits = {**told.get("limits", {}), **_not_none(given.get("limits", {}))}
    return {**told, **_not_none(given), "limits": limits}


def request_of(wanted: Wanted) -> BatchRequest:
    """Return the request; raises BenchbotError that names everything that is missing."""
    missing = [
        option
        for key, option in (("task", "--task"), ("robots", "--robots"), ("environments", "--envs or --envs-batch"))
        if not wanted.get(key)
    ]
    if missing:
        raise BenchbotError(
            "It is not clear what to compute.",
            f"Missing: {', '.join(missing)}.",
            "Say it like this: benchbot batch --task T --robots R1,R2 --envs E1,E2 --example hello_passive",
        )
    settings = wanted.get("set", {})
    return BatchRequest(
        task=wanted["task"],
        robots=names(wanted["robots"]),
        environments=names(wanted["environments"]),
        native=wanted.get("native") or wanted.get("sandbox"),
        example=wanted.get("example"),
        words=tuple(split_words("--args", wanted.get("args"))),
        source=tuple(wanted.get("source", ())),
        seeds=numbers("--seeds", wanted.get("seeds", 0)),
        repeats=wanted.get("repeats", 1),
        episodes=None if "episodes" not in wanted else numbers("--episodes", wanted["episodes"]),
        settings=settings_axes(settings) if isinstance(settings, list) else _axes(settings),
        method=wanted.get("evaluate_with"),
        limits=Limits(**wanted.get("limits", {})),
        timeout_s=wanted.get("timeout_s"),
        record=tuple(name for text in wanted.get("record", ()) for name in text.split(",")),
        policy=_policy(wanted),
        secret=_secret(wanted.get("secret")),
        device=wanted.get("device", AUTO),
    )


def _secret(file: str | None) -> str:
    if file == "random":
        raise BenchbotError(
            "A batch cannot draw its secret.",
            "The same command goes on where it was ended, and would be another batch with another secret.",
            f"Make one, and give it every time: {HOW_TO_MAKE_ONE}; benchbot batch --secret secret.txt …",
        )
    return "" if file is None else read_secret(Path(file))


def _policy(wanted: Wanted) -> Policy:
    told = {key: wanted[key] for key in Policy.__dataclass_fields__ if key in wanted}
    if "fail_on_error" in told:
        told["fail_on_error"] = failure_limit(told["fail_on_error"])
    if "log_limit" in wanted:
        told["log_limit_bytes"] = size_in_bytes("--log-limit", wanted["log_limit"])
    return Policy(**told)


def names(value: str | Sequence[str]) -> list[str]:
    """Return the names in a list, or in `a,b,c`, each once."""
    found = (name.strip() for name in value.split(",")) if isinstance(value, str) else value
    return list(dict.fromkeys(name for name in found if name))


def numbers(option: str, value: str | int | Sequence[int]) -> list[int]:
    """Return a number, those of a list, or those in `0..4` or `0,2,7..9` (both ends count), each once.

    Raises BenchbotError.
    """
    if isinstance(value, int):
        return [value]
    if not isinstance(value, str):
        return list(dict.fromkeys(value))
    found: list[int] = []
    for part in value.split(","):
        match = _RANGE.fullmatch(part.strip())
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last < first + _LONGEST_RANGE:
            raise BenchbotError(
                f"{option} {value} names no numbers.",
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


def _axes(settings: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return dotted key to values from a file's mapping, in which a list stands for several values."""
    return {
        key: [overrides.normal({key: one})[key] for one in (value if isinstance(value, list) else [value])]
        for key, value in settings.items()
    }


def _not_none(given: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in given.items() if value is not None}
