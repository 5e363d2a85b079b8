"""Whether laser and depth camera see the same: what one of them has wrong, unit or mount, the other does not."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import Finding, LaserScan, Level, Pose
from benchbot_robot_ros2.clearance import obstacle_points

SUBJECT = "laser and depth"
# What the camera sees this near to the plane of the laser, the laser sees, too; stereo is worth little far away.
BAND_M, FARTHEST_M = 0.05, 5.0
TOLERANCE, TOLERANCE_M = 0.1, 0.15
WIDEST_BEAM_RAD = math.radians(3.0)
FEWEST_POINTS = 30
# Glass and edges are seen differently, and somebody may walk by.
FEW, MOST = 0.25, 0.6
LEVEL_COSINE = 0.999


def check(
    scan: LaserScan, laser: Pose, depth_m: NDArray[np.float32], camera: Pose, intrinsics: Any
) -> Iterator[Finding]:
    """Compare the observations `laser` and `image_depth` where both look; `laser` and `camera` are mounts in the base.

    Yields nothing where they have too little in common to tell, and for a laser that is not level.
    """
    if abs(laser.matrix()[2, 2]) < LEVEL_COSINE:
        return
    height_m = laser.translation_xyz[2]
    points = obstacle_points(depth_m, camera, (height_m - BAND_M, height_m + BAND_M), intrinsics)
    seen = _Scan(scan, laser)
    by_depth_m, by_laser_m = seen.where(points)
    if by_depth_m.size < FEWEST_POINTS:
        return
    share = _alike(by_depth_m, by_laser_m)
    if share >= MOST:
        yield Finding(Level.OK, SUBJECT, f"alike in {share:.0%} of {by_depth_m.size} directions")
        return
    turned = _alike(*_Scan(scan, laser @ Pose.planar(0.0, 0.0, math.pi)).where(points))
    detail = (
        f"alike in {share:.0%} of the {by_depth_m.size} directions in which both look, at the laser's height: "
        f"{np.median(by_depth_m):.2f} m by depth, {np.median(by_laser_m):.2f} m by laser (medians)"
    )
    fix = "Correct the mount of laser or camera under frames, or in the URDF; else the unit of the depth pictures."
    if turned >= MOST:
        fix = "Turned by 180 degrees the laser agrees: correct its yaw, under frames or in the URDF."
    yield Finding(Level.BROKEN if share < FEW else Level.WARNING, SUBJECT, detail, fix)


class _Scan:
    """A scan seen from the base: bearings of its beams about the laser, sorted, and their ranges."""

    def __init__(self, scan: LaserScan, mount: Pose) -> None:
        ranges_m, angles_rad = np.asarray(scan["scans"], np.float64).reshape(-1, 2).T
        told = ~np.isnan(ranges_m)
        matrix = mount.matrix()
        beams = matrix[:2, :2] @ np.stack([np.cos(angles_rad[told]), np.sin(angles_rad[told])])
        bearings = np.arctan2(beams[1], beams[0])
        order = np.argsort(bearings)
        self._bearings_rad, self._ranges_m = bearings[order], ranges_m[told][order]
        self._origin = matrix[:2, 3]
        self._within_m = float(scan["range_min"]), min(float(scan["range_max"]), FARTHEST_M)

    def where(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the distances of points (N, 2) in the base frame, and of the beams towards them, where there is one.

        A beam that came back from nowhere is infinitely long.
        """
        if not self._bearings_rad.size:
            return np.empty(0), np.empty(0)
        away = points - self._origin
        distances_m = np.hypot(away[:, 0], away[:, 1])
        bearings = np.arctan2(away[:, 1], away[:, 0])
        right = np.searchsorted(self._bearings_rad, bearings)
        beside = np.stack([right - 1, right]) % self._bearings_rad.size
        off = np.abs((self._bearings_rad[beside] - bearings + np.pi) % (2 * np.pi) - np.pi)
        nearest = np.where(off[0] <= off[1], beside[0], beside[1])
        shown = (off.min(0) < WIDEST_BEAM_RAD) & (distances_m > self._within_m[0]) & (distances_m < self._within_m[1])
        return distances_m[shown], self._ranges_m[nearest][shown]


def _alike(one_m: NDArray[np.float64], other_m: NDArray[np.float64]) -> float:
    if not one_m.size:
        return 0.0
    return float((np.abs(one_m - other_m) < np.maximum(TOLERANCE_M, TOLERANCE * one_m)).mean())
