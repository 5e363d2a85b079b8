"""The node `benchbot_bridge`: obeys velocity commands, resets and places the robot, and lets its time pass."""

import math
from collections.abc import Callable
from dataclasses import replace
from threading import Event
from typing import TYPE_CHECKING, Any

from benchbot.cli.kit import console
from benchbot.plugin import BenchbotError, Catalog, ExitCode, Pose, Scene
from benchbot_robot_ros2.bridge.camera import Camera
from benchbot_robot_ros2.bridge.occupancy_map import MapServer, read
from benchbot_robot_ros2.bridge.robot import COMMAND, PLACE, RESET, BridgedRobot, find_scene, scene_name
from benchbot_robot_ros2.bridge.state import StatePublisher
from benchbot_robot_ros2.bridge.type_watch import TypeWatch
from benchbot_robot_ros2.bridge.world import World
from benchbot_robot_ros2.guard.topic import velocity_of
from benchbot_robot_ros2.messages import message_type, stamp_ns

if TYPE_CHECKING:
    from rclpy.node import Node

WATCH_PERIOD_S = 1.0
STALE_NS = 500_000_000
"""How far a stamped velocity may be from the robot's time: as cmd_vel_timeout of ros2_controllers' diff_drive."""

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
        self,
        catalog: Catalog,
        robot: BridgedRobot,
        world: World,
        camera: Camera | None,
        maps: MapServer | None,
        loaded: tuple[Scene, int],
    ) -> None:
        self._catalog, self._robot, self._world, self._camera, self._maps = catalog, robot, world, camera, maps
        self._loaded = loaded
        self._has_told_of_stale = False

    def load(self) -> None:
        """Put robot and camera at the start of the scene; raises BenchbotError when that cannot be."""
        scene, seed = self._loaded
        grid = read(scene) if self._maps else None
        if self._camera:
            self._camera.begin_load(scene, seed)
        try:
            self._world.load(scene, seed)
            # The first scan takes long: kernels are compiled.
            self._world.observe(self._robot.scanners)
        finally:
            if self._camera:
                self._camera.finish_load()
        if self._maps:
            self._maps.publish(grid, self._world.stamp_ns)

    def run(self, node: "Node", state: StatePublisher, watch: TypeWatch, ended: Event) -> None:
        """Let time pass, at real-time pace at most, until it is ended.

        Raises BenchbotError when the camera's process ends.
        """
        from rclpy.clock import Clock, ClockType
        from rclpy.executors import SingleThreadedExecutor

        self._listen(node)
        state.announce(self._world)
        node.create_timer(WATCH_PERIOD_S, watch.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        while not ended.is_set():
            self._world.tick()
            state.publish(self._world)
            if self._camera:
                self._camera.show(self._world.stamp_ns, self._world.pose())
            executor.spin_once(timeout_sec=0)
            while not ended.is_set() and (left_s := self._world.left_s()) > 0:
                executor.spin_once(timeout_sec=left_s)

    def _listen(self, node: "Node") -> None:
        from rcl_interfaces.msg import ParameterDescriptor
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from std_srvs.srv import Trigger

        scene, seed = self._loaded
        values = {"environment": scene_name(scene), "seed": seed, "start_pose": [], "place_pose": [0.0, 0.0, 0.0]}
        for name, value in values.items():
            node.declare_parameter(name, value, ParameterDescriptor(description=PARAMETERS[name], dynamic_typing=True))
        # A subscriber that asks for best effort hears every publisher.
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        node.create_subscription(message_type(self._robot.command_type), COMMAND, self._obey, qos)

        def serve(name: str, act: "Callable[[Node], str]") -> None:
            node.create_service(Trigger, name, lambda _, response: _answer(response, lambda: act(node)))

        serve(RESET, self._reset)
        serve(PLACE, self._place)

    def _obey(self, command: Any) -> None:
        velocity = velocity_of(command)
        # What is no number is no command; the robot brakes as if it had heard nothing.
        if all(map(math.isfinite, velocity)) and self._is_of_now(command):
            self._world.command(velocity)

    def _is_of_now(self, command: Any) -> bool:
        """Return whether a command was not held up on its way; tell the first time that one was."""
        sent_ns = stamp_ns(command)
        # A stamp of zero is that of a person at a terminal.
        if not sent_ns or abs(sent_ns - self._world.stamp_ns) <= STALE_NS:
            return True
        if not self._has_told_of_stale:
            self._has_told_of_stale = True
            off_s = (sent_ns - self._world.stamp_ns) / 1e9
            console.note(
                f"A velocity is not obeyed: it is stamped {abs(off_s):.1f} s {'after' if off_s > 0 else 'before'} the "
                f"robot's time, and {STALE_NS / 1e9:g} s are allowed. Let the node that sends it use the robot's time: "
                "use_sim_time: true, or, of a bridge with --wall-time, false."
            )
        return False

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
        return f"{self._robot.name} is at the start of {scene_name(wanted[0])}."

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
        f"For example, of a bridge without a namespace: ros2 param set /benchbot_bridge {name} …",
    )
