"""What `benchbot batch` is told, in a YAML file (schema `batch`) or by options, which override the file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchbot.core import overrides
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.request import Limits
from benchbot.plugins.batch.plan import Policy
from benchbot.plugins.batch.request import Request, names, numbers, settings_axes
from benchbot.submission.command import split_words

Wanted = dict[str, Any]


SOLUTIONS = ("native", "sandbox", "containerised", "example")
"""The keys that say what is run: one of them."""


def read(path: Path) -> Wanted:
    """Return what a batch file says; raises BenchbotError naming file and line of everything that is wrong with it."""
    document = schema.read(path)
    schema.check(document, "batch", path)
    return document


def merged(told: Wanted, given: Mapping[str, Any]) -> Wanted:
    """Return what a file says, overridden by what the command line says; None there says nothing."""
    limits = {**told.get("limits", {}), **_said(given.get("limits", {}))}
    if any(given.get(key) is not None for key in SOLUTIONS):
        told = {key: value for key, value in told.items() if key not in SOLUTIONS}
    return {**told, **_said(given), "limits": limits}


def request(wanted: Wanted) -> Request:
    """Return what is asked of a batch; raises BenchbotError that names everything that is missing."""
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
    policy = {
        key: wanted[key]
        for key in ("retries", "rerun_collided", "stall_s", "stale_s", "minimum_free_bytes")
        if key in wanted
    }
    return Request(
        task=wanted["task"],
        robots=_names(wanted["robots"]),
        environments=_names(wanted["environments"]),
        native=wanted.get("native") or wanted.get("sandbox"),
        example=wanted.get("example"),
        words=tuple(split_words("--args", wanted.get("args"))),
        seeds=_numbers("--seeds", wanted.get("seeds", 0)),
        repeats=wanted.get("repeats", 1),
        episodes=None if "episodes" not in wanted else _numbers("--episodes", wanted["episodes"]),
        settings=_axes(wanted.get("set", {})),
        method=wanted.get("evaluate_with"),
        limits=Limits(**wanted.get("limits", {})),
        timeout_s=wanted.get("timeout_s"),
        record=tuple(wanted.get("record", ())),
        policy=Policy(**policy),
    )


def _said(given: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in given.items() if value is not None}


def _names(value: str | list[str]) -> list[str]:
    return names(value) if isinstance(value, str) else list(dict.fromkeys(value))


def _numbers(option: str, value: str | int | list[int]) -> list[int]:
    if isinstance(value, int):
        return [value]
    return numbers(option, value) if isinstance(value, str) else list(dict.fromkeys(value))


def _axes(settings: list[str] | Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return dotted key to values, from texts or a mapping, in which a list stands for several values."""
    if isinstance(settings, list):
        return settings_axes(settings)
    return {
        key: [overrides.normal({key: one})[key] for one in (value if isinstance(value, list) else [value])]
        for key, value in settings.items()
    }
