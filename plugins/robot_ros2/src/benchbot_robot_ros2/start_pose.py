"""The return to the start pose between trials: by a service, by navigation, or by the operator."""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

from benchbot.plugin import BenchbotError, Pose, Scene
from benchbot_robot_ros2.declaration import ReturnByNavigation, ReturnByService, Ros2Robot
from benchbot_robot_ros2.failures import failed

if TYPE_CHECKING:
    from rclpy.node import Node

# How long a robot may be on its way: across a building, at walking speed.
WAY_S = 120.0
# How long a called off navigation may take to say so, before the robot is stopped without it.
_CALL_OFF_S = 3.0
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
        try:
            from nav2_msgs.action import NavigateToPose
        except ModuleNotFoundError as error:
            raise self._failed(
                "It is to navigate there, and the messages of Nav2 (nav2_msgs) are not installed.",
                "Install ros-jazzy-nav2-msgs with apt and source /opt/ros/jazzy/setup.bash, "
                "or declare driver.return_to_start: {by: operator}.",
            ) from error
        from action_msgs.msg import GoalStatus
        from rclpy.action import ActionClient

        goal = NavigateToPose.Goal()
        goal.pose.header.frame_id = self._robot.global_frame
        goal.pose.header.stamp = self._node.get_clock().now().to_msg()
        _fill(goal.pose.pose, scene.start_pose)
        client = ActionClient(self._node, NavigateToPose, way.ros_action)
        try:
            self._await_server(client.server_is_ready, f"No action server {way.ros_action} is there.")
            answer = self._navigate(client, goal, way.ros_action)
        finally:
            self._in_executor(client.destroy)
        if answer.status != GoalStatus.STATUS_SUCCEEDED:
            ending = {GoalStatus.STATUS_CANCELED: "was called off", GoalStatus.STATUS_ABORTED: "was given up"}
            # Nav2 says more since error_msg was added to its results.
            said = getattr(answer.result, "error_msg", "") or "see what Nav2 logged"
            raise self._failed(
                f"The navigation with {way.ros_action} {ending.get(answer.status, 'failed')} "
                f"(error {answer.result.error_code}: {said}).",
                "See whether Nav2 is localised and the start is free: send the robot there by hand, as with RViz.",
            )

    def _navigate(self, client: Any, goal: Any, name: str) -> Any:
        """Return how a goal ended; when no end was seen, it is called off, or the robot stopped for good."""
        handle = None
        try:
            silence = f"The action server {name} did not answer within {self._wait_s:g} s."
            handle = self._ask(client, lambda: client.send_goal_async(goal), self._wait_s, silence)
            if handle.accepted:
                too_long = f"The robot was still on its way after {self._way_s:g} s."
                return self._ask(client, handle.get_result_async, self._way_s, too_long)
        except BaseException as error:
            if handle is None or not self._called_off(handle):
                why = error.why if isinstance(error, BenchbotError) else "The run was interrupted."
                self._guard.stop(f"{why} Nav2 did not confirm that it drives the robot no longer.")
                if isinstance(error, BenchbotError):
                    _heed(self._guard)
            raise
        raise self._failed(
            f"The action server {name} refused the goal.",
            "See whether Nav2 is active: ros2 lifecycle get /bt_navigator",
        )

    def _called_off(self, handle: Any) -> bool:
        """Cancel a goal, and say whether its navigation has ended then."""
        sent = [self._in_executor(call) for call in (handle.cancel_goal_async, handle.get_result_async)]
        timeout_s = min(self._wait_s, _CALL_OFF_S)
        return all(_wait(task.done, timeout_s) and _wait(task.result().done, timeout_s) for task in sent)

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
            self._in_executor(lambda: self._node.destroy_client(client))

    def _await_server(self, ready: Callable[[], bool], missing: str) -> None:
        if not _wait(ready, self._wait_s, self._guard):
            raise self._failed(
                f"{missing} {self._wait_s:g} s were waited for it.",
                f"Start the node that offers it; what is there: benchbot doctor --robot {self._robot.name}",
            )

    def _ask(self, client: Any, send: Callable[[], Any], timeout_s: float, silence: str) -> Any:
        """Return an action server's answer to what `send` asks it."""
        there = client.server_is_ready
        answer = self._result(self._in_executor(send), self._wait_s, silence, there)
        return self._result(answer, timeout_s, silence, there)

    def _result(self, future: Any, timeout_s: float, silence: str, there: Callable[[], bool]) -> Any:
        if _wait(lambda: future.done() or not there(), timeout_s, self._guard) and future.done():
            return future.result()
        raise self._failed(
            silence if there() else "The node that was to bring it there went away meanwhile.",
            "See what became of it, and start it again.",
        )

    def _in_executor(self, call: Callable[[], Any]) -> Any:
        """Return the future of a call in the thread of the node's callbacks.

        An action client is not made for two threads: an answer that comes before its sender has noted the question is
        thrown away (rclpy 7.1, `ActionClient.send_goal_async`).
        """
        return self._node.executor.create_task(call)

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


def _fill(message: Any, pose: Pose) -> None:
    """Write a pose into a geometry_msgs/msg/Pose."""
    message.position.x, message.position.y, message.position.z = pose.translation_xyz
    rotation = message.orientation
    rotation.x, rotation.y, rotation.z, rotation.w = pose.rotation_xyzw
