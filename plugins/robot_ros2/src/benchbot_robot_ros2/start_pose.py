"""The return to the start pose between trials: by a service, by navigation, or by the operator."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from benchbot.plugin import BenchbotError, Pose, Scene
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import ReturnByNavigation, ReturnByService
from benchbot_robot_ros2.failures import failed
from benchbot_robot_ros2.localisation import apart
from benchbot_robot_ros2.messages import pose_message
from benchbot_robot_ros2.navigation import NAVIGATE_TO_POSE, Navigation

if TYPE_CHECKING:
    from rclpy.node import Node

# How long a robot may be on its way: across a building, at walking speed.
WAY_S = 120.0
_POLL_S = 0.05


class Stopping(Protocol):
    """The part of a guard that matters here."""

    @property
    def tripped(self) -> str | None:
        """Why the robot was stopped for good, None when it was not."""

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Raise the safety stop once the robot was stopped."""

    def stop(self, why: str) -> None:
        """Stop the robot at once and for good."""


def return_to_start(
    node: "Node",
    robot: Ros2Robot,
    scene: Scene,
    seed: int,
    ask: Callable[[str], None] | None,
    guard: Stopping,
    *,
    way_s: float = WAY_S,
) -> None:
    """Bring the robot to the scene's start pose by the declared method; return when it should be there.

    The node's callbacks run in another thread. A server has the declared `timing.wait_s` to appear and to answer, the
    robot `way_s` for its way. Whether it came to stand where it should is not looked at. Raises
    BenchbotError(failure=PLATFORM): who was missing, refused or gave up; the guard's safety stop once there is one.
    """
    way = robot.settings.return_to_start
    if isinstance(way, ReturnByService):
        _Return(node, robot, guard, way_s).by_service(way, scene, seed)
    elif isinstance(way, ReturnByNavigation):
        _Return(node, robot, guard, way_s).by_navigation(way, scene)
    else:
        _by_operator(robot, scene, ask)
    _heed(guard)


def tell_localisation(robot: ConnectedRobot, scene: Scene) -> None:
    """Tell localisation where the robot starts, where that is declared, and wait until it says so, too.

    Raises BenchbotError when nobody listens, or it goes on to say something else.
    """
    settings = robot.robot.settings
    if settings.initial_pose is None:
        return
    from geometry_msgs.msg import PoseWithCovarianceStamped

    message = PoseWithCovarianceStamped()
    message.header.frame_id = robot.robot.global_frame
    message.header.stamp = robot.node.get_clock().now().to_msg()
    message.pose.pose = pose_message(scene.start_pose)
    allowed = settings.start_tolerances
    # Variances of x, y and yaw, on the diagonal of 6 rows.
    message.pose.covariance[0] = message.pose.covariance[7] = allowed.position_m**2
    message.pose.covariance[35] = math.radians(allowed.angle_deg) ** 2
    publisher = robot.node.create_publisher(PoseWithCovarianceStamped, settings.initial_pose, 1)
    wait, told_s = robot.wait(settings.timing.wait_s), math.inf
    try:
        while not _believes(robot, scene.start_pose, told_s):
            if told_s == math.inf and publisher.get_subscription_count():
                told_s = robot.clock.now_s()
                publisher.publish(message)
            if wait.over():
                raise _disbelief(robot, settings.initial_pose, is_told=told_s < math.inf)
    finally:
        robot.node.executor.create_task(robot.node.destroy_publisher, publisher)


def _believes(robot: ConnectedRobot, start: Pose, told_s: float) -> bool:
    """Return whether localisation has said, since it was told, that the robot is at the start."""
    place, allowed = robot.place, robot.robot.settings.start_tolerances
    heard_s = robot.clock.now_s() if place is None else -math.inf if place.newest is None else place.newest.arrived_s
    if heard_s <= told_s:
        return False
    try:
        away_m, turned_deg = apart(start, robot.localisation.pose())
    except (LookupError, ValueError):
        return False
    return away_m <= allowed.position_m and turned_deg <= allowed.angle_deg


def _disbelief(robot: ConnectedRobot, topic: str, *, is_told: bool) -> BenchbotError:
    wait_s = robot.robot.settings.timing.wait_s
    return failed(
        f"The localisation of the robot '{robot.robot.name}' does not take its start pose.",
        f"It was told on {topic}, and {wait_s:g} s later it does not say that the robot is there."
        if is_told
        else f"In {wait_s:g} s nobody subscribed to {topic}.",
        "See whether AMCL is active, gets scans, and publishes: ros2 lifecycle get /amcl; or correct "
        "driver.localisation.initial_pose in the robot's declaration.",
    )


def check_start(robot: Ros2Robot, scene: Scene, pose: Pose) -> None:
    """Raise BenchbotError when a robot that is localised in the map is too far from the start pose."""
    away_m, turned_deg = apart(scene.start_pose, pose)
    allowed = robot.settings.start_tolerances
    if away_m > allowed.position_m or turned_deg > allowed.angle_deg:
        raise failed(
            f"The robot '{robot.name}' is not at the start pose.",
            f"It is {away_m:.2f} m and {turned_deg:.1f}° away from it; driver.start_tolerances allow "
            f"{allowed.position_m:g} m and {allowed.angle_deg:g}°.",
            "Bring it there, or correct its localisation (the initial pose), or allow more in the declaration.",
        )


