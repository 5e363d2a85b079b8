"""Signals: topics that say yes or no, by a field of a message of any type."""

import re
from collections.abc import Iterator
from typing import Any

from benchbot.plugin import BenchbotError, did_you_mean
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import Signal
from benchbot_robot_ros2.messages import message_type

EACH = "[]"
# As rclpy writes the types of fields: sequence<pkg/Name>, sequence<uint8, 3>, pkg/Name[3], boolean.
_MANY = re.compile(r"sequence<(?P<of>[^,>]+)(, \d+)?>|(?P<these>.+)\[\d+\]")


def says(signal: Signal, message: Any) -> bool:
    """Return whether a message says yes: any value of the field is one of `equals`, or is true where there are none."""
    values = _values(message, signal.field.split("."))
    return any(value in signal.equals if signal.equals else bool(value) for value in values)


def check(robot: Ros2Robot) -> None:
    """Raise BenchbotError when a declared signal's message type is not installed, or has no such field."""
    safety = robot.settings.safety
    for key, signal in (("e_stop", safety.e_stop), ("collision", safety.collision)):
        if signal is not None and (problem := _problem(signal)) is not None:
            raise BenchbotError(
                f"The robot '{robot.name}' cannot be driven: its declaration is wrong at 'driver.safety.{key}'.",
                f"The field '{signal.field}' of {signal.ros_type} says nothing: {problem}.",
                "Name the field that holds a number, a text or a truth, a dot before each part and [] behind each "
                "list: detections[].type; ros2 interface show prints a type.",
            )


def _values(message: Any, path: list[str]) -> Iterator[Any]:
    if not path:
        yield message
        return
    found = getattr(message, path[0].removesuffix(EACH))
    for part in found if path[0].endswith(EACH) else (found,):
        yield from _values(part, path[1:])


def _problem(signal: Signal) -> str | None:
    """Return what is wrong with a field, as part of a sentence; None when it holds simple values."""
    kind = signal.ros_type
    for part in signal.field.split("."):
        name = part.removesuffix(EACH)
        if "/" not in kind:
            return f"'{name}' is asked of a {kind}, which has no parts"
        fields: dict[str, str] = message_type(kind).get_fields_and_field_types()
        if name not in fields:
            return f"there is no '{name}' among {', '.join(fields)}{did_you_mean(name, list(fields))}"
        kind = fields[name]
        many = _MANY.fullmatch(kind)
        if (many is not None) != part.endswith(EACH):
            return f"'{name}' is {'a list, and has no []' if many else 'no list, and has a []'} behind it"
        kind = (many["of"] or many["these"]) if many else kind
        kind = kind.replace("/", "/msg/") if "/" in kind else kind
    return f"it is a {kind}, which has parts" if "/" in kind else None
