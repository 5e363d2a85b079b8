"""The observation space, derived from declarations, and the encoding of observations as its elements.

The space is one flat Dict of arrays, since most learning libraries read no nested ones. Values that are constant within
a scene (camera models, beam angles, class numbers) are not part of it: see `constants`.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from benchbot.core.channels import OBSERVATIONS
from benchbot.core.errors import BenchbotError
from benchbot.core.lidar import elevations_deg

Arrays = dict[str, NDArray[Any]]

# Nothing that BenchBot drives in is larger; Gymnasium asks for finite bounds.
MAX_POSITION_M = 1000.0
# Ranges of common MEMS devices, +-2000 degrees/s and +-16 g, at which they saturate.
MAX_TURN_RADPS = 35.0
MAX_ACCELERATION_MPS2 = 160.0
# More than any joint of a service robot turns (rad), is driven at (rad/s) or holds (N m).
MAX_JOINT = 1000.0
JOINT_PARTS = ("positions", "velocities", "efforts")
INFO_SUFFIX = "_info"


def observation_space(channels: Sequence[str], robot: Mapping[str, Any]) -> spaces.Dict:
    """Return the space of a task's channels on a robot; raises BenchbotError when its declaration lacks a size.

    Reads the robot's `camera` {width, height, range_m}, `laser` {beams, range_m}, `lidar` {elevations_deg, beams,
    range_m} and `poses`.
    """
    boxes: dict[str, spaces.Space[Any]] = {}
    for channel in channels:
        if not channel.endswith(INFO_SUFFIX):
            try:
                boxes |= _boxes(channel, robot)
            except (KeyError, TypeError, ValueError, IndexError) as error:
                raise BenchbotError(
                    f"The robot '{robot.get('name')}' does not say how large its '{channel}' is.",
                    f"Its declaration lacks something, or has it in another form: {type(error).__name__}: {error}.",
                    "Declare in it, as the task needs them: 'camera: {width, height, range_m: [m, m]}', "
                    "'laser: {beams, range_m: [m, m]}', 'lidar: {elevations_deg: [...], beams, range_m: [m, m]}'.",
                ) from error
    if not boxes:
        raise BenchbotError(
            "The task shows nothing that can be learnt from.",
            f"Its observations are: {', '.join(channels)}.",
            "Choose a task with pictures, laser, lidar, imu or poses.",
        )
    return spaces.Dict(boxes)


def encode(observations: Mapping[str, Any], space: spaces.Dict) -> Arrays:
    """Return a platform's observations as an element of the space; raises BenchbotError when they do not fit.

    Depth and ranges of laser and lidar stay in metres: 0 is "nothing measured" (NaN, or nearer than the sensor's
    range), the upper bound is "as far or farther" (+inf).
    """
    arrays: Arrays = {}
    for channel, value in observations.items():
        if not channel.endswith(INFO_SUFFIX):
            arrays |= _flattened(channel, value)
    return {name: _fitted(name, array, space.spaces.get(name)) for name, array in arrays.items()}


def constants(observations: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values that do not change within a scene: camera models, `class_ids`, and the scanners' angles.

    They are `laser_angles_rad` (N,), `lidar_elevations_rad` (R,) and `lidar_azimuths_rad` (N,).
    """
    found = {name: dict(value) for name, value in observations.items() if name.endswith(INFO_SUFFIX)}
    if "image_segment" in observations:
        found["class_ids"] = dict(observations["image_segment"]["class_ids"])
    if "laser" in observations:
        found["laser_angles_rad"] = observations["laser"]["scans"][:, 1].copy()
    if "lidar" in observations:
        for name in ("elevations_rad", "azimuths_rad"):
            found[f"lidar_{name}"] = observations["lidar"][name].copy()
    return found


def resized(robot: Mapping[str, Any], width: int, height: int) -> dict[str, Any]:
    """Return the declaration of a robot with pictures of another size, square pixels and the same view sideways."""
    try:
        camera = dict(robot["camera"])
        scale = width / camera["width"]
        camera["cx"], camera["cy"] = camera["cx"] * scale, camera["cy"] * height / camera["height"]
        camera["fx"] = camera["fy"] = camera["fx"] * scale
    except (KeyError, TypeError) as error:
        raise BenchbotError(
            f"The pictures of the robot '{robot.get('name')}' cannot be resized.",
            f"Its declaration has no complete camera: {type(error).__name__}: {error}.",
            "Leave image_size out, or declare the camera's width, height, fx, fy, cx and cy.",
        ) from error
    return {**robot, "camera": {**camera, "width": width, "height": height}}


