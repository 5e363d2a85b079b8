"""A map of objects: fuses depth, segmentation and camera poses into boxes.

Every pixel of an object is a point on its surface. Back-projected into the map frame, the points of one object from all
viewpoints span its box.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import CameraModel, Observations
from benchbot_task_semslam.mapping.projection import Floats, in_map_frame, pixel_rays

NEAREST_M, FARTHEST_M = 0.05, 12.0
FEWEST_POINTS = 10


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

    def add(self, observations: Observations) -> None:
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

    def _pixel_rays(self, info: CameraModel) -> Floats:
        camera = np.asarray(info["matrix_intrinsics"], np.float64).tobytes()
        if self._rays is None or self._rays[0] != camera:
            self._rays = camera, pixel_rays(info)
        return self._rays[1]


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
