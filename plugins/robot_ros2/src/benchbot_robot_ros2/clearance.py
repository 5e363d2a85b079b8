"""Contact ahead of a motion: obstacles seen by laser, lidar or depth camera, and the way of the footprint among them.

Nothing is turned by a disc that turns on the spot, so its contact depends on the way of the base's origin alone; a
polygon is looked at in many poses on its way.
"""

import math
from collections.abc import Mapping
from typing import cast

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import LaserScan, LidarScan, MotionConfig, Pose, points_m
from benchbot_robot_ros2.footprint import Footprint
from benchbot_robot_ros2.ramp import REST, Velocity, clipped

# An arc this long and wide is less than a millimetre from its chord.
LONGEST_STEP_M = 0.05
WIDEST_STEP_RAD = math.radians(5.0)
NO_STEP_M = 1e-9
# A polygon is looked at in poses between which no corner moves farther than twice this, and with so much about it.
BETWEEN_M = 0.01
# A picture is thinned out to about so many pixels: far more than a footprint needs, few enough for every control tick.
DEPTH_PIXELS = 8000
# What is inside the footprint already counts as approached only if it comes closer by more than rounding.
CLOSER_M = 1e-6

Array = NDArray[np.float64]


def contact_ahead(
    points_xy: Array,
    footprint: Footprint,
    velocity: Velocity,
    command: Velocity,
    horizon_s: float,
    motion: MotionConfig,
) -> bool:
    """Return whether a footprint would touch a point, following a command for `horizon_s` and then braking to rest.

    `points_xy` are obstacles (N, 2) in metres in the base frame of now; `command` is clipped to the motion's limits.
    Velocities ramp with the motion's accelerations, as the guard makes them. A base that is not holonomic is taken to
    go ahead and turn only: what its odometry measures sideways is noise, or none of its doing. A point inside
    the footprint already is touched only by a motion that brings it closer: a robot that stands against a wall can
    drive away from it.
    """
    if not motion.lateral_limit_mps:
        velocity = velocity._replace(lateral_mps=0.0)
    starts, steps, headings_rad = _way(velocity, clipped(command, motion), horizon_s, motion)
    radius_m = footprint.radius_m
    now_m = np.hypot(points_xy[:, 0], points_xy[:, 1])
    near = now_m < radius_m + np.hypot(steps[:, 0], steps[:, 1]).sum() + BETWEEN_M
    points_xy, now_m = points_xy[near], now_m[near]
    if footprint.polygon:
        return _polygon_touches(points_xy, footprint, starts, steps, headings_rad)
    moved = np.hypot(steps[:, 0], steps[:, 1]) > NO_STEP_M
    starts, steps = starts[moved], steps[moved]
    if len(points_xy) == 0 or len(steps) == 0:
        return False
    nearest_m = _distances(points_xy, starts, steps).min(1)
    return bool((nearest_m < np.where(now_m < radius_m, now_m - CLOSER_M, radius_m)).any())


def _polygon_touches(points_xy: Array, footprint: Footprint, starts: Array, steps: Array, headings_rad: Array) -> bool:
    """Return whether a polygon touches a point on its base's way, or nearly does."""
    turns_rad = np.diff(headings_rad)
    farthest_m = np.hypot(steps[:, 0], steps[:, 1]) + footprint.radius_m * np.abs(turns_rad)
    counts = np.maximum(1, np.ceil(farthest_m / (2 * BETWEEN_M))).astype(int)
    step = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(step)) - np.repeat(np.cumsum(counts) - counts, counts) + 1) / counts[step]
    places = starts[step] + share[:, None] * steps[step]
    headings_rad = headings_rad[step] + share * turns_rad[step]
    now_m = footprint.distance_m(points_xy)
    margin_m = np.where(now_m < BETWEEN_M, now_m - CLOSER_M, BETWEEN_M)
    for place, heading_rad in zip(places, headings_rad, strict=True):
        cos, sin = math.cos(heading_rad), math.sin(heading_rad)
        off = points_xy - place
        beside = np.hypot(off[:, 0], off[:, 1]) < footprint.radius_m + BETWEEN_M
        seen = off[beside] @ np.array([[cos, -sin], [sin, cos]])
        if (footprint.distance_m(seen) < margin_m[beside]).any():
            return True
    return False


def obstacle_points(
    observation: LaserScan | LidarScan | NDArray[np.float32],
    mount: Pose,
    z_range_m: tuple[float, float],
    intrinsics: Array | None = None,
) -> Array:
    """Return the obstacles (N, 2) in metres in the base frame that one observation shows.

    `observation` is the channel `laser`, `lidar`, or `image_depth` with the camera's 3x3 `intrinsics` in pixels of
    that picture; `mount` is the scanner's or the optical frame's pose in the base frame. Of a picture and of a lidar
    only what lies between the heights `z_range_m` above the floor counts; of a scan, everything. -inf is too near to be
    measured (REP-117): an obstacle at the laser's shortest range, or at the camera or lidar. NaN, +inf and ranges
    outside the scanner's are none.
    """
    if isinstance(observation, Mapping) and "scans" in observation:
        return _in_base(_scanned(cast(LaserScan, observation)), mount)[:, :2]
    if isinstance(observation, Mapping):
        points = _in_base(_ringed(cast(LidarScan, observation)), mount)
    elif intrinsics is None:
        raise ValueError("obstacles in a depth picture need the camera's intrinsics")
    else:
        points = _in_base(_seen(observation, intrinsics), mount)
    z_min_m, z_max_m = z_range_m
    return points[(points[:, 2] >= z_min_m) & (points[:, 2] <= z_max_m), :2]


