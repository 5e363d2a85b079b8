"""Known faults of sensors, each as what undoes it: the fault that undone explains the most is the one there is.

A fault of a camera's geometry is undone by another camera model: what is mirrored fits a camera whose x axis points to
the left.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from benchbot.core.geometry import Pose
from benchbot.plugins.authoring.comparability.senses import Picture, Scan
from benchbot.plugins.authoring.comparability.world import Floats

Sense = TypeVar("Sense", Picture, Scan)

FURTHEST_SHIFT_PX = 16
FOCAL_SCALES = (0.5, 0.67, 0.8, 0.9, 0.95, 1.05, 1.1, 1.25, 1.5, 2.0)
ANGLES_DEG = (-90, -45, -10, -5, -2, 2, 5, 10, 45, 90, 180)
OFFSETS_M = (-0.5, -0.2, -0.1, -0.05, 0.05, 0.1, 0.2, 0.5)
OPTICAL_IN_BODY = Pose.from_xyz_rpy_deg((0, 0, 0), (-90, 0, -90)).matrix()


@dataclass(frozen=True)
class Fault:
    """A fault in words, how to mend it, and the function that undoes it in all that one sense has observed."""

    words: str
    fix: str
    undo: Callable[[Sequence[Any]], list[Any]]


def _each(words: str, fix: str, undo: Callable[[Any], Any]) -> Fault:
    return Fault(words, fix, lambda seen: [undo(one) for one in seen])


def camera_faults() -> Iterator[Fault]:
    """Yield the faults of where pixels are: of pictures, and of the model of their camera."""
    row, rows = "Column 0 is on the left, row 0 on top: ", "as OpenCV and ROS have it."
    yield _each("the picture is mirrored left to right", f"{row}flip it, picture[:, ::-1].", _mirrored)
    yield _each("the picture is upside down", f"{row}flip it, picture[::-1]. OpenGL begins at the bottom.", _flipped)
    yield _each("the picture is turned by 180 degrees", f"{row}{rows}", lambda picture: _flipped(_mirrored(picture)))
    for half_x, half_y in ((0.5, 0.5), (-0.5, -0.5)):
        yield _each(
            "the picture is shifted by half a pixel",
            "The principal point counts from the centre of the first pixel, not from its corner: cx = (width - 1) / 2 "
            "in the middle.",
            partial(_shifted, right_px=half_x, down_px=half_y),
        )
    for scale in FOCAL_SCALES:
        yield _each(
            f"the picture fits a focal length of {scale:g} times that of its camera model",
            "Give in the …_info channel the model of the picture as it is: fx = width / 2 / tan(angle of view / 2).",
            partial(_zoomed, scale=scale),
        )
    yield _each(
        "the picture has no distortion, but its camera model has",
        "Leave distortion_model and distortion_coefficients out, or distort the picture.",
        lambda picture: replace(picture, distortion=None),
    )


def shift_faults(score: Callable[[Sequence[Picture]], float], seen: Sequence[Picture]) -> Iterator[Fault]:
    """Yield the fault of pictures that are shifted, by as many columns and rows as the score is best at."""

    def best(axis: str, given: dict[str, float]) -> int:
        tried = sorted(range(-FURTHEST_SHIFT_PX, FURTHEST_SHIFT_PX + 1), key=abs)
        return max(tried, key=lambda pixels: score([_shifted(one, **{**given, axis: pixels}) for one in seen]))

    right_px = best("right_px", {})
    down_px = best("down_px", {"right_px": right_px})
    right_px = best("right_px", {"down_px": down_px})
    if right_px or down_px:
        ways = [(right_px, "right" if right_px > 0 else "left"), (down_px, "bottom" if down_px > 0 else "top")]
        towards = " and ".join(f"{abs(pixels)} px to the {way}" for pixels, way in ways if pixels)
        yield _each(
            f"the picture is shifted by {towards}",
            "Give the picture of the model in its …_info channel: cx and cy are where the optical axis meets it.",
            partial(_shifted, right_px=right_px, down_px=down_px),
        )


def frame_faults(what: str, bases: Sequence[Floats], mounted: Sequence[Floats]) -> Iterator[Fault]:
    """Yield the faults of where a sensor is: `what` names it.

    `bases` are the poses (4, 4) of the robot's base, `mounted` those that the sensor has by the robot's declaration;
    none where that does not say.
    """
    told = f"Make the pose of the {what} in poses that of the instant and of the frame in which it senses."
    yield Fault(f"the {what} senses what was there at the observation before", told, _a_step_late)
    if mounted:
        yield Fault(
            f"the pose of the {what} in poses is not its own: it senses from where the robot's declaration mounts it",
            told,
            lambda seen: [replace(one, pose=pose) for one, pose in zip(seen, mounted, strict=True)],
        )
    yield _each(
        f"the pose of the {what} is that of a body frame (x ahead), not of its optical frame (z ahead)",
        "The optical frame has x to the right, y down, z ahead (REP-103).",
        partial(_posed, within=OPTICAL_IN_BODY),
    )
    yield Fault(
        f"the {what} senses from the base of the robot",
        f"Put the {what} where `frames` of the robot's declaration mounts it.",
        lambda seen: [replace(one, pose=_at(base, one.pose)) for one, base in zip(seen, bases, strict=True)],
    )
    for angle_deg in ANGLES_DEG:
        for axis, name in enumerate(("x", "y", "z")):
            turn = Pose.from_xyz_rpy_deg((0, 0, 0), [angle_deg if axis == i else 0 for i in range(3)]).matrix()
            yield _each(
                f"the {what} senses turned by {angle_deg:+d} degrees about its own {name} axis from its pose in poses",
                told,
                partial(_posed, within=turn),
            )
    for offset_m in OFFSETS_M:
        for axis, name in enumerate(("x", "y", "z")):
            move = Pose.from_xyz_rpy_deg([offset_m if axis == i else 0 for i in range(3)]).matrix()
            yield _each(
                f"the {what} senses from {offset_m:+g} m along {name} of the map frame off its pose in poses",
                told,
                partial(_posed, outside=move),
            )


def scene_faults() -> Iterator[Fault]:
    """Yield the faults of how a scene was loaded, which all senses share."""
    turns = {
        "the scene is mirrored in y of the map frame": np.diag([1.0, -1.0, 1.0, 1.0]),
        "the scene is mirrored in x of the map frame": np.diag([-1.0, 1.0, 1.0, 1.0]),
        "the scene is turned by 90 degrees about z": Pose.planar(0, 0, np.pi / 2).matrix(),
        "the scene is turned by -90 degrees about z": Pose.planar(0, 0, -np.pi / 2).matrix(),
        "the scene is turned by 180 degrees about z": Pose.planar(0, 0, np.pi).matrix(),
        "the scene lies on its side": Pose.from_xyz_rpy_deg((0, 0, 0), (90, 0, 0)).matrix(),
        "the scene lies on its other side": Pose.from_xyz_rpy_deg((0, 0, 0), (-90, 0, 0)).matrix(),
    }
    for words, turn in turns.items():
        yield _each(
            words,
            "glTF has y up and z towards the viewer: (x, y, z) of the file is (x, -z, y) of the map frame.",
            partial(_posed, outside=turn),
        )


def depth_faults() -> Iterator[Fault]:
    """Yield the faults of what a depth is."""
    yield _each(
        "depth is the length of the ray (Euclidean), not the distance along the optical axis (z)",
        "Divide it by the length of the pixel's ray ((u - cx) / fx, (v - cy) / fy, 1).",
        lambda picture: replace(picture, values=picture.values / np.linalg.norm(picture.rays(), axis=-1)),
    )
    yield _each(
        "depth is its own reciprocal (disparity)", "Give metres along the optical axis.",
        lambda picture: replace(picture, values=1 / np.where(picture.values > 0, picture.values, np.nan)),
    )  # fmt: skip


def of_first_layer(found: Iterable[Fault]) -> Iterator[Fault]:
    """Yield faults of depth for pictures (H, W, 2) of which depth is the first layer."""

    def undo(fault: Fault, seen: Sequence[Picture]) -> list[Picture]:
        depths = fault.undo([replace(one, values=one.values[..., 0]) for one in seen])
        layers = [np.stack([depth.values, one.values[..., 1]], -1) for depth, one in zip(depths, seen, strict=True)]
        return [replace(one, values=values) for one, values in zip(seen, layers, strict=True)]

    for fault in found:
        yield replace(fault, undo=partial(undo, fault))


def scan_faults() -> Iterator[Fault]:
    """Yield the faults of what beams measure, and where they point."""
    for words, axes in (
        ("is mirrored left to right", (1, -1, 1)),
        ("is mirrored front to back", (-1, 1, 1)),
        ("is turned by 180 degrees", (-1, -1, 1)),
        ("is upside down", (1, 1, -1)),
    ):
        yield _each(
            f"the scan {words}",
            "Angles are counter-clockwise from the scanner's +x, which is ahead; +pi/2 is on the left (REP-103).",
            partial(_reflected, axes=axes),
        )
    for axis, name in enumerate(("x", "y")):
        yield _each(
            f"a range is the distance along {name}, not that along the beam",
            "A range is the length of the beam, in metres.",
            partial(_along_beams, axis=axis),
        )


def length_faults(seen: Sequence[Sense], expected: Sequence[Floats], sense: str) -> Iterator[Fault]:
    """Yield the faults of lengths that are all too long by a factor, or by a constant, as they most likely are."""
    pairs = [np.stack([one.values.ravel(), true.ravel()]) for one, true in zip(seen, expected, strict=True)]
    measured, true_m = np.concatenate(pairs, axis=1)
    known = np.isfinite(measured) & np.isfinite(true_m) & (measured > 0)
    if not known.any():
        return
    ratios, rests_m = measured[known] / true_m[known], measured[known] - true_m[known]
    factor, more_m = np.median(ratios), np.median(rests_m)
    if np.median(np.abs(ratios - factor) * true_m[known]) < np.median(np.abs(rests_m - more_m)):
        yield _each(
            f"{sense} is {factor:.3g} times what it should be",
            "Give metres (REP-103).",
            lambda one: replace(one, values=one.values / factor),
        )
    else:
        yield _each(
            f"{sense} is {more_m:+.3g} m more than it should be",
            "Measure from the origin of the sensor's frame.",
            lambda one: replace(one, values=one.values - more_m),
        )


def color_faults() -> Iterator[Fault]:
    """Yield the faults of which byte is which colour."""
    orders = {
        "B, G, R": (2, 1, 0),
        "G, R, B": (1, 0, 2),
        "R, B, G": (0, 2, 1),
        "G, B, R": (2, 0, 1),
        "B, R, G": (1, 2, 0),
    }
    for words, order in orders.items():
        yield _each(
            f"the channels of image_rgb are in the order {words}, not R, G, B",
            "Put red first: picture[..., ::-1] of what OpenCV makes.",
            partial(_reordered, order=order),
        )
    yield _each(
        "the colours of image_rgb are inverted", "255 is bright, 0 is dark.",
        lambda picture: replace(picture, values=255 - picture.values),
    )  # fmt: skip


def _mirrored(picture: Picture) -> Picture:
    return replace(picture, fx=-picture.fx, cx=picture.size[0] - 1 - picture.cx)


def _flipped(picture: Picture) -> Picture:
    return replace(picture, fy=-picture.fy, cy=picture.size[1] - 1 - picture.cy)


def _shifted(picture: Picture, right_px: float = 0.0, down_px: float = 0.0) -> Picture:
    return replace(picture, cx=picture.cx + right_px, cy=picture.cy + down_px)


def _zoomed(picture: Picture, scale: float) -> Picture:
    return replace(picture, fx=picture.fx * scale, fy=picture.fy * scale)


def _reordered(picture: Picture, order: Sequence[int]) -> Picture:
    return replace(picture, values=picture.values[..., list(order)])


def _reflected(scan: Scan, axes: tuple[int, int, int]) -> Scan:
    return replace(scan, along=scan.along * axes)


def _along_beams(scan: Scan, axis: int) -> Scan:
    return replace(scan, values=scan.values / np.maximum(np.abs(scan.along[:, axis]), 1e-3))


def _posed(one: Sense, within: Floats | None = None, outside: Floats | None = None) -> Sense:
    pose = one.pose if within is None else one.pose @ within
    return replace(one, pose=pose if outside is None else outside @ pose)


def _a_step_late(seen: Sequence[Any]) -> list[Any]:
    return [seen[0], *(replace(one, pose=before.pose) for before, one in pairwise(seen))]


def _at(base: Floats, pose: Floats) -> Floats:
    """Return a pose above the base, as high and turned as it was."""
    moved = pose.copy()
    moved[:2, 3] = base[:2, 3]
    return moved
