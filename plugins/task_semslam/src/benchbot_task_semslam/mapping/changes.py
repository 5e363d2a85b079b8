"""Objects added and removed between two visits of an environment: the difference of two object maps."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchbot.plugin import FramePose, Observations
from benchbot_task_semslam.mapping.objects import NEAREST_M, MappedObject, describe, overlap
from benchbot_task_semslam.mapping.projection import Floats, in_frame

SAME_OBJECT_IOU = 0.3
BEHIND_M = 0.03
SEEN_THROUGH = 0.5
VIEW_STRIDE = 4

Change = tuple[MappedObject, str]


class Views:
    """The camera's views during a visit: coarse depth images and poses."""

    def __init__(self) -> None:
        self._views: list[tuple[Floats, Floats, FramePose]] = []

    def add(self, observations: Observations) -> None:
        """Keep a frame: `image_depth`, `image_depth_info` and the pose of `camera`."""
        matrix = np.asarray(observations["image_depth_info"]["matrix_intrinsics"], np.float32)
        depth_m = observations["image_depth"][::VIEW_STRIDE, ::VIEW_STRIDE].copy()
        self._views.append((depth_m, matrix, observations["poses"]["camera"]))

    def seen_empty(self, item: MappedObject) -> bool:
        """Return whether some frame shows free space throughout the object's box, so that the object was not there."""
        return any(_looked_through(item, *view) for view in self._views)


def changes(before: Sequence[MappedObject], after: Sequence[MappedObject]) -> list[Change]:
    """Return the objects of each map that have no counterpart in the other: "removed" ones, then "added" ones.

    Counterparts are of one class, overlap by more than `SAME_OBJECT_IOU`, and are assigned one to one.
    """
    # Most solutions that import this module compare no maps, and scipy takes as long to import as all else.
    from scipy.optimize import linear_sum_assignment

    overlaps = np.array([[_alike(one, other) for other in after] for one in before]).reshape(len(before), len(after))
    rows, columns = linear_sum_assignment(overlaps, maximize=True)
    found = overlaps[rows, columns] > SAME_OBJECT_IOU
    kept, again = set(rows[found].tolist()), set(columns[found].tolist())
    removed = [(item, "removed") for i, item in enumerate(before) if i not in kept]
    return removed + [(item, "added") for i, item in enumerate(after) if i not in again]


def confirmed(found: Sequence[Change], before: Views, after: Views) -> list[Change]:
    """Return the changes that both visits bear out: what one visit never looked at may well be unchanged.

    A removed object's place was seen empty in the second visit, an added one's in the first.
    """
    return [(item, state) for item, state in found if (after if state == "removed" else before).seen_empty(item)]


def describe_changes(found: Sequence[Change], results: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return changes as the format `object_map_with_states` has objects; `results` is what its `create` returned."""
    states: list[str] = results["state_list"]
    return [
        {**describe(item, results["class_list"]), "state_probs": [float(name == state) for name in states]}
        for item, state in found
    ]


def _alike(one: MappedObject, other: MappedObject) -> float:
    return overlap(one, other) if one.label == other.label else 0.0


def _looked_through(item: MappedObject, depth_m: Floats, matrix: Floats, camera: FramePose) -> bool:
    """Return whether most rays into the box leave it again before they meet a surface."""
    steps = np.linspace(0.1, 0.9, 5, dtype=np.float32)
    inside = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
    targets = item.lower + inside * (item.upper - item.lower)
    points = in_frame(targets, camera)
    ahead = points[:, 2] > NEAREST_M
    targets, points = targets[ahead], points[ahead]
    pixels = points @ matrix.T
    u, v = np.rint(pixels[:, :2] / pixels[:, 2:] / VIEW_STRIDE).astype(np.int64).T
    height, width = depth_m.shape
    shown = (u >= 0) & (u < width) & (v >= 0) & (v < height)

    # Along a ray through the camera, depth and distance grow alike: the exit is at a multiple of the target's depth.
    origin = np.asarray(camera["translation_xyz"], np.float32)
    along = targets[shown] - origin
    with np.errstate(divide="ignore", invalid="ignore"):
        exits = np.fmax((item.lower - origin) / along, (item.upper - origin) / along).min(axis=1)
    through = depth_m[v[shown], u[shown]] > points[shown, 2] * exits + BEHIND_M
    return bool(np.count_nonzero(through) >= SEEN_THROUGH * len(inside))