class _Return:
    """A return to the start pose by ROS 2, with the node, robot and guard that each of its steps uses."""

    def __init__(self, node: "Node", robot: Ros2Robot, guard: Stopping, way_s: float) -> None:
        self._node = node
        self._robot = robot
        self._guard = guard
        self._wait_s = robot.settings.timing.wait_s
        self._way_s = way_s

    def by_service(self, way: ReturnByService, scene: Scene, seed: int) -> None:
        """Set the scene on the scene's node, and call the service."""
        from std_srvs.srv import Trigger

        if way.scene_node is not None:
            self._set_scene(way.scene_node, scene, seed)
        response = self._call(Trigger, way.ros_service, Trigger.Request(), self._way_s)
        if not response.success:
            raise self._failed(
                f"The service {way.ros_service} answered: {response.message or 'no success, and no word why'}",
                f"Mend what it says; to try it alone: ros2 service call {way.ros_service} std_srvs/srv/Trigger",
            )

    def by_navigation(self, way: ReturnByNavigation, scene: Scene) -> None:
        """Send the robot to its start with Nav2, which drives it until it is there, or the goal is called off."""
        from action_msgs.msg import GoalStatus

        navigation = Navigation(self._node, self._robot, way.ros_action, NAVIGATE_TO_POSE, self._failed)
        try:
            navigation.await_server(lambda: _heed(self._guard))
            navigation.send(scene.start_pose, scene.start_pose)
            answer = self._ending(navigation)
        finally:
            navigation.close()
        if answer.status != GoalStatus.STATUS_SUCCEEDED:
            raise navigation.gave_up(answer)

    def _ending(self, navigation: Navigation) -> Any:
        """Return how a goal ended; when no end was seen, it is called off, or the robot stopped for good."""
        try:
            if not _wait(lambda: navigation.ending() is not None, self._way_s, self._guard):
                self._give_up()
            return navigation.ending()
        except BaseException as error:
            if not navigation.call_off():
                why = error.why if isinstance(error, BenchbotError) else "The run was interrupted."
                self._guard.stop(f"{why} Nav2 did not confirm that it drives the robot no longer.")
                if isinstance(error, BenchbotError):
                    _heed(self._guard)
            raise

    def _give_up(self) -> None:
        raise self._failed(
            f"The robot was still on its way after {self._way_s:g} s.", "See what Nav2 is waiting for: its log."
        )

    def _set_scene(self, scene_node: str, scene: Scene, seed: int) -> None:
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        values = {
            "environment": f"{scene.environment['name']}:{scene.environment['variant']}",
            "start_pose": [float(value) for value in scene.environment["start_pose"]],
            # That of a run with a secret has 256 bits, and a parameter holds 63 of them.
            "seed": seed % 2**63,
        }
        parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        service = f"{scene_node}/set_parameters"
        response = self._call(SetParameters, service, SetParameters.Request(parameters=parameters), self._wait_s)
        for (name, value), result in zip(values.items(), response.results, strict=False):
            if not result.successful:
                raise self._failed(
                    f"The node {scene_node} does not take {name} = {value}: {result.reason or 'it does not say why'}",
                    f"See what it takes: ros2 param list {scene_node}",
                )

    def _call(self, service_type: Any, name: str, request: Any, timeout_s: float) -> Any:
        client = self._node.create_client(service_type, name)
        try:
            self._await_server(client.service_is_ready, f"No service {name} is there.")
            silence = f"The service {name} did not answer within {timeout_s:g} s."
            return self._result(client.call_async(request), timeout_s, silence, client.service_is_ready)
        finally:
            self._node.executor.create_task(self._node.destroy_client, client)

    def _await_server(self, ready: Callable[[], bool], missing: str) -> None:
        if not _wait(ready, self._wait_s, self._guard):
            raise self._failed(
                f"{missing} {self._wait_s:g} s were waited for it.",
                f"Start the node that offers it; what is there: benchbot doctor --robot {self._robot.name}",
            )

    def _result(self, future: Any, timeout_s: float, silence: str, there: Callable[[], bool]) -> Any:
        if _wait(lambda: future.done() or not there(), timeout_s, self._guard) and future.done():
            return future.result()
        raise self._failed(
            silence if there() else "The node that was to bring it there went away meanwhile.",
            "See what became of it, and start it again.",
        )

    def _failed(self, why: str, fix: str) -> BenchbotError:
        return failed(f"The robot '{self._robot.name}' did not return to its start.", why, fix)


def _by_operator(robot: Ros2Robot, scene: Scene, ask: Callable[[str], None] | None) -> None:
    pose = scene.start_pose
    x, y = pose.translation_xyz[:2]
    place = f"x = {x:z.2f} m, y = {y:z.2f} m, heading {math.degrees(pose.yaw_rad):z.0f}°"
    where = f"the map of {scene.environment['name']}:{scene.environment['variant']}"
    if ask is None:
        raise failed(
            f"Nobody can put the robot '{robot.name}' at its start.",
            f"It is to be carried to {place} in {where}, and nobody is there to be asked.",
            "Run it with benchbot run or benchbot submit, or declare another driver.return_to_start.",
        )
    ask(f"Put {robot.name} at {place} in {where}, then say so with: benchbot ready")


def _wait(done: Callable[[], bool], timeout_s: float, guard: Stopping | None = None) -> bool:
    """Wait until it is done, and say whether it is; raises the safety stop when the guard has one meanwhile."""
    deadline = time.monotonic() + timeout_s
    while not done():
        if guard is not None:
            _heed(guard)
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL_S)
    return True


def _heed(guard: Stopping) -> None:
    if guard.tripped is not None:
        guard.command(0.0, 0.0)
