"""Checks of the value of each channel against `benchbot.core.channels`: types, shapes, units and ranges."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from benchbot.core.digest import ObservationDigest
from benchbot.core.geometry import Pose
from benchbot.plugins.authoring.conformance.properties import Violation

UNIT_NORM_TOLERANCE = 1e-6
ROTATION_TOLERANCE = 1e-5


def check_value(channel: str, value: Any) -> str:
    """Return a description of a channel's value; raises `Violation` for one that breaks its definition."""
    return CHECKS[channel](value)


def digest(observations: Mapping[str, object]) -> str:
    """Return the digest of every byte of observations."""
    running = ObservationDigest()
    running.update(observations)
    return running.hexdigest()


def _image_rgb(value: Any) -> str:
    return f"uint8 {_array(value, np.uint8, '(H, W, 3)', 'image_rgb').shape}"


def _image_depth(value: Any) -> str:
    depth_m = _array(value, np.float32, "(H, W)", "image_depth")
    finite = depth_m[np.isfinite(depth_m)]
    if finite.size and finite.min() <= 0:
        raise Violation(
            f"The least depth is {finite.min():g} m.",
            "Give planar depth in metres; what is too near is -inf, too far +inf, invalid NaN (REP-117), never 0.",
        )
    if finite.size and finite.max() > 1000:
        raise Violation(f"The greatest depth is {finite.max():g}.", "Give metres, not millimetres (REP-103).")
    return f"float32 {depth_m.shape}, {finite.size / max(depth_m.size, 1):.0%} finite"


def _camera_model(value: Any) -> str:
    keys = ("frame_id", "height", "width", "matrix_intrinsics", "matrix_projection")
    model = _mapping(value, keys, "a camera model")
    k = _array(model["matrix_intrinsics"], np.float64, "(3, 3)", "matrix_intrinsics")
    p = _array(model["matrix_projection"], np.float64, "(3, 4)", "matrix_projection")
    if not (k[0, 0] > 0 and k[1, 1] > 0 and k[2, 2] == 1 and np.all(k[2, :2] == 0) and np.isfinite(k).all()):
        raise Violation(
            f"matrix_intrinsics is {k.tolist()}.", "Give [[fx, s, cx], [0, fy, cy], [0, 0, 1]] in pixels, as float64."
        )
    if not np.isfinite(p).all():
        raise Violation(f"matrix_projection is {p.tolist()}.", "Give finite numbers.")
    if not (0 <= k[0, 2] <= model["width"] and 0 <= k[1, 2] <= model["height"]):
        raise Violation(
            f"The principal point ({k[0, 2]:g}, {k[1, 2]:g}) is not in the {model['width']} x {model['height']} image.",
            "Give pixels, and width and height the right way round.",
        )
    if ("distortion_model" in model) != ("distortion_coefficients" in model):
        raise Violation("Only one of distortion_model and distortion_coefficients is there.", "Give both, or neither.")
    if "distortion_coefficients" in model:
        _array(model["distortion_coefficients"], np.float64, "(5,)", "distortion_coefficients")
    return f"{model['width']} x {model['height']}, fx {k[0, 0]:g}"


