"""A map of objects: fuses depth, segmentation and camera poses into boxes.

Every pixel of an object is a point on its surface. Back-projected into the map frame, the points of one object from all
viewpoints span its box.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchbot.plugin import BenchbotError, FailureClass, Observations
from benchbot.plugins.formats.object_map import BACKGROUND, ObjectEntry, create_object
from benchbot.plugins.mapping.projection import (
    FARTHEST_M,
    NEAREST_M,
    Floats,
    depth_view,
    in_map_frame,
    needed,
    pixel_rays,
)

FEWEST_POINTS = 10


@dataclass(frozen=True)
class MappedObject:
    """An object: how likely it is of which class, and the axis-aligned box around its points, map frame, metres.

    `label_probs` names classes, those that it leaves out have 0. `lower` and `upper` are opposite corners, (3,).
    `points` is the number of surface points in it, its weight when it is fused with others.
    """

    label_probs: Mapping[str, float]
    lower: NDArray[np.floating]
    upper: NDArray[np.floating]
    points: int = 1

    @classmethod
    def around(cls, points: ArrayLike, label_probs: Mapping[str, float]) -> "MappedObject":
        """Return the object whose box just holds points (N, 3), metres; raises BenchbotError when there are none."""
        given = np.asarray(points, np.float32).reshape(-1, 3)
        if not len(given):
            raise BenchbotError(
                "An object has no points.",
                "A box around nothing has neither place nor size: no pixel of the mask has a valid depth.",
                "Leave out masks with few points: if len(points) >= 10",
                failure=FailureClass.AGENT,
            )
        return cls(label_probs, given.min(axis=0), given.max(axis=0), len(given))

    @property
    def label(self) -> str:
        """The most likely class, the first by name of several; the background where none is named."""
        return min(self.label_probs, key=lambda name: (-self.label_probs[name], name), default=BACKGROUND)

    @property
    def score(self) -> float:
        """The highest probability of a class other than the background."""
        return max((value for name, value in self.label_probs.items() if name != BACKGROUND), default=0.0)


class ObjectMap:
    """The objects of one scene by instance number, filled frame by frame, in any order."""

    def __init__(self) -> None:
        self._objects: dict[int, MappedObject] = {}

    @property
    def objects(self) -> list[MappedObject]:
        """The objects that were seen well enough, in the order of their numbers."""
        found = (self._objects[number] for number in sorted(self._objects))
        return [item for item in found if item.points >= FEWEST_POINTS]

    def add(self, observations: Observations) -> None:
        """Fuse a frame: `image_depth`, `image_depth_info`, `image_segment` and the pose of `camera`."""
        depth_m, info, pose = depth_view(observations)
        needed(observations, "image_segment")
        segments = observations["image_segment"]
        instances = segments["instance_segment_img"]
        pixels = np.flatnonzero(on_surfaces(depth_m, instances))
        if not len(pixels):
            return
        numbers = instances.ravel()[pixels]
        order = np.argsort(numbers, kind="stable")
        pixels, numbers = pixels[order], numbers[order]
        starts = np.flatnonzero(np.diff(numbers.astype(np.int32), prepend=-1))

        points = in_map_frame(pixel_rays(info)[pixels] * depth_m.reshape(-1, 1)[pixels], pose)
        lower, upper = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
        counts = np.diff(starts, append=len(numbers))

        labels = {number: name for name, number in segments["class_ids"].items()}
        classes = segments["class_segment_img"].ravel()[pixels[starts]]
        for i, number in enumerate(numbers[starts].tolist()):
            seen = MappedObject({labels[int(classes[i])]: 1.0}, lower[i], upper[i], int(counts[i]))
            known = self._objects.get(number)
            self._objects[number] = seen if known is None else merged([known, seen])


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


def merged(objects: Sequence[MappedObject]) -> MappedObject:
    """Return one object for several views of it: the box around all boxes, and the mean of the class probabilities.

    The mean is weighted by points. A product would take views for independent, and be far too sure: so a mistake that
    a detector makes from everywhere would cost most.
    """
    if len(objects) == 1:
        return objects[0]
    points = sum(item.points for item in objects)
    names = sorted({name for item in objects for name in item.label_probs})
    # Exact sums, so that the order of the objects changes no bit.
    label_probs = {
        name: math.fsum(item.label_probs.get(name, 0.0) * item.points for item in objects) / points for name in names
    }
    lower, upper = (np.stack([getattr(item, corner) for item in objects]) for corner in ("lower", "upper"))
    return MappedObject(label_probs, lower.min(axis=0), upper.max(axis=0), points)


def describe(item: MappedObject, class_list: Sequence[str]) -> ObjectEntry:
    """Return an object as the format `object_map` has it, to a tenth of a millimetre."""
    lower, upper = np.asarray(item.lower), np.asarray(item.upper)
    return create_object(
        class_list=class_list,
        label_probs=item.label_probs,
        centroid=[round(value, 4) for value in ((lower + upper) / 2).tolist()],
        extent=[round(value, 4) for value in (upper - lower).tolist()],
    )
