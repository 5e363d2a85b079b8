"""The types of what a platform returns: one finding for all that is wrong, with the lines to mend."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from benchbot.core.geometry import Pose
from benchbot.core.platform import Platform
from benchbot.plugins.authoring.conformance.bench import SEED, Bench
from benchbot.plugins.authoring.conformance.properties import Violation


def has_the_right_types(bench: Bench, platform: Platform) -> str:
    """Every member returns what `benchbot.core.platform.Platform` says: a pose a Pose, a flag a bool."""
    members = dict(_members(bench, platform))
    wrong, lines = [], []
    platform.load(bench.scene, SEED)
    for name, (ask, is_right, wanted) in members.items():
        value = ask()
        if not is_right(value):
            wrong.append(f"{name} gives {_shown(value)}, not {wanted}")
            lines.append(_line(platform, name))
    if wrong:
        raise Violation(f"{'; '.join(wrong)}.", f"Mend {', '.join(dict.fromkeys(lines))}.")
    return f"{len(members)} members"


def _members(
    bench: Bench, platform: Platform
) -> Iterator[tuple[str, tuple[Callable[[], object], Callable[[Any], bool], str]]]:
    """Yield each member with the call of it, the test of what it returns, and what that should be."""
    period_s = 0.05 if not _is_number(platform.control_period_s) else platform.control_period_s
    yield "control_period_s", (lambda: platform.control_period_s, _is_number, "seconds, a float")
    yield "pose", (platform.pose, lambda value: isinstance(value, Pose), "a benchbot.plugin.Pose")
    yield "odometry", (platform.odometry, lambda value: isinstance(value, Pose), "a benchbot.plugin.Pose")
    yield "velocity", (lambda: platform.velocity, _is_velocity, "a tuple of two floats, m/s and rad/s")
    yield "collided", (lambda: platform.collided, lambda value: isinstance(value, bool), "a bool")
    yield "clock", (platform.clock, _is_number, "seconds, a float")
    ahead = lambda: platform.contact_ahead(0.0, 0.0, period_s)  # noqa: E731 - one of a row of them
    yield "contact_ahead", (ahead, lambda value: isinstance(value, bool), "a bool")
    yield "observe", (lambda: platform.observe(()), lambda value: isinstance(value, Mapping), "a dict of channels")


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


def _is_velocity(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 2 and all(map(_is_number, value))


def _shown(value: Any) -> str:
    kind = type(value)
    name = kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"
    return f"{value!r} ({name})" if len(repr(value)) < 40 else f"a value of type {name}"


def _line(platform: Platform, name: str) -> str:
    """Return the file and line where the platform's class defines a member."""
    member = inspect.getattr_static(type(platform), name, None)
    function: Any = member.fget if isinstance(member, property) else member
    try:
        return f"{inspect.getsourcefile(function)}:{inspect.getsourcelines(function)[1]}"
    except (TypeError, OSError):
        return f"{name} of {type(platform).__name__}"