def _image_segment(value: Any) -> str:
    segments = _mapping(value, ("class_segment_img", "instance_segment_img", "class_ids"), "image_segment")
    classes = _array(segments["class_segment_img"], np.uint8, "(H, W)", "class_segment_img")
    instances = _array(segments["instance_segment_img"], np.uint16, "(H, W)", "instance_segment_img")
    if classes.shape != instances.shape:
        raise Violation(f"Classes are {classes.shape}, instances {instances.shape}.", "Give both the same size.")
    if np.any(instances // 1000 != classes):
        raise Violation(
            "An instance is not of the class of its pixel.",
            "Number instances as class * 1000 + number within the class.",
        )
    numbers = sorted(segments["class_ids"].values())
    if any(type(number) is not int or not 0 < number < 255 for number in numbers) or len({*numbers}) != len(numbers):
        raise Violation(
            f"class_ids has the numbers {numbers}.", "Number classes from 1 to 254, each once; 0 is unlabelled."
        )
    unnamed = set(np.unique(classes).tolist()) - {0, *numbers}
    if unnamed:
        raise Violation(f"The classes {sorted(unnamed)} have no name in class_ids.", "Name every class that is seen.")
    return f"{classes.shape}, {len(numbers)} classes"


def _laser(value: Any) -> str:
    laser = _mapping(value, ("scans", "range_min", "range_max"), "laser")
    scans = _array(laser["scans"], np.float64, "(N, 2)", "scans")
    ranges_m, angles_rad = scans.T
    _require_angles(angles_rad, "The angles of scans")
    _require_ranges(ranges_m, float(laser["range_min"]), float(laser["range_max"]), "scans")
    return f"{len(scans)} beams"


def _lidar(value: Any) -> str:
    lidar = _mapping(value, ("frame_id", "ranges_m", "elevations_rad", "azimuths_rad"), "lidar")
    ranges_m = _array(lidar["ranges_m"], np.float32, "(R, N)", "ranges_m")
    elevations = _array(lidar["elevations_rad"], np.float64, "(R,)", "elevations_rad")
    azimuths = _array(lidar["azimuths_rad"], np.float64, "(N,)", "azimuths_rad")
    if ranges_m.shape != (elevations.size, azimuths.size):
        raise _wrong_shape("ranges_m", ranges_m, f"({elevations.size}, {azimuths.size})")
    _require_angles(azimuths, "azimuths_rad")
    if np.any(np.abs(elevations) > math.pi / 2):
        raise Violation("elevations_rad are beyond a right angle.", "Give radians above the x-y plane.")
    _require_ranges(ranges_m, 0.0, math.inf, "ranges_m")
    return f"{ranges_m.shape[0]} rings of {ranges_m.shape[1]} beams"


def _imu(value: Any) -> str:
    keys = ("orientation_xyzw", "angular_velocity_radps", "linear_acceleration_mps2")
    imu = _mapping(value, keys, "imu")
    orientation, *vectors = (
        _array(imu[key], np.float64, shape, key) for key, shape in zip(keys, ("(4,)", "(3,)", "(3,)"), strict=True)
    )
    if not np.isnan(orientation).all():
        _require_unit(orientation, "orientation_xyzw")
    if any(np.isinf(vector).any() for vector in vectors):
        raise Violation("A measurement is infinite.", "NaN is what the device does not measure.")
    return "a measurement"


def _joint_states(value: Any) -> str:
    joints = _mapping(value, ("names", "positions", "velocities", "efforts"), "joint_states")
    names = joints["names"]
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or len({*names}) < len(names):
        raise Violation(f"names is {names!r}.", "Give a list of different names.")
    for key in ("positions", "velocities", "efforts"):
        values = _array(joints[key], np.float64, "(N,)", key)
        if len(values) != len(names):
            raise _wrong_shape(key, values, f"({len(names)},)")
        if not np.isfinite(values).all():
            raise Violation(f"{key} is {values.tolist()}.", "Give finite numbers.")
    return ", ".join(names)


def _poses(value: Any) -> str:
    if not isinstance(value, Mapping) or not value:
        raise Violation(f"poses is a {type(value).__name__}.", "Give a mapping of frame to pose.")
    for frame, given in value.items():
        keys = ("parent_frame", "translation_xyz", "rotation_rpy", "rotation_xyzw")
        pose = _mapping(given, keys, f"the pose of '{frame}'")
        translation = _array(pose["translation_xyz"], np.float64, "(3,)", f"translation_xyz of '{frame}'")
        rpy = _array(pose["rotation_rpy"], np.float64, "(3,)", f"rotation_rpy of '{frame}'")
        xyzw = _array(pose["rotation_xyzw"], np.float64, "(4,)", f"rotation_xyzw of '{frame}'")
        if not np.isfinite(translation).all():
            raise Violation(f"The translation of '{frame}' is {translation.tolist()}.", "Give finite metres.")
        _require_unit(xyzw, f"rotation_xyzw of '{frame}'")
        x, y, z, w = xyzw.tolist()
        from_rpy = Pose.from_xyz_rpy_deg((0, 0, 0), np.degrees(rpy))
        if not np.allclose(from_rpy.matrix(), Pose(rotation_xyzw=(x, y, z, w)).matrix(), atol=ROTATION_TOLERANCE):
            raise Violation(
                f"rotation_rpy and rotation_xyzw of '{frame}' are different rotations.",
                "Give roll, pitch, yaw about the static x, y and z axes in radians, and the quaternion as x, y, z, w; "
                "benchbot.core.geometry.Pose.record does it.",
            )
    return ", ".join(value)


def _goal(value: Any) -> str:
    if isinstance(value, str) and value:
        return repr(value)
    if isinstance(value, Mapping):
        goal = _mapping(value, ("object", "place"), "goal")
        return f"{goal['object']!r} to {goal['place']!r}"
    goal = _array(value, np.float64, "(2,)", "goal")
    return f"({goal[0]:g}, {goal[1]:g}) m"


CHECKS: dict[str, Callable[[Any], str]] = {
    "image_rgb": _image_rgb,
    "image_rgb_info": _camera_model,
    "image_depth": _image_depth,
    "image_depth_info": _camera_model,
    "image_segment": _image_segment,
    "image_segment_info": _camera_model,
    "laser": _laser,
    "lidar": _lidar,
    "imu": _imu,
    "joint_states": _joint_states,
    "poses": _poses,
    "goal": _goal,
}


def _array(value: Any, dtype: type, shape: str, name: str) -> Any:
    """Return the array; `shape` is as in docs: numbers are fixed, letters are free."""
    if not isinstance(value, np.ndarray):
        raise Violation(f"{name} is a {type(value).__name__}.", f"Give a numpy array, {np.dtype(dtype)} {shape}.")
    if value.dtype != dtype:
        raise Violation(f"{name} is {value.dtype}.", f"Give {np.dtype(dtype)} {shape}.")
    sizes = [part for part in shape.strip("()").replace(" ", "").split(",") if part]
    fits = len(sizes) == value.ndim and all(
        part.isalpha() or int(part) == size for part, size in zip(sizes, value.shape, strict=True)
    )
    if not fits or value.size == 0:
        raise _wrong_shape(name, value, shape)
    return value


def _wrong_shape(name: str, value: Any, shape: str) -> Violation:
    return Violation(f"{name} has the shape {value.shape}.", f"Give {shape}.")


def _mapping(value: Any, keys: Iterable[str], name: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise Violation(f"{name} is a {type(value).__name__}.", f"Give a mapping with {', '.join(keys)}.")
    missing = [key for key in keys if key not in value]
    if missing:
        raise Violation(f"{name} lacks {', '.join(missing)}.", f"Give a mapping with {', '.join(keys)}.")
    return value


def _require_angles(angles_rad: Any, name: str) -> None:
    # Rounding errors at the ends of the interval are let pass; degrees are not.
    if not np.all((angles_rad >= -math.pi - 1e-6) & (angles_rad < math.pi + 1e-6)):
        raise Violation(f"{name} are not all in [-pi, pi).", "Give radians, counter-clockwise from +x.")


def _require_ranges(ranges_m: Any, low_m: float, high_m: float, name: str) -> None:
    if not 0 <= low_m < high_m:
        raise Violation(f"range_min is {low_m:g}, range_max {high_m:g}.", "Give metres, the smaller one first.")
    finite = ranges_m[np.isfinite(ranges_m)]
    if np.any(finite < low_m) or np.any(finite > high_m) or np.any(finite <= 0):
        raise Violation(
            f"{name} has ranges from {finite.min():g} to {finite.max():g} m, of ({low_m:g}, {high_m:g}).",
            "What is too near is -inf, too far +inf, invalid NaN (REP-117).",
        )


def _require_unit(xyzw: Any, name: str) -> None:
    norm = float(np.linalg.norm(xyzw))
    if not abs(norm - 1) <= UNIT_NORM_TOLERANCE:
        raise Violation(f"{name} has the norm {norm:g}.", "Give a unit quaternion, in the order x, y, z, w.")
