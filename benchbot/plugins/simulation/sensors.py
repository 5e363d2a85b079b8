"""The camera of a simulated robot, from its declaration, and the channels of its pictures."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, CameraModel, Segmentation
from benchbot.plugins.simulation.camera_noise import CameraNoise, Response
from benchbot.plugins.simulation.declared import check_keys, limits_m, optional
from benchbot.plugins.simulation.depth_noise import DepthNoise, View, read_depth_noise
from benchbot.plugins.simulation.distortion import PLUMB_BOB, Distortion

INSTANCES_PER_CLASS = 1000
UNSEEN = np.uint16(1)  # in place of a number, which is 1001 or more, of an object that will have one once it is seen


@dataclass(frozen=True)
class Frame:
    """All channels of one exposure, taken from the same primary hit per pixel.

    `rgb` (H, W, 3) uint8 sRGB; `depth_m` (H, W) float32 planar Z in metres (REP-118), +inf where nothing was hit;
    `instance` (H, W) int32, an `Instance.index` or 0 where nothing was hit.
    """

    rgb: npt.NDArray[np.uint8]
    depth_m: npt.NDArray[np.float32]
    instance: npt.NDArray[np.int32]

    def row(self, index: int) -> "Frame":
        """Return one of many exposures, where the arrays have a first axis of them."""
        return Frame(self.rgb[index], self.depth_m[index], self.instance[index])


class Instance(Protocol):
    """One object of a scene; `index` (1 or more) is its id in pictures, `class_name` None where it has no label."""

    @property
    def index(self) -> int:
        """Number of the object in `Frame.instance`."""
        ...

    @property
    def class_name(self) -> str | None:
        """Label, one of the environment's `object_labels` or another."""
        ...


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in an optical frame (x right, y down, z forward; REP-103).

    `fx`, `fy`, `cx`, `cy` are in pixels, with pixel centres at integers, as ROS (sensor_msgs/CameraInfo) and OpenCV
    have it: the ray of pixel (u, v) is ((u - cx) / fx, (v - cy) / fy, 1), unless there is a `distortion`, which bends
    all channels alike. Depth stays planar.
    """

    frame: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    range_m: tuple[float, float]
    distortion: Distortion | None = None
    rgb_noise: CameraNoise | None = None
    depth_noise: DepthNoise | None = None

    def __post_init__(self) -> None:
        if not (self.width > 0 and self.height > 0 and self.fx > 0 and self.fy > 0):
            raise ValueError(f"{self} sees nothing")
        if self.distortion:
            left, right = ((edge - self.cx) / self.fx for edge in (-0.5, self.width - 0.5))
            top, bottom = ((edge - self.cy) / self.fy for edge in (-0.5, self.height - 0.5))
            self.distortion.check(left, top, right, bottom, min(1 / self.fx, 1 / self.fy))

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a robot's `camera` mapping; raises KeyError, TypeError or ValueError when it is not one."""
        check_keys("camera", values, cls)
        return cls(
            frame=str(values["frame"]),
            width=int(values["width"]),
            height=int(values["height"]),
            fx=float(values["fx"]),
            fy=float(values["fy"]),
            cx=float(values["cx"]),
            cy=float(values["cy"]),
            range_m=limits_m(values["range_m"]),
            distortion=optional(values, "distortion", Distortion.from_mapping),
            rgb_noise=optional(values, "rgb_noise", CameraNoise.from_mapping),
            depth_noise=optional(values, "depth_noise", read_depth_noise),
        )

    def info(self) -> CameraModel:
        """Return the camera's model, as the channels `*_info` have it."""
        matrix = np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])
        info: CameraModel = {
            "frame_id": self.frame,
            "height": self.height,
            "width": self.width,
            "matrix_intrinsics": matrix,
            "matrix_projection": np.hstack([matrix, np.zeros((3, 1))]),
        }
        if self.distortion:
            info["distortion_model"] = PLUMB_BOB
            info["distortion_coefficients"] = self.distortion.coefficients()
        return info

    @cached_property
    def view(self) -> View:
        """The rays of the pixels."""
        x, y = np.meshgrid((np.arange(self.width) - self.cx) / self.fx, (np.arange(self.height) - self.cy) / self.fy)
        if self.distortion:
            x, y = self.distortion.undistort(x, y)
        return View(x, y, self.fx)

    def rgb(self, frame: Frame, random: Callable[[], np.random.Generator], response: Response) -> npt.NDArray[np.uint8]:
        """Return colours (H, W, 3), with noise from what `random` makes."""
        return self.rgb_noise.apply(frame.rgb, random(), response) if self.rgb_noise else frame.rgb

    def depth(self, frame: Frame, random: Callable[[], np.random.Generator]) -> npt.NDArray[np.float32]:
        """Return planar depth (H, W) in metres, with noise from what `random` makes.

        NaN is invalid, +inf beyond the camera's range, -inf before it (REP-117).
        """
        nearest_m, farthest_m = self.range_m
        sensed_m = frame.depth_m
        if self.depth_noise:
            exact_m = sensed_m.astype(np.float64)
            sensed_m = self.depth_noise.apply(exact_m, self.view, random()).astype(np.float32)
        depth_m = sensed_m.copy()
        np.copyto(depth_m, np.float32(np.inf), where=sensed_m > farthest_m)
        np.copyto(depth_m, np.float32(-np.inf), where=sensed_m < nearest_m)
        return depth_m


