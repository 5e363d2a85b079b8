"""What a robot observed at one instant, as pixels and beams that lie on rays in the map frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.core import lidar
from benchbot.core.channels import CameraModel
from benchbot.core.geometry import Pose
from benchbot.plugins.authoring.comparability.world import Floats

MOST_RAYS = 2500
UNDISTORTING_STEPS = 20


@dataclass(frozen=True, eq=False)
class Picture:
    """Values (H, W, …) of every `step`-th row and column, the camera's model, and the pose (4, 4) of its optical frame.

    `fx`, `fy`, `cx`, `cy` and `size` (width, height) are in pixels of the whole picture, centres at integers;
    `distortion` is k1 k2 p1 p2 k3 (plumb_bob), `limits_m` are of depth. The pose is in the map frame.
    """

    values: NDArray[Any]
    fx: float
    fy: float
    cx: float
    cy: float
    size: tuple[int, int]
    pose: Floats
    distortion: Floats | None = None
    step: int = 1
    limits_m: tuple[float, float] = (0.0, np.inf)

    @classmethod
    def of(cls, values: NDArray[Any], model: CameraModel, pose: Floats) -> "Picture":
        """Return a picture as the channels have it, of a large one only so many pixels."""
        k, distortion = model["matrix_intrinsics"], model.get("distortion_coefficients")
        step = max(1, int(np.ceil(np.sqrt(values.shape[0] * values.shape[1] / MOST_RAYS))))
        fx, fy, cx, cy = (float(k[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
        size = (values.shape[1], values.shape[0])
        return cls(values[::step, ::step], fx, fy, cx, cy, size, pose, distortion, step)

    def thinned(self) -> "Picture":
        """Return every second row and column."""
        return replace(self, values=self.values[::2, ::2], step=2 * self.step)

    def rays(self) -> Floats:
        """Return the rays (H, W, 3) of the pixels in the optical frame, each of depth 1."""
        v, u = np.mgrid[0 : self.values.shape[0], 0 : self.values.shape[1]]
        x, y = (self.step * u - self.cx) / self.fx, (self.step * v - self.cy) / self.fy
        if self.distortion is not None:
            x, y = _undistorted(x, y, self.distortion)
        return np.stack([x, y, np.ones_like(x)], -1)

    @property
    def origin(self) -> Floats:
        """The camera's place in the map frame."""
        return self.pose[:3, 3]

    def directions(self) -> Floats:
        """Return the rays (H, W, 3) in the map frame."""
        return self.rays() @ self.pose[:3, :3].T

    def points(self) -> Floats:
        """Return the points (H, W, 3) in the map frame that a depth picture is of; NaN where it has none."""
        return self.origin + np.where(np.isfinite(self.values), self.values, np.nan)[..., None] * self.directions()


@dataclass(frozen=True, eq=False)
class Scan:
    """Ranges (N,) of beams, their unit directions (N, 3) in the scanner's frame, and its pose (4, 4) in the map."""

    values: Floats
    along: Floats
    pose: Floats
    limits_m: tuple[float, float]

    @property
    def origin(self) -> Floats:
        """The scanner's place in the map frame."""
        return self.pose[:3, 3]

    def thinned(self) -> "Scan":
        """Return every second beam."""
        return replace(self, values=self.values[::2], along=self.along[::2])

    def directions(self) -> Floats:
        """Return the beams (N, 3) in the map frame."""
        return self.along @ self.pose[:3, :3].T

    def points(self) -> Floats:
        """Return where the beams ended (N, 3) in the map frame; NaN where they did not."""
        return self.origin + np.where(np.isfinite(self.values), self.values, np.nan)[:, None] * self.directions()


