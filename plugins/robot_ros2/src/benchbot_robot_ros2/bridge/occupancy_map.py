"""The map of the robot's scene on the topic `map`, as Nav2's map_server publishes it."""

from typing import TYPE_CHECKING, Any

import numpy as np

from benchbot.plugin import BenchbotError, Pose, Scene, occupancy_map
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.robot import BridgedRobot, scene_name
from benchbot_robot_ros2.messages import message_type, pose_message, set_stamp

if TYPE_CHECKING:
    from rclpy.node import Node

FREE, OCCUPIED, UNKNOWN = 0, 100, -1


class MapServer:
    """Publishes the map of the scene, and answers nav_msgs/srv/GetMap with it."""

    def __init__(self, node: "Node", robot: BridgedRobot) -> None:
        from nav_msgs.srv import GetMap

        self._frame = robot.map_frame
        self._publisher = node.create_publisher(message_type("nav_msgs/msg/OccupancyGrid"), "map", qos.latched())
        # The name that Nav2's map_server gives it.
        node.create_service(GetMap, "map_server/map", self._answer)
        self._published: Any = None

    def publish(self, grid: Any, stamp_ns: int) -> None:
        """Publish a map that `read` has read."""
        grid.header.frame_id = self._frame
        set_stamp(grid, stamp_ns)
        grid.info.map_load_time = grid.header.stamp
        self._published = grid
        self._publisher.publish(grid)

    def _answer(self, _: Any, response: Any) -> Any:
        response.map = self._published
        return response


def read(scene: Scene) -> Any:
    """Return a scene's map as a nav_msgs/msg/OccupancyGrid, its cells free, occupied or unknown.

    Raises BenchbotError when the environment has no map of ROS's map_server, or one that cannot be used.
    """
    path, name = occupancy_map.map_file(scene.environment, scene.folder), scene_name(scene)
    try:
        found = occupancy_map.read(path)
    except BenchbotError as error:
        raise BenchbotError(
            f"There is no map of {name} to publish.",
            f"{error.title} {error.why}",
            f"Write one with 'benchbot map {name} --output-location FOLDER', name its YAML file as occupancy_map in "
            "the environment's declaration, and start again; or leave out --map.",
        ) from error
    # A picture begins at the top, a map at its lowest y.
    cells = np.where(found.occupied, OCCUPIED, np.where(found.free, FREE, UNKNOWN)).astype(np.int8)[::-1]
    grid = message_type("nav_msgs/msg/OccupancyGrid")()
    grid.info.height, grid.info.width = cells.shape
    grid.info.resolution = found.resolution_m
    x, y, yaw_rad = found.origin_xyyaw
    grid.info.origin = pose_message(Pose.planar(x, y, yaw_rad))
    grid.data.frombytes(np.ascontiguousarray(cells).tobytes())
    return grid
