"""The map of the robot's scene on the topic `map`, as Nav2's map_server publishes it."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image

from benchbot.plugin import BenchbotError, Scene
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.robot import BridgedRobot, scene_name
from benchbot_robot_ros2.messages import message_type, set_stamp

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

    The map is the file of ROS's map_server that the environment names as `occupancy_map`, or `maps/NAME_VARIANT.yaml`
    beside the folder of its declaration; https://docs.nav2.org/configuration/packages/configuring-map-server.html.
    Raises BenchbotError when there is none, or it is of a mode other than trinary.
    """
    name = scene_name(scene)
    beside = f"../maps/{name.replace(':', '_')}.yaml"
    path = scene.folder / str(scene.environment.get("occupancy_map", beside))
    try:
        about = yaml.safe_load(path.read_text("utf-8"))
        with Image.open(path.parent / str(about["image"])) as image:
            return _grid(about, np.asarray(image.convert("L"), float) / 255)
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise BenchbotError(
            f"There is no map of {name} to publish.",
            f"{path} cannot be read as a map of ROS's map_server: {type(error).__name__}: {error}.",
            f"Write one with 'benchbot map {name} --output-location FOLDER', name its YAML file as occupancy_map in "
            "the environment's declaration, and start again; or leave out --map.",
        ) from error


def _grid(about: dict[str, Any], grey: npt.NDArray[np.float64]) -> Any:
    """Return the map of a picture; raises ValueError, KeyError or TypeError for what map_server's YAML cannot say."""
    if about.get("mode", "trinary") != "trinary":
        raise ValueError(f"its mode is {about['mode']}, and only trinary is read here")
    x, y, yaw_rad = (float(value) for value in about["origin"])
    resolution_m = float(about["resolution"])
    if yaw_rad or not 0 < resolution_m < np.inf:
        raise ValueError(f"its origin {about['origin']} is turned, or its resolution {resolution_m:g} is no length")
    taken = grey if about.get("negate") else 1 - grey
    occupied, free = taken > float(about["occupied_thresh"]), taken < float(about["free_thresh"])
    # A picture begins at the top, a map at its lowest y.
    cells = np.where(occupied, OCCUPIED, np.where(free, FREE, UNKNOWN)).astype(np.int8)[::-1]
    grid = message_type("nav_msgs/msg/OccupancyGrid")()
    grid.info.height, grid.info.width = cells.shape
    grid.info.resolution = resolution_m
    grid.info.origin.position.x, grid.info.origin.position.y = x, y
    grid.data.frombytes(np.ascontiguousarray(cells).tobytes())
    return grid