def _scanned(laser: LaserScan) -> Array:
    ranges_m, angles_rad = np.asarray(laser["scans"], np.float64).reshape(-1, 2).T
    nearest_m, farthest_m = float(laser["range_min"]), float(laser["range_max"])
    ranges_m = np.where(np.isneginf(ranges_m), nearest_m, ranges_m)
    valid = (ranges_m >= nearest_m) & (ranges_m <= farthest_m) & np.isfinite(ranges_m)
    ranges_m, angles_rad = ranges_m[valid], angles_rad[valid]
    return np.stack([ranges_m * np.cos(angles_rad), ranges_m * np.sin(angles_rad), np.zeros_like(ranges_m)], 1)


def _ringed(lidar: LidarScan) -> Array:
    too_near = np.isneginf(lidar["ranges_m"])
    points = points_m({**lidar, "ranges_m": np.where(too_near, np.float32(0.0), lidar["ranges_m"])}).reshape(-1, 3)
    return points[np.isfinite(points).all(1)]


def _seen(depth_m: NDArray[np.float32], intrinsics: Array) -> Array:
    height, width = depth_m.shape
    stride = max(1, math.ceil(math.sqrt(height * width / DEPTH_PIXELS)))
    rows, columns = np.mgrid[stride // 2 : height : stride, stride // 2 : width : stride]
    depths_m = depth_m[rows, columns].astype(np.float64)
    depths_m[np.isneginf(depths_m)] = 0.0
    valid = np.isfinite(depths_m)
    depths_m, rows, columns = depths_m[valid], rows[valid], columns[valid]
    (fx, _, cx), (_, fy, cy), _ = np.asarray(intrinsics, np.float64)
    return np.stack([(columns - cx) / fx * depths_m, (rows - cy) / fy * depths_m, depths_m], 1)


def _in_base(points: Array, mount: Pose) -> Array:
    matrix = mount.matrix()
    in_base: Array = points @ matrix[:3, :3].T + matrix[:3, 3]
    return in_base


def _distances(points: Array, starts: Array, steps: Array) -> Array:
    """Return the distance of each point (N, 2) from each line segment: starts (K, 2), steps to their ends (K, 2)."""
    # Everything from |p - a|² and (p - a)·d, all pairs in two matrix products.
    squared_m2 = (points**2).sum(1)[:, None] - 2 * points @ starts.T + (starts**2).sum(1)
    along = points @ steps.T - (starts * steps).sum(1)
    length_m2 = (steps**2).sum(1)
    share = np.clip(along / length_m2, 0.0, 1.0)
    distances_m: Array = np.sqrt(np.maximum(squared_m2 + share * (share * length_m2 - 2 * along), 0.0))
    return distances_m


def _way(velocity: Velocity, command: Velocity, horizon_s: float, motion: MotionConfig) -> tuple[Array, Array, Array]:
    """Return the way of the base until it rests: starts and steps of its origin (K, 2), headings at their ends."""
    accelerations = Velocity(
        motion.linear_acceleration_mps2, motion.angular_acceleration_radps2, motion.linear_acceleration_mps2
    )
    at_horizon = Velocity(
        *(
            float(_ramp(start, wanted, acceleration, np.array([horizon_s]))[0][0])
            for start, wanted, acceleration in zip(velocity, command, accelerations, strict=True)
        )
    )
    braking_s = max(abs(speed) / acceleration for speed, acceleration in zip(at_horizon, accelerations, strict=True))
    way_m, turned_rad, side_m = np.concatenate(
        [
            _advance(velocity, command, horizon_s, accelerations),
            _advance(at_horizon, REST, braking_s, accelerations),
        ],
        1,
    )
    # The chord of an arc is its length times sin(h) / h, at half the turn h from the heading; sinc(x) has x = h / π.
    heading_rad = np.cumsum(turned_rad) - turned_rad / 2
    chord_x, chord_y = np.stack([way_m, side_m]) * np.sinc(turned_rad / (2 * math.pi))
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    steps = np.stack([chord_x * cos - chord_y * sin, chord_x * sin + chord_y * cos], 1)
    starts = np.cumsum(steps, 0) - steps
    return starts, steps, np.concatenate([[0.0], np.cumsum(turned_rad)])


def _advance(start: Velocity, wanted: Velocity, duration_s: float, accelerations: Velocity) -> Array:
    """Return the ways (m), turns (rad) and ways to the left (m) of short, successive steps: (3, steps)."""
    fastest = Velocity(*(max(abs(a), abs(b)) for a, b in zip(start, wanted, strict=True)))
    fastest_mps, fastest_radps = math.hypot(fastest.linear_mps, fastest.lateral_mps), fastest.angular_radps
    steps = math.ceil(max(1.0, fastest_mps * duration_s / LONGEST_STEP_M, fastest_radps * duration_s / WIDEST_STEP_RAD))
    elapsed_s = np.linspace(0.0, duration_s, steps + 1)
    return np.stack(
        [
            np.diff(_ramp(begin, end, acceleration, elapsed_s)[1])
            for begin, end, acceleration in zip(start, wanted, accelerations, strict=True)
        ]
    )


def _ramp(start: float, wanted: float, acceleration: float, elapsed_s: Array) -> tuple[Array, Array]:
    """Return the velocities after times of ramping from `start` to `wanted`, and their exact integrals."""
    ramp_s = abs(wanted - start) / acceleration
    ramping_s = np.minimum(elapsed_s, ramp_s)
    velocity = np.where(elapsed_s < ramp_s, start + math.copysign(acceleration, wanted - start) * ramping_s, wanted)
    way = (start + velocity) / 2 * ramping_s + wanted * (elapsed_s - ramping_s)
    return velocity, way
