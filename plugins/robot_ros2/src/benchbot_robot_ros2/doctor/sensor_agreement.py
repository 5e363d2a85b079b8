"""Whether laser and depth camera see the same: what one of them has wrong, unit or mount, the other does not."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import Finding, LaserScan, Level, Pose
from benchbot_robot_ros2.clearance import obstacle_points

Points = NDArray[np.float64]
SUBJECT = "laser and depth"
# What stands upright through the plane of the laser, so far above and below it, the laser sees, too: a floor or a table
# top near that plane does not count. Stereo is worth little far away.
GAP_M, BAND_M, FARTHEST_M = 0.03, 0.12, 5.0
LOWEST_M = 0.05
DIRECTION_RAD = math.radians(1.0)
TOLERANCE, TOLERANCE_M = 0.1, 0.15
WIDEST_BEAM_RAD = math.radians(3.0)
FEWEST_DIRECTIONS = 15
# Glass and edges are seen differently, and somebody may walk by.
FEW, MOST = 0.25, 0.6
LEVEL_COSINE = 0.999


def check(
    scan: LaserScan, laser: Pose, depth_m: NDArray[np.float32], camera: Pose, intrinsics: Any
) -> Iterator[Finding]:
    """Compare the observations `laser` and `image_depth` where both look; `laser` and `camera` are mounts in the base.

    Yields nothing where they have too little in common to tell, and for a laser that is not level, or near the floor.
    """
    height_m = laser.translation_xyz[2]
    if abs(laser.matrix()[2, 2]) < LEVEL_COSINE or height_m - BAND_M < LOWEST_M:
        return
    above, below = (
        obstacle_points(depth_m, camera, band, intrinsics)
        for band in ((height_m + GAP_M, height_m + BAND_M), (height_m - BAND_M, height_m - GAP_M))
    )
    points = _upright(above, below, np.array(laser.translation_xyz[:2]))
    by_depth_m, by_laser_m = _Scan(scan, laser).where(points)
    if by_depth_m.size < FEWEST_DIRECTIONS:
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


def _upright(above: Points, below: Points, origin: Points) -> Points:
    """Return the nearest point (N, 2) of each direction from the origin that has another one above or below it."""
    nearest: list[dict[int, tuple[float, int]]] = [{}, {}]
    for found, points in zip(nearest, (above, below), strict=True):
        away = points - origin
        directions = np.floor(np.arctan2(away[:, 1], away[:, 0]) / DIRECTION_RAD).astype(int)
        for place, (direction, distance_m) in enumerate(
            zip(directions.tolist(), np.hypot(*away.T).tolist(), strict=True)
        ):
            found[direction] = min(found.get(direction, (math.inf, 0)), (distance_m, place))
    kept = [
        place
        for direction, (distance_m, place) in nearest[0].items()
        if abs(nearest[1].get(direction, (math.inf, 0))[0] - distance_m) < max(TOLERANCE_M, TOLERANCE * distance_m)
    ]
    return above[kept]


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

    def where(self, points: Points) -> tuple[Points, Points]:
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


def _alike(one_m: Points, other_m: Points) -> float:
    if not one_m.size:
        return 0.0
    return float((np.abs(one_m - other_m) < np.maximum(TOLERANCE_M, TOLERANCE * one_m)).mean())
