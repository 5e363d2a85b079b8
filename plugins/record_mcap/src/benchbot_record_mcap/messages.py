"""ROS 2 messages, made from the values of observations."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.typesys.stores.ros2_jazzy import builtin_interfaces__msg__Time as Time
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Quaternion as Quaternion
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Transform as Transform
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__TransformStamped as TransformStamped
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Vector3 as Vector3
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__CameraInfo as CameraInfo
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__Image as Image
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__Imu as Imu
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__JointState as JointState
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__LaserScan as LaserScan
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__PointCloud2 as PointCloud2
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__PointField as PointField
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__RegionOfInterest as RegionOfInterest
from rosbags.typesys.stores.ros2_jazzy import std_msgs__msg__Header as Header
from rosbags.typesys.stores.ros2_jazzy import std_msgs__msg__String as String
from rosbags.typesys.stores.ros2_jazzy import tf2_msgs__msg__TFMessage as TFMessage

from benchbot.plugin import (
    LIDAR_OFFSETS,
    LIDAR_POINT,
    CameraModel,
    FramePose,
    InertialMeasurement,
    JointStates,
    LidarScan,
    cloud,
)
from benchbot.plugin import LaserScan as Scan

EVENLY_SPACED_RAD = 1e-4

# Encodings of sensor_msgs/image_encodings.hpp: what one pixel is, and how many channels it has.
ENCODINGS: Mapping[str, tuple[str, int]] = {
    "rgb8": ("uint8", 3),
    "mono8": ("uint8", 1),
    "mono16": ("uint16", 1),
    "32FC1": ("float32", 1),
}


def header(time_ns: int, frame_id: str) -> Header:
    """Return a header with a stamp in nanoseconds."""
    return Header(Time(*divmod(time_ns, 1_000_000_000)), frame_id)


def image(pixels: npt.NDArray[Any], encoding: str, stamped: Header) -> Image:
    """Return an image; raises ValueError when `pixels` is not (H, W) or (H, W, channels) of the encoding's dtype."""
    dtype, channels = ENCODINGS[encoding]
    pixels = np.asarray(pixels)
    if (
        pixels.dtype.newbyteorder("=") != dtype
        or pixels.shape[2:] != (() if channels == 1 else (channels,))
        or pixels.ndim < 2
    ):
        raise ValueError(f"{encoding} holds {dtype} with {channels} per pixel, not {pixels.dtype} {pixels.shape}")
    height, width = pixels.shape[:2]
    little_endian = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder("<"))
    step = width * channels * pixels.dtype.itemsize
    return Image(stamped, height, width, encoding, 0, step, little_endian.reshape(-1).view(np.uint8))


def camera_info(info: CameraModel, stamped: Header) -> CameraInfo:
    """Return the model of a pinhole camera, with the distortion that it reports, if any, and no rotation."""
    return CameraInfo(
        header=stamped,
        height=int(info["height"]),
        width=int(info["width"]),
        distortion_model="plumb_bob",
        d=_floats(info.get("distortion_coefficients", np.zeros(5)), 5),
        k=_floats(info["matrix_intrinsics"], 9),
        r=np.eye(3).reshape(-1),
        p=_floats(info["matrix_projection"], 12),
        binning_x=0,
        binning_y=0,
        roi=RegionOfInterest(0, 0, 0, 0, do_rectify=False),
    )