@dataclass(frozen=True)
class Labels:
    """The classes of a scene's objects: numbers by `Instance.index`, 0 is unlabelled, and the number of each label."""

    classes: npt.NDArray[np.uint8]
    class_ids: dict[str, int]

    @classmethod
    def of(cls, instances: Sequence[Instance], object_labels: Sequence[str]) -> Self:
        """Number the classes: place in `object_labels` + 1, whether or not the scene has objects of it.

        An object whose class is not among the labels stays 0. Raises BenchbotError when the numbers of objects (see
        `Sightings`) would not fit.
        """
        ids = {name: number for number, name in enumerate(object_labels, 1)}
        classes = np.zeros(max((instance.index for instance in instances), default=0) + 1, np.uint8)
        counts = Counter(instance.class_name for instance in instances if instance.class_name in ids)
        for name, count in counts.items():
            number = ids[str(name)] * INSTANCES_PER_CLASS + count
            if count >= INSTANCES_PER_CLASS or number > np.iinfo(np.uint16).max:
                raise BenchbotError(
                    f"There are too many objects or classes to number '{name}' ({number}).",
                    "An instance is numbered class * 1000 + number in 16 bits: 64 classes of 999 objects each.",
                    "Shorten the environment's object_labels, or split it into several environments.",
                )
        for instance in instances:
            classes[instance.index] = ids.get(instance.class_name or "", 0)
        return cls(classes, ids)


class Sightings:
    """The numbers of the objects that a robot has seen since its scene was loaded: class * 1000 + number in the class.

    Objects are numbered in the order in which they are first seen, in one picture row by row: a number tells nothing
    of objects that have not been seen, such as how many there are.
    """

    def __init__(self, labels: Labels) -> None:
        self.labels = labels
        self.numbers = np.zeros(len(labels.classes), np.uint16)
        self._counts: Counter[int] = Counter()

    def number(self, indices: Iterable[int]) -> None:
        """Number objects with a class, by `Instance.index` in the order in which they are seen for the first time."""
        for index in indices:
            label = int(self.labels.classes[index])
            self._counts[label] += 1
            self.numbers[index] = label * INSTANCES_PER_CLASS + self._counts[label]

    def segment(self, frame: Frame) -> Segmentation:
        """Return the segmentation of one picture."""
        indices = frame.instance.astype(np.intp)  # numpy's own: other integers are looked up three times as slowly
        known = np.where((self.numbers == 0) & (self.labels.classes > 0), UNSEEN, self.numbers)
        numbers = known.take(indices)
        new = numbers == UNSEEN
        if new.any():
            self.number(dict.fromkeys(indices[new].tolist()))
            numbers = self.numbers.take(indices)
        return {
            "class_segment_img": (numbers // INSTANCES_PER_CLASS).astype(np.uint8),
            "instance_segment_img": numbers,
            "class_ids": dict(self.labels.class_ids),
        }
