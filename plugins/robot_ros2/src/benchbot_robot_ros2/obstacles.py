"""Obstacles: what laser, lidar or depth camera saw last, from where the robot is now."""

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import BenchbotError, MotionConfig, Pose
from benchbot_robot_ros2.clearance import obstacle_points
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.streams import Sample

Points = NDArray[np.float64]
_NONE: Points = np.empty((0, 2))


def check_declared(robot: Ros2Robot, motion: MotionConfig) -> None:
    """Raise BenchbotError when a robot shall stop before contact, and its declaration does not let it see."""
    if not motion.stops_before_contact:
        return
    channels = robot.settings.safety.obstacles
    lacking = [f"connections.{name}" for name in channels if name not in robot.observations]
    scanners = {"laser": robot.laser_frame, "lidar": robot.lidar_frame}
    lacking += [f"{name}.frame" for name, frame in scanners.items() if name in channels and frame is None]
    if "image_depth" in channels:
        lacking += [] if robot.camera_frame else ["camera.frame"]
        lacking += [] if "image_depth_info" in robot.observations else ["connections.image_depth_info"]
    if lacking or not channels:
        raise BenchbotError(
            f"The robot '{robot.name}' cannot see what is ahead of it.",
            "It stops before contact (stops_before_contact: true), and its declaration lacks "
            f"{' and '.join(lacking) or 'an entry in driver.safety.obstacles'}.",
            "Declare it, let driver.safety.obstacles name the channels that the robot has, or, for a robot that stops "
            "by itself, stops_before_contact: false.",
        )


class Obstacles:
    """The obstacles in the newest message of each declared channel; each message is processed once."""

    def __init__(self, robot: ConnectedRobot) -> None:
        self._robot = robot
        self._seen: dict[str, tuple[Sample, Points]] = {}

    def points_xy(self, ahead: Pose) -> Points:
        """Return all obstacles (N, 2) in metres in the base frame of now, `ahead` of that of the newest odometry.

        Raises BenchbotError when a message is malformed or a frame is unknown.
        """
        return np.concatenate(
            [_NONE, *(self._points(name, ahead) for name in self._robot.robot.settings.safety.obstacles)]
        )

    def _points(self, name: str, ahead: Pose) -> Points:
        channel = self._robot.channels[name]
        sample = channel.streams[""].newest
        if sample is None:
            return _NONE
        if name not in self._seen or self._seen[name][0] is not sample:
            self._seen[name] = (sample, self._work_out(name, sample))
        # The robot has moved on since the picture was taken.
        back = (self._robot.localisation.way(sample.stamp_ns) @ ahead).inverse().matrix()
        points = self._seen[name][1]
        return points @ back[:2, :2].T + back[:2, 3]

    def _work_out(self, name: str, sample: Sample) -> Points:
        channel = self._robot.channels[name]
        seen = channel.decode({"": sample.message})
        robot = self._robot.robot
        frame = {"laser": robot.laser_frame, "lidar": robot.lidar_frame}.get(name, robot.camera_frame)
        mount = self._robot.mount(frame or robot.base_frame)
        intrinsics = None
        if name == "image_depth":
            model = self._robot.channels["image_depth_info"]
            newest = model.streams[""].newest
            if newest is None:
                return _NONE
            intrinsics = model.decode({"": newest.message})["matrix_intrinsics"]
        return obstacle_points(seen, mount, robot.footprint.z_m, intrinsics)