def laser_scan(laser: Scan, stamped: Header) -> LaserScan:
    """Return a scan of evenly spaced beams, in the precision of the message, float32.

    Angles may wrap at pi. Raises ValueError when beams are not evenly spaced: the message cannot say so.
    """
    ranges_m, angles_rad = np.asarray(laser["scans"], np.float64).reshape(-1, 2).T
    beams = len(ranges_m)
    unwrapped_rad = np.unwrap(angles_rad)
    first_rad = float(unwrapped_rad[0]) if beams else 0.0
    increment_rad = float(unwrapped_rad[-1] - first_rad) / (beams - 1) if beams > 1 else 0.0
    even_rad = first_rad + increment_rad * np.arange(beams)
    # Written so that NaN is refused, too.
    if not np.all(np.abs(unwrapped_rad - even_rad) <= EVENLY_SPACED_RAD):
        raise ValueError("sensor_msgs/LaserScan needs beams that are evenly spaced, and these are not")
    # What is too far for float32 is too far for any scanner.
    with np.errstate(over="ignore"):
        ranges = ranges_m.astype(np.float32)
        limits = np.array([laser["range_min"], laser["range_max"]], np.float64).astype(np.float32)
    return LaserScan(
        header=stamped,
        angle_min=first_rad,
        angle_max=first_rad + increment_rad * max(beams - 1, 0),
        angle_increment=increment_rad,
        time_increment=0.0,
        scan_time=0.0,
        range_min=float(limits[0]),
        range_max=float(limits[1]),
        ranges=ranges,
        intensities=np.zeros(0, np.float32),
    )


def point_cloud(lidar: LidarScan, stamped: Header) -> PointCloud2:
    """Return an organised cloud, a row a ring, of the fields of `benchbot.core.lidar.POINT`, float32.

    Points that are none are NaN, and `distance` says why (REP-117).
    """
    records = cloud(lidar)
    fields = [PointField(name, offset, PointField.FLOAT32, 1) for name, offset in LIDAR_OFFSETS.items()]
    rings, beams = records.shape
    size = LIDAR_POINT.itemsize
    return PointCloud2(
        header=stamped,
        height=rings,
        width=beams,
        fields=fields,
        is_bigendian=False,
        point_step=size,
        row_step=size * beams,
        data=records.reshape(-1).view(np.uint8),
        is_dense=False,
    )


def imu(values: InertialMeasurement, stamped: Header) -> Imu:
    """Return inertial measurements whose covariances are unknown (zeros).

    What the device does not measure (NaN) has a covariance that begins with -1, as the message's definition has it.
    """
    orientation = _floats(values["orientation_xyzw"], 4)
    velocity = _floats(values["angular_velocity_radps"], 3)
    acceleration = _floats(values["linear_acceleration_mps2"], 3)
    return Imu(
        header=stamped,
        orientation=Quaternion(*orientation),
        orientation_covariance=_covariance(orientation),
        angular_velocity=Vector3(*velocity),
        angular_velocity_covariance=_covariance(velocity),
        linear_acceleration=Vector3(*acceleration),
        linear_acceleration_covariance=_covariance(acceleration),
    )


def joint_state(joints: JointStates, stamped: Header) -> JointState:
    """Return the states of joints: rad, rad/s and N m, of the gripper m, m/s and N."""
    names = [str(name) for name in joints["names"]]
    position, velocity, effort = (
        _floats(values, len(names)) for values in (joints["positions"], joints["velocities"], joints["efforts"])
    )
    return JointState(header=stamped, name=names, position=position, velocity=velocity, effort=effort)


def transforms(poses: Mapping[str, FramePose], time_ns: int) -> TFMessage:
    """Return each pose as a transform from its parent frame."""
    return TFMessage(
        [
            TransformStamped(
                header(time_ns, str(pose["parent_frame"])),
                name,
                Transform(
                    Vector3(*_floats(pose["translation_xyz"], 3)), Quaternion(*_floats(pose["rotation_xyzw"], 4))
                ),
            )
            for name, pose in poses.items()
        ]
    )


def text(document: Mapping[str, Any]) -> String:
    """Return a document as JSON in a string."""
    return String(json.dumps(document))


def _floats(values: Any, size: int) -> npt.NDArray[np.float64]:
    flat = np.asarray(values, np.float64).reshape(-1)
    if flat.size != size:
        raise ValueError(f"there must be {size} numbers, not {flat.size}")
    return flat


def _covariance(measured: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    covariance = np.zeros(9)
    covariance[0] = -1.0 if np.isnan(measured).any() else 0.0
    return covariance
