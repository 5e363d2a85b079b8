"""The test robot's process, its declaration, and a driver on it."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import Localisation, PlatformSpec, Scene
from benchbot_robot_ros2.driver import Ros2Driver
from benchbot_robot_ros2.names import KEYS

PATIENCE_S = 90.0
MOUNTS = {"camera": ["base_link", 0.1, 0, 0.5, -90, 0, -90], "lidar": ["base_link", 0.05, 0, 0.3, 0, 0, 0]}
"""What `unicycle(mounts=MOUNTS)` publishes: the sensors where they are declared, as most robots do."""
COLLISION = {"ros_topic": "/collision", "ros_type": "std_msgs/msg/Bool"}


class Unicycle:
    """The robot of `unicycle_robot.py`, in a process of its own, started through `prefix`."""

    def __init__(self, *prefix: str, **options: Any) -> None:
        program = Path(__file__).with_name("unicycle_robot.py")
        self.process = subprocess.Popen(
            [*prefix, sys.executable, str(program), json.dumps(options)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"

    def set(self, **options: Any) -> dict[str, Any]:
        """Change options; return the robot's true state."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(options) + "\n")
        self.process.stdin.flush()
        state: dict[str, Any] = json.loads(self.process.stdout.readline())
        return state

    @property
    def state(self) -> dict[str, Any]:
        return self.set()

    def close(self) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait(PATIENCE_S)
        self.process.stdout.close()


@contextmanager
def unicycle(*prefix: str, **options: Any) -> Iterator[Unicycle]:
    robot = Unicycle(*prefix, **options)
    try:
        yield robot
    finally:
        robot.close()


def declaration(**driver: Any) -> dict[str, Any]:
    """The test robot's declaration; `driver` changes its settings.

    A busy machine is no fault of the driver's: what is tried with other times than these names them.
    """
    safety = {"command_timeout_s": 5.0, **driver.pop("safety", {"collision": COLLISION})}
    timing = {"feedback_timeout_s": 5.0, "heartbeat_timeout_s": 5.0, **driver.pop("timing", {})}
    command = {"connection": "api_to_ros", "ros_topic": "/cmd_vel", "ros_type": "geometry_msgs/msg/Twist"}
    return {
        "name": "unicycle",
        "type": "ros2",
        "global_frame": "map",
        "robot_frame": "base_link",
        "poses": ["base_link", "initial_pose", "camera", "lidar"],
        "frames": {"camera": {"xyz": [0.1, 0, 0.5], "rpy_deg": [-90, 0, -90]}, "lidar": {"xyz": [0.05, 0, 0.3]}},
        "camera": {"frame": "camera"},
        "laser": {"frame": "lidar"},
        "footprint": {"radius_m": 0.2},
        "stops_before_contact": True,
        "limits": {
            "linear_mps": [-0.6, 1.0],
            "angular_radps": 1.0,
            "linear_acceleration_mps2": 1.0,
            "angular_acceleration_radps2": 2.0,
        },
        "connections": {
            "image_rgb": {"connection": "ros_to_api", "ros_topic": "/image", "ros_type": "sensor_msgs/msg/Image"},
            "image_rgb_info": {
                "connection": "ros_to_api",
                "ros_topic": "/camera_info",
                "ros_type": "sensor_msgs/msg/CameraInfo",
            },
            "laser": {"connection": "ros_to_api", "ros_topic": "/scan", "ros_type": "sensor_msgs/msg/LaserScan"},
            "poses": {"connection": "ros_to_api"},
            "move_next": command,
            "move_distance": command,
            "move_angle": command,
        },
        "driver": {
            "odometry": {"ros_topic": "/odom", "ros_type": "nav_msgs/msg/Odometry"},
            "return_to_start": {"by": "service", "ros_service": "/reset"},
            "safety": safety,
            "timing": timing,
            **driver,
        },
    }


def arm_declaration(**driver: Any) -> dict[str, Any]:
    """The declaration of the test robot with its arm of two joints and a gripper."""
    robot = declaration(**driver)
    states = {"ros_topic": "/joint_states", "ros_type": "sensor_msgs/msg/JointState"}
    joints = {"ros_topic": "/arm/commands", "ros_type": "std_msgs/msg/Float64MultiArray"}
    gripper = {"ros_topic": "/gripper/commands", "ros_type": "sensor_msgs/msg/JointState"}
    robot["connections"] |= {
        "joint_states": {"connection": "ros_to_api", **states},
        "move_joints": {"connection": "api_to_ros", **joints},
        "move_gripper": {"connection": "api_to_ros", **gripper},
    }
    robot["arm"] = {
        "joints": {
            "shoulder": {"radps": 1.5, "radps2": 3.0, "range_rad": [-2.0, 2.0]},
            "elbow": {"radps": 2.0, "radps2": 4.0},
        },
        "gripper": ["finger_1", "finger_2"],
        "gripper_width_m": [0.0, 0.08],
    }
    return robot


def fleet_declaration(**driver: Any) -> dict[str, Any]:
    """The declaration of several test robots: names of topics and services are relative."""
    robot = declaration(**driver)
    for settings in (*robot["connections"].values(), *_settings(robot["driver"])):
        for key in settings.keys() & KEYS:
            settings[key] = settings[key].removeprefix("/")
    return robot


def _settings(settings: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield settings
    for value in settings.values():
        if isinstance(value, dict):
            yield from _settings(value)


BY_TRUTH = {"by": "topic", "ros_topic": "/truth", "ros_type": "nav_msgs/msg/Odometry"}


def scene(*start_pose: float) -> Scene:
    return Scene({"name": "hall", "variant": 1, "start_pose": list(start_pose or (1, 0, 0, 0, 0, 0, 0))}, Path())


@contextmanager
def driver(robot: dict[str, Any], tmp_path: Path, localisation: Localisation = "ground_truth") -> Iterator[Ros2Driver]:
    platform = Ros2Driver(PlatformSpec(robot, localisation, tmp_path))
    try:
        yield platform
    finally:
        platform.close()


def act(platform: Ros2Driver, robot: dict[str, Any], action: str, **arguments: float | list[float]) -> Outcome:
    return execute(platform, action, arguments, None, MotionConfig.from_robot(robot, "ground_truth"))


def until(condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> None:
    """Wait for something that is sure to happen."""
    deadline_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline_s, "it did not happen"
        time.sleep(0.01)