def _boxes(channel: str, robot: Mapping[str, Any]) -> dict[str, spaces.Box]:
    match channel:
        case "image_rgb" | "image_depth" | "image_segment":
            camera = robot["camera"]
            shape = (int(camera["height"]), int(camera["width"]))
            if channel == "image_rgb":
                return {channel: spaces.Box(0, 255, (*shape, 3), np.uint8)}
            if channel == "image_depth":
                return {channel: spaces.Box(0.0, float(camera["range_m"][1]), shape)}
            return {
                "class_segment_img": spaces.Box(0, 255, shape, np.uint8),
                "instance_segment_img": spaces.Box(0, 65535, shape, np.uint16),
            }
        case "laser":
            return {channel: spaces.Box(0.0, float(robot["laser"]["range_m"][1]), (int(robot["laser"]["beams"]),))}
        case "lidar":
            lidar = robot["lidar"]
            shape = (len(elevations_deg(lidar["elevations_deg"])), int(lidar["beams"]))
            return {channel: spaces.Box(0.0, float(lidar["range_m"][1]), shape)}
        case "imu":
            vectors = {"angular_velocity_radps": MAX_TURN_RADPS, "linear_acceleration_mps2": MAX_ACCELERATION_MPS2}
            boxes = {f"imu_{name}": spaces.Box(-bound, bound, (3,)) for name, bound in vectors.items()}
            return {"imu_orientation_xyzw": spaces.Box(-1.0, 1.0, (4,)), **boxes}
        case "joint_states":
            count = len(robot["arm"]["joints"]) + 1
            return {f"joint_{name}": spaces.Box(-MAX_JOINT, MAX_JOINT, (count,)) for name in JOINT_PARTS}
        case "poses":
            high = np.array([MAX_POSITION_M] * 3 + [1.0] * 4, np.float32)
            # The contract of `poses`: the frames that the robot declares, and the camera's optical one.
            return {f"pose_{frame}": spaces.Box(-high, high) for frame in {*robot["poses"], "camera"}}
        case "goal":
            return {channel: spaces.Box(-MAX_POSITION_M, MAX_POSITION_M, (2,))}
    raise ValueError(f"no such channel: {channel}; known: {', '.join(OBSERVATIONS)}")


def _flattened(channel: str, value: Any) -> Arrays:
    match channel:
        case "image_segment":
            return {name: value[name] for name in ("class_segment_img", "instance_segment_img")}
        case "laser":
            return {channel: value["scans"][:, 0]}
        case "lidar":
            return {channel: value["ranges_m"]}
        case "imu":
            return {f"imu_{name}": array for name, array in value.items()}
        case "joint_states":
            return {f"joint_{name}": value[name] for name in JOINT_PARTS}
        case "poses":
            keys = ("translation_xyz", "rotation_xyzw")
            return {f"pose_{frame}": np.concatenate([pose[key] for key in keys]) for frame, pose in value.items()}
        case "goal" if not isinstance(value, np.ndarray):
            raise BenchbotError(
                "The goal of this task is no observation that can be learnt from.",
                f"It is in words: {value!r}.",
                "Choose a task whose goal is a point, or train without a goal.",
            )
    return {channel: value}


def fitted(name: str, rows: NDArray[Any] | None, box: spaces.Space[Any]) -> NDArray[Any]:
    """Return many arrays (N, …) with the type of their box and values within its bounds."""
    if not isinstance(box, spaces.Box) or rows is None or rows.shape[1:] != box.shape:
        _misfits(name, None if rows is None else rows.shape[1:], box)
    return _within(rows, box)


def _fitted(name: str, array: NDArray[Any], box: spaces.Space[Any] | None) -> NDArray[Any]:
    """Return an array with the type of its box and values within the box's bounds."""
    if not isinstance(box, spaces.Box) or array.shape != box.shape:
        _misfits(name, array.shape, box)
    return _within(array, box)


def _misfits(name: str, shape: tuple[int, ...] | None, box: spaces.Space[Any] | None) -> NoReturn:
    declared = "nothing of that name" if box is None else f"the shape {box.shape}"
    raise BenchbotError(
        f"The simulator's '{name}' does not fit the robot's declaration.",
        f"It has the shape {shape}, and the declaration promises {declared}.",
        "Mend the robot's camera, laser, lidar or poses, or leave image_size out if the simulator cannot resize.",
    )


def _within(array: NDArray[Any], box: spaces.Box) -> NDArray[Any]:
    if box.dtype.kind == "u":
        return array.astype(box.dtype, copy=False)
    if not np.isfinite(array).all():
        array = np.nan_to_num(array, nan=0.0, posinf=np.inf, neginf=0.0)
    within: NDArray[Any] = np.minimum(np.maximum(array, box.low), box.high).astype(box.dtype)
    return within
