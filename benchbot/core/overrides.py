"""Settings of a run that override its environments' declarations: `lighting.time=21:30`, `assets=sweethome3d`."""

import json
import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from itertools import combinations
from typing import Any

import yaml

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.findings import Problem

OPEN_KEYS = ("lighting", "options", "assets")
"""Keys of an environment that a run may change; `options` are passed on to the simulator."""

BY_TIME = ("time", "date", "latitude_deg", "north_deg", "turbidity")
BY_HAND = ("sun", "sky")
_WAYS = (BY_HAND, BY_TIME)
"""The two ways to declare daylight (in `lighting`), of which an environment has one."""

_ANOTHER = "Choose another environment with --env (benchbot list environments)."
_OWN = "Make an environment of your own: see docs/declarations.md"
FIXED_KEYS = {
    "name": ("It says which environment this is.", _ANOTHER),
    "variant": ("It says which environment this is.", _ANOTHER),
    "type": ("It says what runs the environment.", _ANOTHER),
    "driver": (
        "It is how the robot is reached, not the environment.",
        "Choose one robot of several by its namespace, --robot NAME@NAMESPACE, or declare a fleet: see docs/ros2.md",
    ),
    "robots": ("It says which robots the environment is made for.", "Choose one of them with --robot."),
    "map_path": ("It is the scene that the ground truth is of.", _ANOTHER),
    "object_labels": ("They are what segmentation and the ground truth are in terms of.", _OWN),
    "start_pose": ("Results of one environment are comparable because all start there.", _OWN),
    "trajectory_poses": ("Results of one environment are comparable because all drive along it.", _OWN),
    "occupancy_map": ("It is the map of the scene.", _OWN),
    "description": ("It says what the environment is, to people.", _OWN),
}
"""Keys that no run may change, of an environment or a robot: why, and what to do instead."""


class _Loader(yaml.SafeLoader):
    """YAML 1.2's core schema (yaml.org/spec/1.2.2, section 10.3): 21:30, 2023-06-21, on and off stay text."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012


for _tag, _pattern, _first in (
    ("null", r"null|Null|NULL|~", "nN~"),
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("int", r"[-+]?(0|[1-9][0-9]*)", "-+0123456789"),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+\.[0-9]*|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?", "-+.0123456789"),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_pattern})$"), list(_first))


def parse(texts: Sequence[str]) -> dict[str, Any]:
    """Return dotted key to value from `KEY=VALUE` texts, values in YAML (or JSON); raises BenchbotError."""
    found: dict[str, Any] = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator or not key:
            raise BenchbotError(
                f"--set {text} sets nothing.",
                "A setting is a key, an equals sign and a value.",
                f"Write it like this: --set {key or 'lighting.time'}=VALUE",
            )
        if key in found:
            raise BenchbotError(
                f"--set {key} is given twice.",
                f"Once as {found[key]!r}, and once as {value!r}.",
                "Keep one of them.",
            )
        try:
            found[key] = yaml.load(value, _Loader)  # noqa: S506
        except (yaml.YAMLError, ValueError, RecursionError) as error:
            why = getattr(error, "problem", None) or str(error)
            raise BenchbotError(
                f"The value of --set {key} cannot be read.",
                f"{value!r}: {why}.",
                "Write a value as YAML has it: 0.5, 21:30, all, [lamp_1, lamp_2].",
            ) from error
    return normal(found)


def normal(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as environments declare them: `lighting.time` may be given in hours, 8 or 21.5 or 8:00."""
    return {key: _clock(value) if key == "lighting.time" else value for key, value in settings.items()}


