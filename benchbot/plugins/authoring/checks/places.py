"""What an environment says of its place: the files that it names, and its poses."""

import math
from collections.abc import Iterator

from benchbot.core.declarations.problems import pointer
from benchbot.core.findings import Problem
from benchbot.plugins.authoring.checks.documents import Document

FILES = ("map_path", "occupancy_map")
# Quaternions are normalised when they are read, and those of v2 are rounded; positions in their place are far off.
_NORM_TOLERANCE = 0.5


def problems_of_place(document: Document) -> Iterator[Problem]:
    """Yield what is wrong with an environment whose schema finds nothing wrong."""
    for key in FILES:
        name = document.data.get(key)
        if name is None or (document.path.parent / name).is_file():
            continue
        # Other simulators name scenes in a store of their own, such as /Game/Maps/house or omniverse://….
        elsewhere = name.startswith("/") or "://" in name
        message = f"there is no file '{name}'; it is looked for beside this file"
        yield _problem(document, [key], message, warning=elsewhere)
    for keys, pose in _poses(document):
        norm = math.hypot(*pose[:4])
        if abs(norm - 1) > _NORM_TOLERANCE:
            message = (
                f"its first four numbers are no unit quaternion (norm {norm:.3g}). "
                "Write [qw, qx, qy, qz, x, y, z]; no rotation is 1, 0, 0, 0"
            )
            yield _problem(document, keys, message, warning=norm > 0)


def _poses(document: Document) -> Iterator[tuple[list[str | int], list[float]]]:
    yield ["start_pose"], document.data["start_pose"]
    for index, pose in enumerate(document.data.get("trajectory_poses") or ()):
        yield ["trajectory_poses", index], pose


def _problem(document: Document, keys: list[str | int], message: str, *, warning: bool) -> Problem:
    return Problem(document.path, document.positions.line(keys), pointer(keys), message, warning)
