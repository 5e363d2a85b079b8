"""Observations as ROS 2 messages: the inverse of the callbacks, for what presents itself as a robot."""

from collections.abc import Callable
from typing import Any, Literal

import msgspec
import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import CameraInfo, Image, Imu, JointState, LaserScan, PointCloud2, PointField
from std_msgs.msg import String

from benchbot.plugin import LIDAR_OFFSETS, CameraModel, InertialMeasurement, JointStates, LidarScan, Segmentation, cloud
from benchbot.plugin import LaserScan as Scan
from benchbot_robot_ros2.messages import set_stamp

# Of float32 angles, up to pi, in a scan of thousands of beams.
_ANGLE_ROUNDING_RAD = 1e-5


def encode(channel: str, value: Any, *, stamp_ns: int, frame_id: str) -> dict[str, Any]:
    """Return the messages of an observation by part, the empty string for a single one.

    Pictures are rgb8, mono8, mono16 and 32FC1. A laser's angles must be evenly spaced; its numbers become float32. A
    lidar is an organised cloud, a row a ring, with the fields of `benchbot.core.lidar.POINT`. What an inertial
    measurement unit does not measure (NaN) has -1 in its covariance (REP-145); other covariances are left unknown.
    Raises ValueError for a channel that has no messages, such as `poses`, and for a value that they cannot hold.
    """
    if channel not in _ENCODERS:
        raise ValueError(f"the channel '{channel}' has no messages; those that have: {', '.join(_ENCODERS)}")
    parts = _ENCODERS[channel](value)
    for message in parts.values():
        if not isinstance(message, String):
            set_stamp(message, stamp_ns)
            message.header.frame_id = frame_id
    return parts


def _image(pixels: npt.NDArray[Any], encoding: str, dtype: str, channels: int) -> Any:
    if not pixels.size or pixels.shape[2:] != ((channels,) if channels > 1 else ()):
        raise ValueError(f"an array of the shape {pixels.shape} is no {encoding} picture")
    if pixels.dtype != np.dtype(dtype):
        raise ValueError(f"an array of {pixels.dtype} is no {encoding} picture")
    height, width = pixels.shape[:2]
    data = np.ascontiguousarray(pixels, dtype)
    message = Image(height=height, width=width, encoding=encoding, step=data.strides[0])
    # Into the array.array that the message has: one copy, where assigning bytes takes thirty times as long.
    message.data.frombytes(data.view(np.uint8))
    return message


def _camera_info(model: CameraModel) -> Any:
    return CameraInfo(
        height=model["height"],
        width=model["width"],
        distortion_model="plumb_bob",
        d=np.asarray(model.get("distortion_coefficients", np.zeros(5)), np.float64).tolist(),
        k=np.ravel(model["matrix_intrinsics"]).astype(np.float64),
        r=np.eye(3).ravel(),
        p=np.ravel(model["matrix_projection"]).astype(np.float64),
    )


def _scan(scan: Scan) -> Any:
    if not len(scan["scans"]):
        raise ValueError("the scan is empty")
    ranges_m, angles_rad = scan["scans"][:, 0], np.unwrap(scan["scans"][:, 1])
    first_rad, last_rad = float(angles_rad[0]), float(angles_rad[-1])
    even_rad = np.linspace(first_rad, last_rad, len(angles_rad))
    if not (np.abs(angles_rad - even_rad) < _ANGLE_ROUNDING_RAD).all():
        raise ValueError("the angles of the scan are not evenly spaced")
    message = LaserScan(
        angle_min=first_rad,
        angle_max=last_rad,
        angle_increment=(last_rad - first_rad) / max(1, len(angles_rad) - 1),
        range_min=float(scan["range_min"]),
        range_max=float(scan["range_max"]),
    )
    message.ranges.frombytes(np.ascontiguousarray(ranges_m, "<f4").view(np.uint8))
    return message


def _cloud(lidar: LidarScan) -> Any:
    records = cloud(lidar)
    if not records.size:
        raise ValueError("the cloud is empty")
    message = PointCloud2(
        height=records.shape[0],
        width=records.shape[1],
        fields=[
            PointField(name=name, offset=offset, datatype=PointField.FLOAT32, count=1)
            for name, offset in LIDAR_OFFSETS.items()
        ],
        is_bigendian=False,
        point_step=records.itemsize,
        row_step=records.strides[0],
        is_dense=False,
    )
    message.data.frombytes(records.reshape(-1).view(np.uint8))
    return message


def _imu(imu: InertialMeasurement) -> Any:
    message = Imu()
    for part, key in _IMU_PARTS.items():
        values = imu[key]
        if np.isnan(values).any():
            covariance = np.zeros(9)
            covariance[0] = -1.0
            setattr(message, f"{part}_covariance", covariance)
        else:
            for axis, value in zip("xyzw", values, strict=False):
                setattr(getattr(message, part), axis, float(value))
    return message


def _joints(joints: JointStates) -> Any:
    message = JointState(name=joints["names"], position=joints["positions"].tolist())
    message.velocity, message.effort = joints["velocities"].tolist(), joints["efforts"].tolist()
    return message


def _segments(segments: Segmentation) -> dict[str, Any]:
    return {
        "class_segment_img": _image(segments["class_segment_img"], "mono8", "<u1", 1),
        "instance_segment_img": _image(segments["instance_segment_img"], "mono16", "<u2", 1),
        "class_ids": String(data=msgspec.json.encode(segments["class_ids"]).decode()),
    }


_IMU_PARTS: dict[str, Literal["orientation_xyzw", "angular_velocity_radps", "linear_acceleration_mps2"]] = {
    "orientation": "orientation_xyzw",
    "angular_velocity": "angular_velocity_radps",
    "linear_acceleration": "linear_acceleration_mps2",
}
_ENCODERS: dict[str, Callable[[Any], dict[str, Any]]] = {
    "image_rgb": lambda pixels: {"": _image(pixels, "rgb8", "u1", 3)},
    "image_rgb_info": lambda model: {"": _camera_info(model)},
    "image_depth": lambda pixels: {"": _image(pixels, "32FC1", "<f4", 1)},
    "image_depth_info": lambda model: {"": _camera_info(model)},
    "image_segment": _segments,
    "image_segment_info": lambda model: {"": _camera_info(model)},
    "laser": lambda scan: {"": _scan(scan)},
    "lidar": lambda lidar: {"": _cloud(lidar)},
    "imu": lambda imu: {"": _imu(imu)},
    "joint_states": lambda joints: {"": _joints(joints)},
}
