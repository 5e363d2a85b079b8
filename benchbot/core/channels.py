"""The one definition of what can be observed and which actions exist: names, shapes, units, frames.

Names, shapes and units are those of BenchBot v2, so that its solutions run unchanged.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NotRequired, TypedDict

from benchbot.core.errors import BenchbotError, FailureClass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class CameraModel(TypedDict):
    """The value of `image_rgb_info`, `image_depth_info` and `image_segment_info`."""

    frame_id: str
    height: int
    width: int
    matrix_intrinsics: "NDArray[np.float64]"
    matrix_projection: "NDArray[np.float64]"
    distortion_model: NotRequired[str]
    distortion_coefficients: NotRequired["NDArray[np.float64]"]


class Segmentation(TypedDict):
    """The value of `image_segment`."""

    class_segment_img: "NDArray[np.uint8]"
    instance_segment_img: "NDArray[np.uint16]"
    class_ids: dict[str, int]


class LaserScan(TypedDict):
    """The value of `laser`."""

    scans: "NDArray[np.float64]"
    range_min: float
    range_max: float


class LidarScan(TypedDict):
    """The value of `lidar`."""

    frame_id: str
    ranges_m: "NDArray[np.float32]"
    elevations_rad: "NDArray[np.float64]"
    azimuths_rad: "NDArray[np.float64]"


class InertialMeasurement(TypedDict):
    """The value of `imu`."""

    orientation_xyzw: "NDArray[np.float64]"
    angular_velocity_radps: "NDArray[np.float64]"
    linear_acceleration_mps2: "NDArray[np.float64]"


class FramePose(TypedDict):
    """The value of one frame in `poses`."""

    parent_frame: str
    translation_xyz: "NDArray[np.float64]"
    rotation_rpy: "NDArray[np.float64]"
    rotation_xyzw: "NDArray[np.float64]"


class JointStates(TypedDict):
    """The value of `joint_states`."""

    names: list[str]
    positions: "NDArray[np.float64]"
    velocities: "NDArray[np.float64]"
    efforts: "NDArray[np.float64]"


class FetchGoal(TypedDict):
    """The value of `goal` where an object is to be brought to a place: the classes of both."""

    object: str
    place: str


class Observations(TypedDict, total=False):
    """Values of channels by name, as far as they were asked for; `OBSERVATIONS` has their shapes, units and frames.

    A platform with channels of its own declares them in a subclass: `class Mine(Observations, total=False): sonar: …`.
    """

    image_rgb: "NDArray[np.uint8]"
    image_rgb_info: CameraModel
    image_depth: "NDArray[np.float32]"
    image_depth_info: CameraModel
    image_segment: Segmentation
    image_segment_info: CameraModel
    laser: LaserScan
    lidar: LidarScan
    imu: InertialMeasurement
    joint_states: JointStates
    poses: dict[str, FramePose]
    goal: "NDArray[np.float64] | str | FetchGoal"


@dataclass(frozen=True)
class Observation:
    """A channel that a robot may offer and a task may ask for."""

    name: str
    value: str
    description: str


@dataclass(frozen=True)
class Action:
    """Something a solution may ask the robot to do; `argument` is its one keyword, if it has one.

    The argument is a number where `size` is None, else a list of so many numbers, 0 for as many as the arm has joints.
    """

    name: str
    argument: str | None
    unit: str
    description: str
    size: int | None = None


_INFO = (
    "{frame_id, height, width, matrix_intrinsics: float64 (3, 3), matrix_projection: float64 (3, 4)}; a distorted "
    "picture's also has {distortion_model: 'plumb_bob', distortion_coefficients: float64 (5,), k1 k2 p1 p2 k3}"
)

OBSERVATIONS: dict[str, Observation] = {
    channel.name: channel
    for channel in (
        Observation("image_rgb", "uint8 (H, W, 3)", "colour image, sRGB, channels in the order R, G, B"),
        Observation("image_rgb_info", _INFO, "pinhole camera model, in pixels, centres at integers (as ROS, OpenCV)"),
        Observation(
            "image_depth",
            "float32 (H, W)",
            "metres along the optical axis (planar Z, REP-118); NaN is invalid, +inf is too far, -inf too near",
        ),
        Observation("image_depth_info", _INFO, "pinhole camera model of image_depth, in pixels"),
        Observation(
            "image_segment",
            "{class_segment_img: uint8 (H, W), instance_segment_img: uint16 (H, W), class_ids: {name: id}}",
            "perfect segmentation; class 0 is unlabelled; instance = class * 1000 + number within the class",
        ),
        Observation("image_segment_info", _INFO, "pinhole camera model of image_segment, in pixels"),
        Observation(
            "laser",
            "{scans: float64 (N, 2), range_min: float, range_max: float}",
            "a row is [range in metres, angle in radians in [-pi, pi), CCW from the scanner's +x]",
        ),
        Observation(
            "lidar",
            "{frame_id, ranges_m: float32 (R, N), elevations_rad: float64 (R,), azimuths_rad: float64 (N,)}",
            "a row is a ring of a multi-beam lidar; elevations are above the x-y plane of its frame, azimuths in "
            "[-pi, pi), CCW from its +x; NaN is invalid, +inf is too far, -inf too near (REP-117)",
        ),
        Observation(
            "imu",
            "{orientation_xyzw: float64 (4,), angular_velocity_radps: float64 (3,), "
            "linear_acceleration_mps2: float64 (3,)}",
            "inertial measurement in the device's frame, orientation from it to a frame with z up; the acceleration at "
            "rest is gravity's reaction, +9.81 upwards (REP-145); NaN is what the device does not measure",
        ),
        Observation(
            "joint_states",
            "{names: [text], positions: float64 (N,), velocities: float64 (N,), efforts: float64 (N,)}",
            "the joints of the arm from its base on, in rad, rad/s and N m, then the gripper: the distance between its "
            "fingers, how fast it grows, and the force that they close with, in m, m/s and N; NaN is a velocity or an "
            "effort that the robot does not measure",
        ),
        Observation(
            "poses",
            "{frame: {parent_frame, translation_xyz: float64 (3,), rotation_rpy: float64 (3,), "
            "rotation_xyzw: float64 (4,)}}",
            "poses of the robot's frames, of 'initial_pose' and of 'camera' (the optical frame, z forwards, that depth "
            "projects back from) in the map frame, metres and radians",
        ),
        Observation(
            "goal",
            "float64 (2,), or text, or {object: text, place: text}",
            "where to go in an episode: metres from the start pose, x forward, y to the left; or the name of a class; "
            "or the class of the object to fetch, and that of the place to put it down on",
        ),
    )
}

GIVEN_BY_EPISODES = frozenset({"goal"})
"""Channels that come with the episode: a robot need not offer them."""

ACTIONS: dict[str, Action] = {
    action.name: action
    for action in (
        Action("move_next", None, "", "drive to the next pose of the environment's trajectory"),
        Action("move_distance", "distance", "m", "drive straight ahead; negative drives backwards"),
        Action("move_angle", "angle", "deg", "turn on the spot; positive is counter-clockwise"),
        Action(
            "move_sideways", "distance", "m", "drive straight to the left, on a holonomic base; negative to the right"
        ),
        Action(
            "move_joints",
            "positions",
            "rad",
            "move all joints of the arm at once, in the order of joint_states, to these positions",
            size=0,
        ),
        Action(
            "move_end_effector",
            "pose",
            "m, unit quaternion",
            "move the arm until the point between its fingers has the pose [x, y, z, qx, qy, qz, qw] in the robot's "
            "frame: on a straight line where the joints can follow one, else evenly in all joints",
            size=7,
        ),
        Action("move_gripper", "width", "m", "open or close the gripper until its fingers are so far apart, or hold"),
    )
}

MANIPULATION = frozenset({"move_joints", "move_end_effector", "move_gripper"})
"""Actions of an arm, which its platform carries out as `Manipulator.manipulate`."""


def check_argument(action: str, arguments: Mapping[str, object]) -> None:
    """Raise BenchbotError for arguments that an action does not have, and for a value that is no finite number."""
    known = ACTIONS[action].argument
    wrong = [name for name in arguments if name != known]
    if wrong:
        raise BenchbotError(
            f"'{action}' has no argument '{wrong[0]}'.",
            f"Its argument: {known or 'none'}.",
            f"Call it like this: {action}" + (f" with {{'{known}': 1.0}}" if known else " with no argument"),
            failure=FailureClass.AGENT,
        )
    size, unit = ACTIONS[action].size, ACTIONS[action].unit
    if size is not None:
        _check_numbers(action, known, arguments.get(known or ""))
        return
    value = arguments.get(known, 0.0) if known else 0.0
    if not _is_number(value):
        raise BenchbotError(
            f"The {known} of '{action}' is {value!r}.",
            f"It must be a finite number, in {unit}.",
            "Pass a number, for example 0.5.",
            failure=FailureClass.AGENT,
        )


def _check_numbers(action: str, argument: str | None, value: object) -> None:
    size = ACTIONS[action].size
    right = (
        isinstance(value, list | tuple)
        and all(map(_is_number, value))
        and len(value) in ((size,) if size else range(1, 100))
    )
    if not right:
        many = f"{size}" if size else "as many as the arm has joints"
        raise BenchbotError(
            f"The {argument} of '{action}' is {str(value)[:80]}.",
            f"It must be a list of finite numbers, {many}, in {ACTIONS[action].unit}.",
            f"Pass a list, for example {argument}=[{', '.join(['0.1'] * (size or 6))}].",
            failure=FailureClass.AGENT,
        )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
