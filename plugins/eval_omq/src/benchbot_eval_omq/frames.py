"""Whether a map fits better when its boxes are taken from the frame of the robot or of its camera to the map."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import BenchbotError, Catalog, GroundTruth, Pose, Result, load_plugins
from benchbot_eval_omq.boxes import Boxes
from benchbot_eval_omq.omq import evaluate
from benchbot_eval_omq.qualities import Array, Qualities

LEAST_GAIN = 0.1
GOOD_SCORE = 0.6
MOST_POSES = 200
FARTHEST_M = 1e6
"""The format refuses numbers beyond."""
_HALF_TURN = Pose.planar(0.0, 0.0, np.pi)


def in_another_frame(result: Result, ground_truths: Sequence[GroundTruth], table: Qualities) -> list[str]:
    """Return in a sentence from which frame to the map the boxes fit better; nothing where none is much better.

    Each box is taken by the pose of the robot that suits it best: who forgets the transform has each in the frame of
    another moment. Chance is allowed for: facing backwards at the same places must not gain half as much.
    """
    score = evaluate(result, ground_truths)["OMQ"]
    poses = _robot_poses(result)
    if score > GOOD_SCORE or not poses:
        return []
    found = []
    for name, mount in _mounts(result).items():
        moved, control = (
            evaluate(_moved(result, table, [base @ turn @ mount for base in poses]), ground_truths)["OMQ"]
            for turn in (Pose.planar(0.0, 0.0, 0.0), _HALF_TURN)
        )
        if moved - score >= max(LEAST_GAIN, 2 * (control - score)):
            found.append((moved, name))
    if not found:
        return []
    best, name = max(found)
    return [f"It fits better after {name} → map: {best:.2f}. Were the boxes left in the frame of the {name}?"]


def _moved(result: Result, table: Qualities, poses: Sequence[Pose]) -> Result:
    """Return the map with each box taken to the map by the pose that gives it the most overlap with its own class."""
    turns = np.array([pose.matrix() for pose in poses])[:, :3, :3]
    places = np.array([pose.translation_xyz for pose in poses], float)
    truths, own = Boxes.of(table.true_objects), table.labels.argmax(axis=1)
    objects = []
    for item, own_class in zip(table.estimates, own.tolist(), strict=True):
        centroids: Array = turns @ np.array(item["centroid"], float) + places
        extents: Array = np.abs(turns) @ np.array(item["extent"], float)
        boxes = Boxes(centroids - extents / 2, centroids + extents / 2)
        shared = truths.intersections(boxes)
        unions = np.add.outer(truths.volumes, boxes.volumes) - shared
        overlap: NDArray[np.float64] = np.divide(shared, unions, out=np.zeros_like(shared), where=unions > 0)
        best = int((overlap * (table.true_classes == own_class)[:, None]).max(axis=0).argmax())
        objects.append({**item, "centroid": _bounded(centroids[best]), "extent": _bounded(extents[best])})
    return cast(Result, {**result, "results": {**result["results"], "objects": objects}})


def _bounded(values: Array) -> list[float]:
    bounded: list[float] = np.clip(values, -FARTHEST_M, FARTHEST_M).tolist()
    return bounded


def _robot_poses(result: Result) -> list[Pose]:
    """Return where the robot observed, at most so many places."""
    rows = [row for track in result.get("track") or () for row in track["rows"] if row[0] is not None]
    return [Pose.planar(*row[2:5]) for row in rows[:: len(rows) // MOST_POSES + 1]]


def _mounts(result: Result) -> dict[str, Pose]:
    """Return the frames on the robot that a map may have been left in, by name; the camera's where it is known."""
    robot = ((result.get("provenance") or {}).get("selection") or {}).get("robot")
    declared = _robot(robot) if isinstance(robot, str) else {}
    frame = declared.get("frames", {}).get(declared.get("camera", {}).get("frame"))
    camera = {} if frame is None else {"camera": Pose.from_xyz_rpy_deg(frame["xyz"], frame.get("rpy_deg", (0, 0, 0)))}
    return {"robot": Pose.planar(0.0, 0.0, 0.0), **camera}


@lru_cache(maxsize=16)
def _robot(name: str) -> Mapping[str, Any]:
    try:
        return Catalog(load_plugins()).get("robots", name).data
    except BenchbotError:
        return {}
