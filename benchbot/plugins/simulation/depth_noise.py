"""Two published models of depth cameras' errors. Angles, shadows and rows are those of an undistorted picture."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
DEFAULT_MAX_INCIDENCE_DEG = 82.0  # about as far as Nguyen, Izadi and Lovell could measure


@dataclass(frozen=True)
class View:
    """The rays of a camera's pixels: `x`, `y` (H, W) at unit depth, and the focal length in pixels."""

    x: FloatArray
    y: FloatArray
    focal_px: float


class DepthNoise(Protocol):
    """A model that turns exact planar depth (H, W; metres, +inf nothing) into the camera's measurement, NaN invalid."""

    def apply(self, depth_m: FloatArray, view: View, random: np.random.Generator) -> FloatArray:
        """Return depth with noise."""
        ...


@dataclass(frozen=True)
class Stereo:
    """Depth from matching with a second imager, `baseline_m` to the right (passive, or helped by a pattern).

    Disparity d = f b / Z gets normal noise of `disparity_sigma_px` and is rounded to `disparity_step_px`, so that
    depth's error grows with its square (Khoshelham and Elberink, "Accuracy and resolution of Kinect depth data for
    indoor mapping applications", 2012: σ_Z = Z² σ_d / (f b); the Kinect's step is 1/8 pixel). Invalid are
    what the second imager does not see, and surfaces seen at more than `max_incidence_deg` from their normal.
    """

    baseline_m: float
    disparity_sigma_px: float
    disparity_step_px: float = 0.125
    max_incidence_deg: float = DEFAULT_MAX_INCIDENCE_DEG

    def __post_init__(self) -> None:
        if not (0 < self.baseline_m < np.inf and 0 <= self.disparity_sigma_px < np.inf and self.disparity_step_px >= 0):
            raise ValueError(f"{self} needs baseline_m > 0, disparity_sigma_px >= 0 and disparity_step_px >= 0")
        _check_incidence(self.max_incidence_deg)

    def apply(self, depth_m: FloatArray, view: View, random: np.random.Generator) -> FloatArray:
        """Return depth with noise; what has no disparity left is +inf."""
        scale = view.focal_px * self.baseline_m
        disparity = scale / depth_m + self.disparity_sigma_px * random.standard_normal(depth_m.shape)
        if self.disparity_step_px > 0:
            disparity = np.round(disparity / self.disparity_step_px) * self.disparity_step_px
        noisy_m = np.full_like(depth_m, np.inf)
        np.divide(scale, disparity, out=noisy_m, where=(disparity > 0) & np.isfinite(depth_m))
        return _invalidate(noisy_m, depth_m, view, self.baseline_m, self.max_incidence_deg)


@dataclass(frozen=True)
class StructuredLight:
    """Depth from a pattern, as measured on a Kinect (first generation, 640 x 480 pixels at 57 degrees).

    Axial noise of 1.2 mm + 1.9 mm/m² (Z - 0.4 m)², more on surfaces beyond 60 degrees; lateral noise of about 0.8
    pixels (Nguyen, Izadi and Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking",
    3DIMPVT 2012). Invalid are shadows of the projector, `baseline_m` to the right, and surfaces seen at more than
    `max_incidence_deg` from their normal.
    """

    baseline_m: float = 0.075
    max_incidence_deg: float = DEFAULT_MAX_INCIDENCE_DEG

    def __post_init__(self) -> None:
        if not 0 < self.baseline_m < np.inf:
            raise ValueError(f"{self} needs baseline_m > 0")
        _check_incidence(self.max_incidence_deg)

    def apply(self, depth_m: FloatArray, view: View, random: np.random.Generator) -> FloatArray:
        """Return depth with noise."""
        height, width = depth_m.shape
        angle_rad = np.minimum(incidence_rad(depth_m, view), np.radians(89.0))
        steepness = angle_rad / (np.pi / 2 - angle_rad)
        lateral_px = (0.8 + 0.035 * steepness) * random.standard_normal((2, height, width))
        row, column = np.indices(depth_m.shape) + np.rint(lateral_px).astype(np.intp)
        seen_m = depth_m[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        axial_m = 0.0012 + 0.0019 * (seen_m - 0.4) ** 2
        beyond = angle_rad > np.radians(60.0)
        axial_m += np.where(beyond, 0.0001 / np.sqrt(seen_m) * steepness**2, 0.0)
        noise_m = np.where(np.isfinite(seen_m), axial_m, 0.0) * random.standard_normal(depth_m.shape)
        return _invalidate(seen_m + noise_m, depth_m, view, self.baseline_m, self.max_incidence_deg)


MODELS = {"stereo": Stereo, "structured_light": StructuredLight}


def read_depth_noise(values: Mapping[str, Any]) -> DepthNoise:
    """Read a camera's `depth_noise`; raises TypeError or ValueError when it is not one."""
    model = values.get("model")
    if model not in MODELS:
        raise ValueError(f"model is {model!r}, not one of: {', '.join(MODELS)}")
    found: DepthNoise = MODELS[model](**{str(key): float(value) for key, value in values.items() if key != "model"})
    return found


def incidence_rad(depth_m: FloatArray, view: View) -> FloatArray:
    """(H, W) angles between rays and the normals of what they meet; 0 where they meet nothing.

    Inverse depth of a plane is linear over the image plane: its slopes give the normal. At an edge the flatter of both
    sides counts.
    """
    inverse = 1.0 / depth_m
    slope_x, slope_y = _flatter_slope(inverse, view.x, 1), _flatter_slope(inverse, view.y, 0)
    length = np.sqrt(slope_x**2 + slope_y**2 + (inverse - view.x * slope_x - view.y * slope_y) ** 2)
    length *= np.sqrt(1.0 + view.x**2 + view.y**2)
    cosine = np.divide(inverse, length, out=np.ones_like(inverse), where=inverse > 0)
    angles_rad: FloatArray = np.arccos(np.clip(cosine, 0.0, 1.0))
    return angles_rad


def in_shadow(depth_m: FloatArray, view: View, baseline_m: float) -> npt.NDArray[np.bool_]:
    """(H, W): hidden from a second imager (or projector) that is `baseline_m` to the right.

    It sees a point further left by the disparity; whatever it sees no further left, though it lies to the right, hides
    the point.
    """
    seen_there = view.x - baseline_m / depth_m
    further_right = np.minimum.accumulate(seen_there[:, ::-1], axis=1)[:, ::-1]
    hidden = np.zeros(depth_m.shape, np.bool_)
    hidden[:, :-1] = seen_there[:, :-1] >= further_right[:, 1:]
    return hidden


def _invalidate(
    noisy_m: FloatArray, depth_m: FloatArray, view: View, baseline_m: float, max_incidence_deg: float
) -> FloatArray:
    invalid = in_shadow(depth_m, view, baseline_m)
    invalid |= incidence_rad(depth_m, view) > np.radians(max_incidence_deg)
    return np.where(invalid, np.nan, noisy_m)


def _flatter_slope(values: FloatArray, place: FloatArray, axis: int) -> FloatArray:
    if values.shape[axis] < 2:
        return np.zeros_like(values)
    slope = np.diff(values, axis=axis) / np.diff(place, axis=axis)
    before = np.concatenate([slope.take([0], axis), slope], axis)
    after = np.concatenate([slope, slope.take([-1], axis)], axis)
    return np.where(np.abs(before) < np.abs(after), before, after)


def _check_incidence(max_incidence_deg: float) -> None:
    if not 0 < max_incidence_deg <= 90:
        raise ValueError(f"max_incidence_deg is {max_incidence_deg:g}, not within 0 to 90")
