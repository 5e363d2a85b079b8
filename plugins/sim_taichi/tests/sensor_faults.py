"""Faults of sensors, put into what a correct simulator has observed: what a simulator may get wrong, one at a time."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from benchbot.plugins.authoring.comparability.senses import Sight

Sights = Sequence[Sight]
Fault = Callable[[Sights], list[Sight]]
PICTURES = ("image_rgb", "image_depth", "image_segment")


def on(channel: str, change: Callable[[Any], Any]) -> Fault:
    """A fault of one channel; `change` gets its value."""
    return lambda sights: [_with(sight, channel, change(sight.observations[channel])) for sight in sights]


def on_pictures(change: Callable[[Any], Any], channels: Sequence[str] = PICTURES) -> Fault:
    """A fault of where pixels are; `change` gets an array (H, W, …)."""

    def fault(sights: Sights) -> list[Sight]:
        for channel in channels:
            sights = on(channel, _whole(change) if channel == "image_segment" else change)(sights)
        return list(sights)

    return fault


def on_labels(change: Callable[[Any, Any], tuple[Any, Any]]) -> Fault:
    """A fault of segmentation; `change` gets classes and instances."""

    def changed(value: Any) -> Any:
        classes, instances = change(value["class_segment_img"], value["instance_segment_img"])
        return _segments(value, classes.astype(np.uint8), instances.astype(np.uint16))

    return on("image_segment", changed)


def on_ranges(change: Callable[[Any, Any], Any]) -> Fault:
    """A fault of the laser; `change` gets ranges and angles, and returns ranges."""

    def changed(value: Any) -> Any:
        ranges_m, angles_rad = value["scans"].T
        return {**value, "scans": np.stack([change(ranges_m, angles_rad), angles_rad], 1)}

    return on("laser", changed)


def on_intrinsics(change: Callable[[Any], None]) -> Fault:
    """A fault of the camera's model; `change` writes into its matrix."""

    def changed(value: Any) -> Any:
        matrix = value["matrix_intrinsics"].copy()
        change(matrix)
        return {**value, "matrix_intrinsics": matrix}

    def fault(sights: Sights) -> list[Sight]:
        for channel in PICTURES:
            sights = on(f"{channel}_info", changed)(sights)
        return list(sights)

    return fault


def on_camera_pose(change: Callable[[Any], Any]) -> Fault:
    """A fault of the pose of the camera; `change` gets all poses, and returns that of the camera."""
    return on("poses", lambda poses: {**poses, "camera": {**poses["camera"], **change(poses)}})


def late(*channels: str) -> Fault:
    """Channels of the observation before."""

    def fault(sights: Sights) -> list[Sight]:
        now = [
            replace(
                after, observations={**after.observations, **{name: before.observations[name] for name in channels}}
            )
            for before, after in pairwise(sights)
        ]
        return [sights[0], *now]

    return fault


def frozen(*channels: str) -> Fault:
    """Channels of the first observation, for ever."""

    def fault(sights: Sights) -> list[Sight]:
        first = {name: sights[0].observations[name] for name in channels}
        return [replace(sight, observations={**sight.observations, **first}) for sight in sights]

    return fault


def renumbered(classes: Any, instances: Any, by: int) -> tuple[Any, Any]:
    """Instances with larger numbers."""
    return classes, np.where(instances > 0, instances + by, 0)


def numbered_anew(sights: Sights) -> list[Sight]:
    """Instances that have other numbers in every observation."""

    def fault() -> Iterator[Sight]:
        for turn, sight in enumerate(sights):
            yield from on_labels(partial(renumbered, by=7 * turn))([sight])

    return list(fault())


def euclidean(sights: Sights) -> list[Sight]:
    """Depths along the rays."""

    def lengths(sight: Sight) -> Any:
        k, depth_m = sight.observations["image_depth_info"]["matrix_intrinsics"], sight.observations["image_depth"]
        v, u = np.indices(depth_m.shape)
        return np.sqrt(((u - k[0, 2]) / k[0, 0]) ** 2 + ((v - k[1, 2]) / k[1, 1]) ** 2 + 1)

    return [
        _with(sight, "image_depth", (sight.observations["image_depth"] * lengths(sight)).astype(np.float32))
        for sight in sights
    ]


