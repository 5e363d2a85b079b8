"""A semantic mapper: fuses depth, perfect segmentation and camera poses into boxes around objects.

Every pixel of an object is a point on its surface. Back-projected into the map frame, the points of one object from all
viewpoints span its box. It solves semantic SLAM, and scene change detection by comparing the maps of two scenes; it
follows the trajectory of a passive task and looks once around in an active one.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.api import ActionResult, Agent, BenchBot

Floats = NDArray[np.float32]

NEAREST_M, FARTHEST_M = 0.05, 12.0
FEWEST_POINTS = 10
SAME_OBJECT_IOU = 0.3
LOOK_AROUND = 8


@dataclass
class MappedObject:
    """One object: its class, and the box around all of its points so far in the map frame, metres."""

    label: str
    lower: Floats
    upper: Floats
    points: int


class ObjectMap:
    """The objects of one scene by instance number, filled frame by frame."""

    def __init__(self) -> None:
        self._objects: dict[int, MappedObject] = {}
        self._rays: tuple[bytes, Floats] | None = None

    @property
    def objects(self) -> list[MappedObject]:
        """The objects that were seen well enough, in the order of their numbers."""
        found = (self._objects[number] for number in sorted(self._objects))
        return [item for item in found if item.points >= FEWEST_POINTS]

    def add(self, observations: Mapping[str, Any]) -> None:
        """Fuse a frame: `image_depth`, `image_depth_info`, `image_segment` and the pose of `camera`."""
        depth_m, segments = observations["image_depth"], observations["image_segment"]
        instances = segments["instance_segment_img"]
        pixels = np.flatnonzero(on_surfaces(depth_m, instances))
        if not len(pixels):
            return
        numbers = instances.ravel()[pixels]
        order = np.argsort(numbers, kind="stable")
        pixels, numbers = pixels[order], numbers[order]
        starts = np.flatnonzero(np.diff(numbers.astype(np.int32), prepend=-1))

        rays = self._pixel_rays(observations["image_depth_info"])
        points = in_map_frame(rays[pixels] * depth_m.reshape(-1, 1)[pixels], observations["poses"]["camera"])
        lower, upper = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
        counts = np.diff(starts, append=len(numbers))

        labels = {number: name for name, number in segments["class_ids"].items()}
        classes = segments["class_segment_img"].ravel()[pixels[starts]]
        for i, number in enumerate(numbers[starts].tolist()):
            known = self._objects.get(number)
            if known is None:
                label = labels[int(classes[i])]
                self._objects[number] = MappedObject(label, lower[i], upper[i], int(counts[i]))
            else:
                known.lower = np.minimum(known.lower, lower[i])
                known.upper = np.maximum(known.upper, upper[i])
                known.points += int(counts[i])

    def _pixel_rays(self, info: Mapping[str, Any]) -> Floats:
        """Return each pixel's ray, (H * W, 3) with z = 1, in the optical frame. Pixel centres are at integers."""
        matrix = np.asarray(info["matrix_intrinsics"], np.float64)
        if self._rays is None or self._rays[0] != matrix.tobytes():
            v, u = np.mgrid[0 : info["height"], 0 : info["width"]]
            rays = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3) @ np.linalg.inv(matrix).T
            self._rays = matrix.tobytes(), rays.astype(np.float32)
        return self._rays[1]


class SegmentationMapper(Agent):
    """Looks everywhere it is taken, and writes down what it saw."""

    def __init__(self) -> None:
        self._maps: dict[int, ObjectMap] = {}
        self._moves = 0

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the end of the trajectory, after a look around, or when the robot has hit something."""
        done = action_result is not ActionResult.SUCCESS or self._moves == LOOK_AROUND
        if done:
            self._moves = 0
        return done

    def pick_action(self, observations: dict[str, Any], action_list: Sequence[str]) -> tuple[str, dict[str, Any]]:
        """Map what is seen and go on."""
        self._maps.setdefault(observations["scene_number"], ObjectMap()).add(observations)
        if "move_next" in action_list:
            return "move_next", {}
        self._moves += 1
        return "move_angle", {"angle": 360 / LOOK_AROUND}

    def save_result(
        self,
        filename: str,
        empty_results: dict[str, Any],
        results_format_fns: Mapping[str, Callable[..., Any]],
    ) -> None:
        """Write the map of a scene, or what has changed from the first scene to the second."""
        results = empty_results["results"]
        scenes = [self._maps[number].objects for number in sorted(self._maps)]
        if "state_list" in results:
            states: list[str] = results["state_list"]
            for item, state in changes(*scenes) if len(scenes) == 2 else ():
                described = describe(item, results["class_list"])
                described["state_probs"] = [float(name == state) for name in states]
                results["objects"].append(described)
        else:
            results["objects"] = [describe(item, results["class_list"]) for scene in scenes for item in scene]
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


def on_surfaces(depth_m: Floats, instances: NDArray[np.uint16]) -> NDArray[np.bool_]:
    """Say which pixels show an object's surface: labelled, of valid depth, and continued by a neighbour.

    A pixel that blends two depths at an edge has no neighbour at nearly its own depth, and is left out.
    Shapes (H, W).
    """
    usable = (instances > 0) & (depth_m > NEAREST_M) & (depth_m < FARTHEST_M)
    continued = np.zeros_like(usable)
    depth_m = np.where(usable, depth_m, np.float32(0))
    for ahead, behind in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        alike = instances[ahead] == instances[behind]
        alike &= np.abs(depth_m[ahead] - depth_m[behind]) < 0.05 * depth_m[ahead]
        continued[ahead] |= alike
        continued[behind] |= alike
    return usable & continued


def in_map_frame(points: Floats, pose: Mapping[str, Any]) -> Floats:
    """Return points (N, 3) of a frame, given the frame's pose in the map frame."""
    rotation = rotation_matrix(pose["rotation_xyzw"]).astype(np.float32)
    return points @ rotation.T + np.asarray(pose["translation_xyz"], np.float32)


def rotation_matrix(xyzw: Sequence[float]) -> NDArray[np.float64]:
    """Return the rotation matrix (3, 3) of a unit quaternion (x, y, z, w)."""
    x, y, z, w = xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def changes(before: list[MappedObject], after: list[MappedObject]) -> list[tuple[MappedObject, str]]:
    """Return the objects of two maps that have no counterpart in the other, and what became of them."""

    def without_counterpart(items: list[MappedObject], others: list[MappedObject]) -> list[MappedObject]:
        return [
            item
            for item in items
            if not any(item.label == other.label and overlap(item, other) > SAME_OBJECT_IOU for other in others)
        ]

    removed = [(item, "removed") for item in without_counterpart(before, after)]
    return removed + [(item, "added") for item in without_counterpart(after, before)]


def overlap(one: MappedObject, other: MappedObject) -> float:
    """Return the intersection over union of two boxes."""
    sides = np.minimum(one.upper, other.upper) - np.maximum(one.lower, other.lower)
    shared = float(np.prod(np.maximum(sides, 0.0)))
    union = float(np.prod(one.upper - one.lower) + np.prod(other.upper - other.lower)) - shared
    return shared / union if union > 0 else 0.0


def describe(item: MappedObject, class_list: Sequence[str]) -> dict[str, Any]:
    """Return an object as the format `object_map` has it."""
    return {
        "label_probs": [float(name == item.label) for name in class_list],
        "centroid": [round(value, 4) for value in ((item.lower + item.upper) / 2).tolist()],
        "extent": [round(value, 4) for value in (item.upper - item.lower).tolist()],
    }


if __name__ == "__main__":
    BenchBot(agent=SegmentationMapper()).run()
