"""What a map of a run shows beside the robot: the floor of its environment, the way through it, and objects."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.geometry import Pose
from benchbot.core.platform import Scene
from benchbot.evaluation.ground_truths import environment_of
from benchbot.plugins.drawing.camera import Box
from benchbot.plugins.drawing.objects import proposed, stated
from benchbot.plugins.drawing.occupancy import Occupancy, occupancy_of

__all__ = ["MapBox", "Occupancy", "Place", "boxes_of", "place_of", "truth_of"]


@dataclass(frozen=True)
class Place:
    """One scene from above, metres and radians in the map frame."""

    environment: str
    """`NAME:VARIANT`."""
    occupancy: Occupancy | None
    trajectory_xy: tuple[tuple[float, float], ...]
    start_xyyaw: tuple[float, float, float] | None


@dataclass(frozen=True)
class MapBox:
    """An object: its class and its axis-aligned box."""

    label: str
    box: Box


def place_of(catalog: Catalog, environment: str) -> Place:
    """Return the place of an environment, `NAME:VARIANT`; raises BenchbotError for one that is not installed."""
    declaration = catalog.get("environments", environment)
    scene = Scene(declaration.data, declaration.path.parent)
    start = _xyyaw(scene.start_pose) if "start_pose" in declaration.data else None
    trajectory = tuple((x, y) for x, y, _ in map(_xyyaw, scene.trajectory))
    return Place(environment, occupancy_of(declaration), trajectory, start)


def truth_of(catalog: Catalog, environment: str) -> tuple[MapBox, ...]:
    """Return the true objects of an environment, for its host only; none where no map of them is installed."""
    from benchbot.core.declarations import schema

    for path in catalog.ground_truth_files:
        document = schema.read(path)
        if environment_of(document["environment"]) == environment:
            boxes = _boxes(stated(document.get("ground_truth")))
            if boxes:
                return boxes
    return ()


def boxes_of(result: Mapping[str, Any]) -> tuple[MapBox, ...]:
    """Return the objects that a result document proposes, by their likeliest classes; none where it has no such."""
    try:
        return _boxes(proposed(result.get("results")))
    except (TypeError, ValueError):  # a solution may save anything
        return ()


def _boxes(labelled: list[tuple[str, Box | None]]) -> tuple[MapBox, ...]:
    return tuple(MapBox(label, box) for label, box in labelled if box is not None)


def _xyyaw(pose: Pose) -> tuple[float, float, float]:
    x, y, _ = pose.translation_xyz
    return x, y, pose.yaw_rad