def permuted(classes: Any, instances: Any) -> tuple[Any, Any]:
    """Each class is called the next."""
    following = np.array([0, 2, 3, 4, 5, 6, 1])[classes]
    return following, np.where(classes > 0, following * 1000 + instances % 1000, 0)


def linear(rgb: Any) -> Any:
    """Light, not encoded as sRGB."""
    return (255 * (rgb / 255) ** 2.2).astype(np.uint8)


def encoded(rgb: Any) -> Any:
    """Encoded as sRGB once more."""
    return (255 * (rgb / 255) ** (1 / 2.2)).astype(np.uint8)


def _with(sight: Sight, channel: str, value: Any) -> Sight:
    return replace(sight, observations={**sight.observations, channel: value})


def _segments(value: Any, classes: Any, instances: Any) -> Any:
    return {**value, "class_segment_img": classes, "instance_segment_img": instances}


def _whole(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda value: _segments(value, change(value["class_segment_img"]), change(value["instance_segment_img"]))


def _scaled(matrix: Any) -> None:
    matrix[:2, :2] *= 1.1


def _from_the_corner(matrix: Any) -> None:
    matrix[:2, 2] += 0.5


def _swapped(matrix: Any) -> None:
    matrix[:2, 2] = matrix[1::-1, 2]


_half = np.float32(0.5)
MIRRORED = "is mirrored left to right"
FAULTS: dict[str, tuple[Fault, str, str]] = {
    # name: the fault, a channel that is broken, words of the fault
    "mirrored pictures": (on_pictures(lambda p: p[:, ::-1]), "image_depth", MIRRORED),
    "mirrored colours": (on_pictures(lambda p: p[:, ::-1], ["image_rgb"]), "image_rgb", MIRRORED),
    "upside down": (on_pictures(lambda p: p[::-1]), "image_depth", "is upside down"),
    "turned pictures": (on_pictures(lambda p: p[::-1, ::-1]), "image_depth", "turned by 180 degrees"),
    "shifted by 8 px": (on_pictures(lambda p: np.roll(p, 8, 1)), "image_depth", "shifted by 8 px to the right"),
    "shifted by 1 px": (on_pictures(lambda p: np.roll(p, 1, 0)), "image_segment", "shifted by 1 px to the bottom"),
    "shifted labels": (
        on_pictures(lambda p: np.roll(p, (2, -3), (0, 1)), ["image_segment"]),
        "image_segment",
        "3 px to the left and 2 px to the bottom",
    ),
    "shifted colours": (on_pictures(lambda p: np.roll(p, -2, 1), ["image_rgb"]), "image_rgb", "2 px to the left"),
    "Euclidean depth": (euclidean, "image_depth", "Euclidean"),
    "centimetres": (on("image_depth", lambda d: d * 100), "image_depth", "100 times"),
    "depth 2 % long": (on("image_depth", lambda d: d * np.float32(1.02)), "image_depth", "1.02 times"),
    "depth 10 cm long": (on("image_depth", lambda d: d + np.float32(0.1)), "image_depth", "+0.1 m more"),
    "disparity": (on("image_depth", lambda d: 1 / d), "image_depth", "disparity"),
    "depth buffer": (on("image_depth", lambda d: 1 - np.float32(0.1) / d), "image_depth", "Only 0% of depths"),
    "no depth": (on("image_depth", lambda d: d * np.float32(np.inf)), "image_depth", "no value is a finite number"),
    "depth with holes": (
        on("image_depth", lambda d: np.where(np.indices(d.shape).sum(0) % 5, d, np.float32(np.nan))),
        "image_depth",
        "Only 80% of depths",
    ),
    "BGR": (on("image_rgb", lambda c: c[..., ::-1]), "image_rgb", "in the order B, G, R"),
    "black": (on("image_rgb", lambda c: c * 0), "image_rgb", "is black"),
    "white": (on("image_rgb", lambda c: c * 0 + 255), "image_rgb", "is white"),
    "grey": (on("image_rgb", lambda c: c[..., [1, 1, 1]]), "image_rgb", "has no colours"),
    "negative": (on("image_rgb", lambda c: 255 - c), "image_rgb", "are inverted"),
    "linear light": (on("image_rgb", linear), "image_rgb: brightness", "linear light"),
    "encoded twice": (on("image_rgb", encoded), "image_rgb: brightness", "encoded twice"),
    "frozen picture": (frozen("image_rgb"), "image_rgb", "never changes"),
    "late pictures": (late(*PICTURES), "image_depth", "at the observation before"),
    "late colours": (late("image_rgb"), "image_rgb", "at the observation before"),
    "permuted classes": (on_labels(permuted), "image_segment: classes", "permuted: what is bed is labelled refr"),
    "one class": (
        on_labels(lambda c, i: (c > 0, np.where(c > 0, 1000 + i % 1000, 0))),
        "image_segment: classes",
        "what is chair is labelled bottle",
    ),
    "no bottle": (
        on_labels(lambda c, i: (np.where(c == 1, 0, c), np.where(c == 1, 0, i))),
        "image_segment: classes",
        "what is bottle is labelled nothing",
    ),
    "all labelled": (
        on_labels(lambda c, i: (np.maximum(c, 1), np.maximum(i, 1001))),
        "image_segment: classes",
        "what is nothing is labelled bottle",
    ),
    "no labels": (on_labels(lambda c, i: (c * 0, i * 0)), "image_segment", "Nothing is labelled"),
    "one number": (
        on_labels(lambda c, i: (c, np.where(c > 0, c * 1000.0 + 1, 0))),
        "image_segment: instances",
        "chair 1 and chair 2 have the same number 2001",
    ),
    "new numbers": (numbered_anew, "image_segment: instances", "has the numbers"),
    "mirrored laser": (on_ranges(lambda r, a: np.roll(r[::-1], 1)), "laser", MIRRORED),
    "laser turned back": (on_ranges(lambda r, a: np.roll(r, len(r) // 2)), "laser", "turned by 180 degrees"),
    "laser turned aside": (
        on_ranges(lambda r, a: np.roll(r, len(r) // 4)),
        "laser",
        "turned by -90 degrees about",
    ),
    "laser 5 % long": (on_ranges(lambda r, a: r * 1.05), "laser", "1.05 times"),
    "laser 10 cm long": (on_ranges(lambda r, a: r + 0.1), "laser", "+0.1 m more"),
    "laser's x": (on_ranges(lambda r, a: abs(r * np.cos(a))), "laser", "the distance along x"),
    "constant laser": (on_ranges(lambda r, a: r * 0 + 3), "laser", "All values are the same"),
    "late laser": (late("laser"), "laser", "at the observation before"),
    "mirrored lidar": (on("lidar", lambda v: {**v, "ranges_m": v["ranges_m"][:, ::-1]}), "lidar", MIRRORED),
    "lidar upside down": (on("lidar", lambda v: {**v, "ranges_m": v["ranges_m"][::-1]}), "lidar", "is upside down"),
    "focal length": (on_intrinsics(_scaled), "image_depth", "focal length of 0.9 times"),
    "principal point from the corner": (on_intrinsics(_from_the_corner), "image_depth", "shifted by half a pixel"),
    "cx for cy": (on_intrinsics(_swapped), "image_depth", "shifted by 14 px"),
    "camera too high": (
        on_camera_pose(lambda p: {"translation_xyz": p["camera"]["translation_xyz"] + (0, 0, 0.1)}),
        "image_depth",
        "senses from where the robot's declaration mounts it",
    ),
    "no optical frame": (on_camera_pose(lambda p: p["base_link"]), "poses", "camera by 1.06 m and 120 degrees"),
    "gravity downwards": (
        on("imu", lambda v: {**v, "linear_acceleration_mps2": -v["linear_acceleration_mps2"]}),
        "imu",
        "-9.81",
    ),
}
