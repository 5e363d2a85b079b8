"""What can be said of pictures without knowing what they show: features that one finds again, and their statistics."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi.renderer import Frame, Intrinsics
from benchmarks.bench_quality import LUMA

FEATURES = 1000
NEAR_PX = 3.0
DEPTH_EDGE = 0.03  # of the depth: a feature beside a jump is of neither side
LOWE_RATIO = 0.8  # Lowe, IJCV 60(2), 2004, doi 10.1023/B:VISI.0000029664.99615.94
SPECTRUM_CYCLES = (8.0, 0.7)  # from so many in the picture to this share of the highest frequency

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class FeatureFigures:
    """Of features in one view that another shows too: `shared`, those `repeated` there, and matches, those right."""

    shared: int
    repeated: int
    matches: int
    right: int


def detectors() -> dict[str, tuple[Any, int]]:
    """OpenCV's ORB and SIFT, and the norm by which their descriptors are compared."""
    return {
        "ORB": (cv2.ORB.create(nfeatures=FEATURES), cv2.NORM_HAMMING),
        "SIFT": (cv2.SIFT.create(nfeatures=FEATURES), cv2.NORM_L2),
    }


def compare_views(
    one: Frame, other: Frame, poses: tuple[Array, Array], camera: Intrinsics
) -> Mapping[str, FeatureFigures]:
    """Features of one view beside those of another, where true depth and `poses` (4, 4, camera to map) put them."""
    return {name: _compare(one, other, poses, camera, *kind) for name, kind in detectors().items()}


def _compare(
    one: Frame, other: Frame, poses: tuple[Array, Array], camera: Intrinsics, detector: Any, norm: int
) -> FeatureFigures:
    (points, words), (other_points, other_words) = (_features(frame.rgb, detector) for frame in (one, other))
    if len(points) == 0 or len(other_points) < 2:
        return FeatureFigures(0, 0, 0, 0)
    moved, is_shared = reproject(points, one.depth_m, other.depth_m, poses, camera)
    distance_px = np.linalg.norm(moved[:, None] - other_points[None], axis=2)
    is_repeated = distance_px.min(axis=1) <= NEAR_PX
    pairs = [
        (best.queryIdx, best.trainIdx)
        for best, second in cv2.BFMatcher(norm).knnMatch(words, other_words, k=2)
        if best.distance < LOWE_RATIO * second.distance and is_shared[best.queryIdx]
    ]
    right = sum(bool(distance_px[pair] <= NEAR_PX) for pair in pairs)
    return FeatureFigures(int(is_shared.sum()), int((is_shared & is_repeated).sum()), len(pairs), right)


def _features(rgb: npt.NDArray[np.uint8], detector: Any) -> tuple[Array, Array]:
    """Places (N, 2) and descriptors of features; a pixel's centre is at its place plus a half."""
    found, words = detector.detectAndCompute(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), None)
    return np.array([feature.pt for feature in found], float).reshape(-1, 2) + 0.5, words


def reproject(
    points: Array, depth_m: Array, other_depth_m: Array, poses: tuple[Array, Array], camera: Intrinsics
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Where another view has points (N, 2) of a view, in pixels, and whether it shows them.

    It does not show what is outside of it or behind something; points beside a jump of depth are not followed.
    """
    columns, rows = np.floor(points).astype(int).T
    spread = cv2.dilate(depth_m, np.ones((3, 3))) - cv2.erode(depth_m, np.ones((3, 3)))
    here_m = depth_m[rows, columns]
    is_known = np.isfinite(here_m) & (here_m > 0) & (spread[rows, columns] <= DEPTH_EDGE * here_m)
    here_m = np.where(is_known, here_m, 1.0)
    rays = (points - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    in_camera = np.column_stack([rays * here_m[:, None], here_m, np.ones(len(points))])
    there = (np.linalg.inv(poses[1]) @ poses[0] @ in_camera.T).T[:, :3]
    moved = there[:, :2] / np.maximum(there[:, 2:], 1e-6) * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    is_inside = (there[:, 2] > 0) & (moved >= 0).all(axis=1) & (moved < [camera.width, camera.height]).all(axis=1)
    across, down = np.floor(np.where(is_inside[:, None], moved, 0.0)).astype(int).T
    is_in_front = np.abs(other_depth_m[down, across] - there[:, 2]) <= DEPTH_EDGE * there[:, 2]
    return moved, is_known & is_inside & is_in_front


@dataclass(frozen=True)
class PictureStatistics:
    """Of a picture: the slope of its amplitude spectrum, mean saturation (HSV), and shares of clipped pixels."""

    spectral_slope: float
    saturation: float
    white: float
    black: float


def statistics_of(rgb: npt.NDArray[np.uint8]) -> PictureStatistics:
    """Return the statistics of an sRGB picture (H, W, 3)."""
    most, least = rgb.max(axis=2).astype(float), rgb.min(axis=2)
    saturation = np.divide(most - least, most, out=np.zeros_like(most), where=most > 0)
    return PictureStatistics(
        spectral_slope(rgb @ LUMA),
        float(saturation.mean()),
        float((rgb == 255).any(axis=2).mean()),
        float((rgb == 0).all(axis=2).mean()),
    )


def spectral_slope(luma: Array) -> float:
    """a of the amplitude spectrum 1 / f ** a, over all orientations, of the largest square in the middle of (H, W).

    A line through logarithms of the mean amplitude in rings of equal width, under a Hann window.
    """
    height, width = luma.shape
    size = min(height, width)
    top, left = (height - size) // 2, (width - size) // 2
    square = luma[top : top + size, left : left + size].astype(float)
    window = np.hanning(size)[:, None] * np.hanning(size)[None]
    amplitude = np.abs(np.fft.fftshift(np.fft.fft2((square - square.mean()) * window)))
    cycles = np.hypot(*np.meshgrid(*[np.arange(size) - size // 2] * 2)).round().astype(int)
    rings = np.bincount(cycles.ravel(), amplitude.ravel()) / np.bincount(cycles.ravel())
    frequencies = np.arange(len(rings))
    is_used = (frequencies >= SPECTRUM_CYCLES[0]) & (frequencies <= SPECTRUM_CYCLES[1] * size / 2) & (rings > 0)
    if is_used.sum() < 2:
        return float("nan")
    slope, _ = np.polyfit(np.log(frequencies[is_used]), np.log(rings[is_used]), 1)
    return float(-slope)
