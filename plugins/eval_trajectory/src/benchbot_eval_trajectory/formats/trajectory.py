"""The format `trajectory`: a solution's estimate of where the robot was at each of its observations."""

import math
from collections.abc import Iterator
from typing import Any

from benchbot.plugin import instance_checks as checks

NORM_TOLERANCE = 1e-3


def create() -> dict[str, Any]:
    """Return an estimate without poses."""
    return {"poses": []}


def create_pose(observation: int = 0) -> dict[str, Any]:
    """Return the pose of the `observation`-th observation, counted from 0, at the origin.

    `translation_xyz` is in metres, `rotation_xyzw` a unit quaternion: the robot's base in one frame of your choice.
    """
    return {"observation": observation, "translation_xyz": [0.0, 0.0, 0.0], "rotation_xyzw": [0.0, 0.0, 0.0, 1.0]}


def validate(instance: Any) -> None:
    """Raise BenchbotError that names each place of `instance` that breaks the format."""
    checks.raise_any(problems(instance), "trajectory")


def problems(instance: Any) -> Iterator[str]:
    """Yield one line for each thing wrong with a trajectory."""
    wrong = list(checks.mapping(instance, ("poses",), "results"))
    if wrong:
        yield from wrong
        return
    seen: set[int] = set()

    def of_pose(pose: dict[str, Any], where: str) -> Iterator[str]:
        number = pose.get("observation")
        if isinstance(number, bool) or not isinstance(number, int) or number < 0:
            yield f"{where}.observation: must be a whole number from 0"
        elif number in seen:
            yield f"{where}.observation: {number} has a pose already"
        else:
            seen.add(number)
        reach = checks.LENGTH_LIMIT_M
        yield from checks.numbers(pose.get("translation_xyz"), f"{where}.translation_xyz", 3, "must be", -reach, reach)
        quaternion = pose.get("rotation_xyzw")
        flaws = list(checks.numbers(quaternion, f"{where}.rotation_xyzw", 4, "must be", -2, 2))
        yield from flaws
        if not flaws and quaternion is not None and abs(math.hypot(*quaternion) - 1) > NORM_TOLERANCE:
            yield f"{where}.rotation_xyzw: has the length {math.hypot(*quaternion):.4g}, a unit quaternion has 1"

    yield from checks.each(instance["poses"], "results.poses", of_pose)