def check(settings: Mapping[str, Any]) -> None:
    """Raise BenchbotError for keys that no run may set, and for keys of which one is part of another."""
    for key in settings:
        top, *_ = key.split(".")
        if top in FIXED_KEYS:
            why, fix = FIXED_KEYS[top]
            raise BenchbotError(f"A run cannot set '{top}'.", why, fix)
        if top not in OPEN_KEYS or not all(key.split(".")):
            raise BenchbotError(
                f"'{key}' is not a setting.",
                f"A run may set what begins with: {', '.join(OPEN_KEYS)}.{did_you_mean(top, list(OPEN_KEYS))}",
                "Write it like this: --set lighting.time=21:30",
            )
    for one, other in combinations(sorted(settings), 2):
        if other.startswith(f"{one}."):
            raise BenchbotError(
                f"The settings '{one}' and '{other}' overlap.",
                f"'{one}' sets all of what '{other}' is a part of.",
                "Keep one of them.",
            )
    kinds = [{key.split(".")[1] for key in settings if key.startswith("lighting.")} & set(way) for way in _WAYS]
    if all(kinds):
        by_hand, by_time = (", ".join(f"lighting.{key}" for key in sorted(keys)) for keys in kinds)
        raise BenchbotError(
            "The settings declare daylight in two ways.",
            f"{by_hand} is given, and {by_time} says that sun and sky follow from the time of day.",
            "Keep one of the two.",
        )


def applied(scene: Declaration, settings: Mapping[str, Any]) -> Declaration:
    """Return an environment with its declaration overridden, and checked anew.

    A setting of one way to declare daylight takes the place of what is declared in the other: `lighting.time` that of
    `sun` and `sky`, and the other way round. Raises BenchbotError that names the setting and what is allowed.
    """
    if not settings:
        return scene
    check(settings)
    data = deepcopy(scene.data)
    _clear_other_daylight(data, settings)
    for key, value in settings.items():
        _put(data, key, value)
    wrong = schema.problems(data, "environment", scene.path)
    if wrong:
        raise BenchbotError(
            f"These settings do not fit the environment '{scene.name}'.",
            "\n".join(map(_told, wrong)),
            "Mend --set; the keys are explained in docs/lighting.md",
        )
    return replace(scene, data=data)


def _clock(value: Any) -> Any:
    """Return hours, or a time without its leading zero, as HH:MM; what is neither is left to the schema to refuse."""
    if isinstance(value, str):
        return f"0{value}" if re.fullmatch(r"[0-9]:[0-5][0-9]", value) else value
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < 24:
        return value
    minutes = round(value * 60)
    return value if minutes == 24 * 60 else f"{minutes // 60:02d}:{minutes % 60:02d}"


def label(settings: Mapping[str, Any]) -> str:
    """Return settings as they are written: `assets=sweethome3d, lighting.time=21:30`; nothing for none."""
    return ", ".join(f"{key}={_text(value)}" for key, value in sorted(settings.items()))


def _clear_other_daylight(data: dict[str, Any], settings: Mapping[str, Any]) -> None:
    lighting = data.get("lighting")
    if not isinstance(lighting, dict):
        return
    for way, other in (_WAYS, _WAYS[::-1]):
        if any(key.split(".")[:2] == ["lighting", name] for key in settings for name in way):
            for name in other:
                lighting.pop(name, None)


def _put(data: dict[str, Any], key: str, value: Any) -> None:
    *parents, last = key.split(".")
    place = data
    for i, name in enumerate(parents):
        place = place.setdefault(name, {})
        if not isinstance(place, dict):
            whole = ".".join(parents[: i + 1])
            raise BenchbotError(
                f"'{key}' cannot be set.",
                f"'{whole}' is {place!r}, which has no parts.",
                f"Set it as a whole: --set {whole}=VALUE",
            )
    place[last] = deepcopy(value)


def _told(problem: Problem) -> str:
    keys = problem.pointer.split("/")[1:]
    place = schema.schema("environment")
    for key in keys:
        place = place.get("properties", {}).get(key, {})
    meaning = place.get("description")
    return f"{'.'.join(keys)}: {problem.message}" + (f" ({meaning})" if meaning else "")


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
