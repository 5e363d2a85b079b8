"""The node `benchbot_bridge`: obeys velocity commands, resets and places the robot, and lets its time pass."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, Catalog, ExitCode, Pose, Scene
from benchbot_robot_ros2.bridge.camera import Camera
from benchbot_robot_ros2.bridge.robot import COMMAND, PLACE, RESET, BridgedRobot, find_scene
from benchbot_robot_ros2.bridge.state import StatePublisher
from benchbot_robot_ros2.bridge.world import World
from benchbot_robot_ros2.messages import message_type

if TYPE_CHECKING:
    from rclpy.node import Node

PARAMETERS = {
    "environment": "the scene that benchbot/reset takes the robot to, name:variant",
    "seed": "what odometry's errors are drawn from after benchbot/reset",
    "start_pose": "where benchbot/reset puts the base in the map, [qw, qx, qy, qz, x, y, z]; empty: as the scene says",
    "place_pose": "where benchbot/place puts the base in the map, [x, y, yaw] in metres and radians",
}


class Bridge:
    """A world as a ROS 2 robot.

    The service `benchbot/reset` goes by the node's parameters `environment`, `seed` and `start_pose`, `benchbot/place`
    by `place_pose`. Parameters take any value: the services' responses say what is wrong with it.
    """

    def __init__(
        self, catalog: Catalog, robot: BridgedRobot, world: World, camera: Camera | None, scene: Scene, seed: int
    ) -> None:
        self._catalog, self._robot, self._world, self._camera = catalog, robot, world, camera
        self._loaded = (scene, seed)

    def load(self) -> None:
        """Put robot and camera at the start of the scene; raises BenchbotError when that cannot be."""
        scene, seed = self._loaded
        if self._camera:
            self._camera.begin_load(scene, seed)
        try:
            self._world.load(scene, seed)
            # The first scan takes long: kernels are compiled.
            self._world.observe(self._robot.scanners)
        finally:
            if self._camera:
                self._camera.finish_load()

    def run(self, node: "Node", state: StatePublisher) -> None:
        """Let time pass, at real-time pace at most, for ever; raises BenchbotError when the camera's process ends."""
        from rclpy.executors import SingleThreadedExecutor

        self._listen(node)
        state.announce(self._world)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        due_s = time.monotonic()
        while True:
            self._world.tick()
            state.publish(self._world)
            if self._camera:
                self._camera.show(self._world.stamp_ns, self._world.pose())
            # A late tick is not made up for: a burst of ticks would outrun the commands that are meant for them.
            due_s = max(due_s + self._world.control_period_s, time.monotonic())
            executor.spin_once(timeout_sec=0)
            while (left_s := due_s - time.monotonic()) > 0:
                executor.spin_once(timeout_sec=left_s)

    def _listen(self, node: "Node") -> None:
        from rcl_interfaces.msg import ParameterDescriptor
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from std_srvs.srv import Trigger

        scene, seed = self._loaded
        values = {"environment": _name(scene), "seed": seed, "start_pose": [], "place_pose": [0.0, 0.0, 0.0]}
        for name, value in values.items():
            node.declare_parameter(name, value, ParameterDescriptor(description=PARAMETERS[name], dynamic_typing=True))
        # A subscriber that asks for best effort hears every publisher.
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        node.create_subscription(message_type("geometry_msgs/msg/Twist"), COMMAND, self._obey, qos)

        def serve(name: str, act: "Callable[[Node], str]") -> None:
            node.create_service(Trigger, name, lambda _, response: _answer(response, lambda: act(node)))

        serve(RESET, self._reset)
        serve(PLACE, self._place)

    def _obey(self, twist: Any) -> None:
        velocity = (float(twist.linear.x), float(twist.angular.z))
        # What is no number is no command; the robot brakes as if it had heard nothing.
        if all(map(math.isfinite, velocity)):
            self._world.command(*velocity)

    def _reset(self, node: "Node") -> str:
        wanted = self._wanted(node)
        before = self._loaded
        self._loaded = wanted
        try:
            self.load()
        except BenchbotError:
            self._loaded = before
            self.load()
            raise
        return f"{self._robot.name} is at the start of {_name(wanted[0])}."

    def _wanted(self, node: "Node") -> tuple[Scene, int]:
        environment, seed, start_pose = (
            node.get_parameter(name).value for name in ("environment", "seed", "start_pose")
        )
        if not isinstance(environment, str):
            raise _wrong("environment", environment, "the name of a scene, name:variant")
        if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
            raise _wrong("seed", seed, "a whole number that is not negative")
        scene = find_scene(self._catalog, self._robot.declaration, environment)
        if start_pose is None or len(start_pose) == 0:
            return scene, seed
        values = _numbers("start_pose", start_pose, 7, "[qw, qx, qy, qz, x, y, z], with a quaternion that is not zero")
        if not any(values[:4]):
            raise _wrong("start_pose", values, "[qw, qx, qy, qz, x, y, z], with a quaternion that is not zero")
        return replace(scene, environment={**scene.environment, "start_pose": values}), seed

    def _place(self, node: "Node") -> str:
        x, y, yaw_rad = _numbers(
            "place_pose", node.get_parameter("place_pose").value, 3, "[x, y, yaw] in metres and radians"
        )
        z = self._world.pose().translation_xyz[2]
        self._world.place(Pose.planar(x, y, yaw_rad, z))
        return f"{self._robot.name} is at ({x:g}, {y:g}) m, heading {math.degrees(yaw_rad):g} degrees."


def _name(scene: Scene) -> str:
    return f"{scene.environment['name']}:{scene.environment['variant']}"


def _answer(response: Any, act: Callable[[], str]) -> Any:
    """Fill in a Trigger's response."""
    try:
        response.message, response.success = act(), True
    except BenchbotError as error:
        # An internal error, such as the end of the camera's process, is not the caller's.
        if error.exit_code is not ExitCode.USAGE:
            raise
        response.message, response.success = f"{error.title} {error.why} {error.fix}", False
    return response


def _numbers(name: str, value: Any, count: int, form: str) -> list[float]:
    try:
        numbers = [float(number) for number in value]
    except (TypeError, ValueError) as error:
        raise _wrong(name, value, form) from error
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise _wrong(name, numbers, form)
    return numbers


def _wrong(name: str, value: Any, form: str) -> BenchbotError:
    return BenchbotError(
        f"The parameter {name} is wrong.",
        f"It is {value!r}; it must be {form}.",
        f"For example: ros2 param set /benchbot_bridge {name} …",
    )