@dataclass(frozen=True, eq=False)
class Sight:
    """All that a robot observed at one instant: channels, the pose of its base, and how often it was loaded before."""

    observations: Mapping[str, Any]
    base: Pose
    load: int = 0

    def pose_told(self, frame: str | None) -> Floats | None:
        """Return the pose (4, 4) of a frame as the robot tells it in `poses`; None where it does not."""
        told = self.observations.get("poses", {}).get(frame)
        if told is None:
            return None
        xyz, xyzw = told["translation_xyz"].tolist(), told["rotation_xyzw"].tolist()
        return Pose((xyz[0], xyz[1], xyz[2]), (xyzw[0], xyzw[1], xyzw[2], xyzw[3])).matrix()

    def pose_of(self, frame: str | None, robot: Mapping[str, Any]) -> Floats | None:
        """Return the pose (4, 4) of a frame: as the robot tells it, or else as its declaration mounts it."""
        mount = robot.get("frames", {}).get(frame)
        told = self.pose_told(frame)
        return (self.base @ mounted(mount)).matrix() if told is None and mount is not None else told


def mounted(mount: Mapping[str, Any]) -> Pose:
    """Return the place of a frame on the robot, as `frames` of its declaration has it."""
    return Pose.from_xyz_rpy_deg(mount["xyz"], mount.get("rpy_deg", (0.0, 0.0, 0.0)))


def pictures(sights: Sequence[Sight], channel: str, robot: Mapping[str, Any]) -> list[Picture]:
    """Return the pictures of a channel; none where the robot has no such channel, or its camera no pose.

    Of `image_segment` they are numbers of instances, which have the classes in them.
    """
    found = []
    for sight in sights:
        seen = sight.observations
        pose = sight.pose_of("camera", robot)
        if pose is None:
            pose = sight.pose_of(robot.get("camera", {}).get("frame"), robot)
        if channel in seen and f"{channel}_info" in seen and pose is not None:
            values = seen[channel]
            if channel == "image_segment":
                values = np.stack([values["class_segment_img"], values["instance_segment_img"]], -1)
            near_m, far_m = robot.get("camera", {}).get("range_m", (0.0, np.inf))
            picture = Picture.of(values, seen[f"{channel}_info"], pose)
            found.append(replace(picture, limits_m=(float(near_m), float(far_m))))
    return found


def laser_scans(sights: Sequence[Sight], robot: Mapping[str, Any]) -> list[Scan]:
    """Return the scans of the channel `laser`."""
    found = []
    for sight in sights:
        pose = sight.pose_of(robot.get("laser", {}).get("frame", "lidar"), robot)
        if "laser" in sight.observations and pose is not None:
            seen = sight.observations["laser"]
            ranges_m, angles = seen["scans"].T
            along = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], -1)
            found.append(Scan(ranges_m, along, pose, (seen["range_min"], seen["range_max"])))
    return found


def lidar_scans(sights: Sequence[Sight], robot: Mapping[str, Any]) -> list[Scan]:
    """Return the scans of the channel `lidar`, ring after ring."""
    found = []
    for sight in sights:
        if "lidar" not in sight.observations:
            continue
        seen = sight.observations["lidar"]
        pose = sight.pose_of(seen["frame_id"], robot)
        if pose is not None:
            along = lidar.directions(seen["elevations_rad"], seen["azimuths_rad"]).reshape(-1, 3)
            limits = robot.get("lidar", {}).get("range_m", (0.0, np.inf))
            step = max(1, len(along) // MOST_RAYS)
            ranges_m = np.asarray(seen["ranges_m"], np.float64).reshape(-1)
            found.append(Scan(ranges_m[::step], along[::step], pose, (float(limits[0]), float(limits[1]))))
    return found


def _undistorted(x: Floats, y: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """Return the rays of distorted image points by fixed-point iteration, as OpenCV's undistortPoints does it."""
    k1, k2, p1, p2, k3 = coefficients
    straight_x, straight_y = x, y
    for _ in range(UNDISTORTING_STEPS):
        r2 = straight_x**2 + straight_y**2
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        across = 2 * p1 * straight_x * straight_y + p2 * (r2 + 2 * straight_x**2)
        down = p1 * (r2 + 2 * straight_y**2) + 2 * p2 * straight_x * straight_y
        straight_x, straight_y = (x - across) / radial, (y - down) / radial
    return straight_x, straight_y
