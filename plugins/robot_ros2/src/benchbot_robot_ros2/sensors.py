"""CameraInfo, LaserScan, Imu and JointState messages, as observations."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import CameraModel, InertialMeasurement, JointStates, LaserScan


def camera_model(message: Any) -> CameraModel:
    """Return a sensor_msgs/msg/CameraInfo as the channels `*_info` have it; its pictures must be rectified.

    Distortion (`d`) is not looked at: an observation's camera is a pinhole, as `image_rect` topics have it.
    Raises ValueError when the camera is not calibrated, or when its model is not that of whole, unbinned pictures.
    """
    intrinsics, projection = np.array(message.k, np.float64), np.array(message.p, np.float64)
    if not (np.isfinite(intrinsics).all() and np.isfinite(projection).all()):
        raise ValueError("its matrices k and p hold numbers that are not finite")
    if not (intrinsics[0] > 0 and projection[0] > 0):
        raise ValueError("the camera is not calibrated: the focal length in its matrix k or p is zero")
    if not (message.height and message.width):
        raise ValueError(f"it is the model of an empty picture: {message.width} x {message.height} pixels")
    if message.binning_x > 1 or message.binning_y > 1:
        raise ValueError(
            f"its pictures are binned {message.binning_x} x {message.binning_y}, and its matrices are those of the "
            "whole sensor: publish pictures that are not binned"
        )
    region = message.roi
    if (region.width, region.height) not in ((0, 0), (message.width, message.height)):
        raise ValueError(
            f"its pictures are a region of {region.width} x {region.height} pixels, and its matrices are those of the "
            "whole sensor: publish whole pictures"
        )
    return {
        "frame_id": message.header.frame_id,
        "height": int(message.height),
        "width": int(message.width),
        "matrix_intrinsics": intrinsics.reshape(3, 3),
        "matrix_projection": projection.reshape(3, 4),
    }


def laser(message: Any) -> LaserScan:
    """Return a sensor_msgs/msg/LaserScan as the channel `laser` has it, one row per range, in the message's order.

    As in REP-117, +inf is nothing within range, -inf is too near, NaN is invalid. Many scanners' drivers write a number
    outside [range_min, range_max] instead: one below becomes -inf, one above +inf.
    Raises ValueError when the message has no ranges, or limits or angles that are none.
    """
    ranges_m = np.array(message.ranges, np.float64)
    nearest_m, farthest_m = float(message.range_min), float(message.range_max)
    if not len(ranges_m):
        raise ValueError("it has no ranges")
    if not 0 <= nearest_m < farthest_m:
        raise ValueError(f"its limits range_min = {nearest_m:g} and range_max = {farthest_m:g} leave no range")
    first_rad, step_rad = float(message.angle_min), float(message.angle_increment)
    if not (math.isfinite(first_rad) and math.isfinite(step_rad) and (step_rad or len(ranges_m) == 1)):
        raise ValueError(f"angle_min = {first_rad:g} and angle_increment = {step_rad:g} give its ranges no directions")
    finite = np.isfinite(ranges_m)
    ranges_m[finite & (ranges_m < nearest_m)] = -np.inf
    ranges_m[finite & (ranges_m > farthest_m)] = np.inf
    angles_rad = first_rad + step_rad * np.arange(len(ranges_m), dtype=np.float64)
    return {
        "scans": np.stack([ranges_m, wrapped(angles_rad)], 1),
        "range_min": nearest_m,
        "range_max": farthest_m,
    }


def wrapped(angles_rad: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the same directions in [-pi, pi)."""
    outside = (angles_rad < -np.pi) | (angles_rad >= np.pi)
    # Only what is outside, since wrapping rounds.
    angles_rad[outside] = (angles_rad[outside] + np.pi) % (2 * np.pi) - np.pi
    # A scan from -pi says so in float32, whose nearest number lies below -pi and has just wrapped to the other end.
    angles_rad[angles_rad > np.pi - np.spacing(np.float32(np.pi))] = -np.pi
    return angles_rad


def imu(message: Any) -> InertialMeasurement:
    """Return a sensor_msgs/msg/Imu as the channel `imu` has it; NaN is what the device does not measure.

    It does not where the first element of the covariance is -1 (Imu.msg).
    Raises ValueError when the orientation is no rotation.
    """
    turn, rate, pull = message.orientation, message.angular_velocity, message.linear_acceleration
    orientation = _measured((turn.x, turn.y, turn.z, turn.w), message.orientation_covariance)
    length = float(np.linalg.norm(orientation))
    if message.orientation_covariance[0] != -1 and not abs(length - 1) < 0.01:
        raise ValueError(
            f"its orientation is no rotation: the quaternion's length is {length:g}. A device that measures none says "
            "so by -1 in orientation_covariance[0]"
        )
    return {
        "orientation_xyzw": orientation,
        "angular_velocity_radps": _measured((rate.x, rate.y, rate.z), message.angular_velocity_covariance),
        "linear_acceleration_mps2": _measured((pull.x, pull.y, pull.z), message.linear_acceleration_covariance),
    }


def _measured(values: Sequence[float], covariance: Sequence[float]) -> npt.NDArray[np.float64]:
    return np.full(len(values), np.nan) if covariance[0] == -1 else np.array(values, np.float64)


def joint_states(message: Any) -> JointStates:
    """Return all joints of a sensor_msgs/msg/JointState in its order; NaN is what it leaves out.

    Which of them `joint_states` has, the key `arm` of the robot says: `Arm.select`. Raises ValueError when it has no
    joints, two of one name, or another number of values than of names.
    """
    names = list(message.name)
    if not names or len({*names}) < len(names):
        raise ValueError(f"its joints are {', '.join(names)}: two have one name" if names else "it has no joints")
    values = []
    for key in ("position", "velocity", "effort"):
        told = np.array(getattr(message, key), np.float64)
        # JointState.msg: what is not known is left empty.
        if len(told) not in (0, len(names)) or (key == "position" and not (len(told) and np.isfinite(told).all())):
            raise ValueError(f"its {len(names)} joints have {len(told)} values of {key}, or some that are not finite")
        values.append(told if len(told) else np.full(len(names), np.nan))
    return {"names": names, "positions": values[0], "velocities": values[1], "efforts": values[2]}
