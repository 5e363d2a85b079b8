"""Reading of the sensors in a robot's declaration, with errors that name the key."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeVar

from benchbot.plugin import Pose, did_you_mean

_Read = TypeVar("_Read")


def mount(values: Mapping[str, Any]) -> Pose:
    """Return the pose of a frame in the robot's frame from `{xyz: metres, rpy_deg: static roll, pitch, yaw}`."""
    return Pose.from_xyz_rpy_deg(values["xyz"], values.get("rpy_deg", (0.0, 0.0, 0.0)))


def limits_m(values: Sequence[float]) -> tuple[float, float]:
    """Read the nearest and the farthest distance that a sensor measures; raises ValueError when nothing is between."""
    nearest_m, farthest_m = (float(value) for value in values)
    if not 0 <= nearest_m < farthest_m:
        raise ValueError(f"the range [{nearest_m}, {farthest_m}] is empty")
    return nearest_m, farthest_m


def optional(values: Mapping[str, Any], key: str, read: Callable[[Mapping[str, Any]], _Read]) -> _Read | None:
    """Read the mapping under `key`, if there is one; raises TypeError or ValueError that names the key."""
    if key not in values:
        return None
    if not isinstance(values[key], Mapping):
        raise TypeError(f"{key} is {values[key]!r}, not a mapping")
    try:
        return read(values[key])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{key}: {error}") from error


def check_keys(sensor: str, values: Mapping[str, Any], kind: type) -> None:
    """Raise ValueError for a key that is no field of the dataclass `kind`."""
    known = [field.name for field in fields(kind)]
    for key in values:
        if key not in known:
            raise ValueError(f"{sensor} has no '{key}', only {', '.join(known)}.{did_you_mean(str(key), known)}")
