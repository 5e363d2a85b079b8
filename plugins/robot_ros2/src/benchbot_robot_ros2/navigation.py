"""Navigation: goals of Nav2's actions, sent, looked after and called off."""

import importlib
import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, Outcome, Pose
from benchbot_robot_ros2 import failures
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import MovedByNavigation
from benchbot_robot_ros2.messages import pose_message
from benchbot_robot_ros2.qos import UNNAMED, node_name, publishers

if TYPE_CHECKING:
    from rclpy.node import Node

# How long a called off navigation may take to say so, before the robot is stopped without it.
CALL_OFF_S = 3.0
# The poses of a path that is sent: about the resolution of a costmap.
_PATH_STEP_M = 0.05
_POLL_S = 0.05
# A way that is not free, by the error codes of Jazzy's controller_server (1xx) and planner_server (2xx): out of
# patience, no progress, no valid control, start or goal occupied, no path. Of all others the solution is innocent.
_BLOCKED = frozenset({104, 105, 106, 205, 206, 208})

NAVIGATE_TO_POSE = "nav2_msgs/action/NavigateToPose"

Failed = Callable[[str, str], BenchbotError]


class Navigation:
    """One goal at a time of an action server of Nav2, whose types are NavigateToPose and FollowPath.

    The node's callbacks run in another thread. `failed` makes an error of why, and the fix. Raises one when nav2_msgs
    is not installed.
    """

    def __init__(self, node: "Node", robot: Ros2Robot, ros_action: str, ros_type: str, failed: Failed) -> None:
        try:
            actions = importlib.import_module("nav2_msgs.action")
        except ModuleNotFoundError as error:
            raise failed(
                "It is to be navigated, and the messages of Nav2 (nav2_msgs) are not installed.",
                "Install ros-jazzy-nav2-msgs with apt and source /opt/ros/jazzy/setup.bash, or declare "
                "driver.return_to_start: {by: operator} and driver.motion: {by: velocity}.",
            ) from error
        from rclpy.action import ActionClient

        self._node = node
        self._robot = robot
        self._name = ros_action
        self._wait_s = robot.settings.timing.wait_s
        self._failed = failed
        self._type = getattr(actions, ros_type.rpartition("/")[2])
        self._client = ActionClient(node, self._type, ros_action)
        self._handle: Any = None
        self._answer: Any = None

    def await_server(self, check: Callable[[], None] = lambda: None) -> None:
        """Wait for the action server; `check` is called again and again. Raises BenchbotError when there is none."""
        if not _wait(self._client.server_is_ready, self._wait_s, check):
            raise self._failed(
                f"No action server {self._name} is there. {self._wait_s:g} s were waited for it.",
                f"Start the node that offers it; what is there: benchbot doctor --robot {self._robot.name}",
            )

    def send(self, start: Pose, goal: Pose) -> None:
        """Send the robot to a pose in the map frame; a FollowPath server gets the straight way from `start`."""
        self._handle = self._answer = None
        self._sent_s = time.monotonic()
        # An action client is not made for two threads: an answer that comes before its sender has noted the question
        # is thrown away (rclpy 7.1, `ActionClient.send_goal_async`).
        self._node.executor.create_task(self._send, self._goal(start, goal))

    def ending(self) -> Any:
        """Return the answer that ended the goal, with `status` and `result`; None while the robot is on its way.

        Raises BenchbotError when the server refused the goal, does not answer, or is gone.
        """
        if self._answer is not None:
            return self._answer
        if not self._client.server_is_ready():
            raise self._failed(
                f"The action server {self._name} went away meanwhile.", "See what became of it, and start it again."
            )
        if self._handle is None and time.monotonic() - self._sent_s > self._wait_s:
            raise self._failed(
                f"The action server {self._name} did not answer within {self._wait_s:g} s.",
                "See what became of it, and start it again.",
            )
        if self._handle is not None and not self._handle.accepted:
            raise self._failed(
                f"The action server {self._name} refused the goal.",
                "See whether Nav2 is active: ros2 lifecycle get /bt_navigator",
            )
        return None

    def outcome(self) -> Outcome | None:
        """Return how the goal ended; None while the robot is on its way.

        Raises BenchbotError as `ending` does, and where it ended for another reason than a way that is not free.
        """
        from action_msgs.msg import GoalStatus

        answer = self.ending()
        if answer is None:
            return None
        if answer.status == GoalStatus.STATUS_SUCCEEDED:
            return Outcome.REACHED
        if answer.status == GoalStatus.STATUS_ABORTED and answer.result.error_code in _BLOCKED:
            return Outcome.BLOCKED
        raise self.gave_up(answer)

    def gave_up(self, answer: Any) -> BenchbotError:
        """Return the error of an ending that is no success."""
        from action_msgs.msg import GoalStatus

        ending = {GoalStatus.STATUS_CANCELED: "was called off", GoalStatus.STATUS_ABORTED: "was given up"}
        # Nav2 says more since error_msg was added to its results.
        said = getattr(answer.result, "error_msg", "") or "see what Nav2 logged"
        return self._failed(
            f"The navigation with {self._name} {ending.get(answer.status, 'failed')} "
            f"(error {answer.result.error_code}: {said}).",
            "See whether Nav2 is localised and the way is free: send the robot there by hand, as with RViz.",
        )

    def call_off(self, check: Callable[[], None] = lambda: None) -> bool:
        """Cancel the goal, and say whether it has ended then; `check` is called again and again."""
        timeout_s = min(self._wait_s, CALL_OFF_S)
        if not _wait(lambda: self._handle is not None, timeout_s, check):
            return False
        if self._handle.accepted and self._answer is None:
            self._node.executor.create_task(self._handle.cancel_goal_async)
        return not self._handle.accepted or _wait(lambda: self._answer is not None, timeout_s, check)

    def close(self) -> None:
        """Leave the action server alone."""
        self._node.executor.create_task(self._client.destroy)

    def _send(self, goal: Any) -> None:
        self._client.send_goal_async(goal).add_done_callback(self._on_answered)

    def _on_answered(self, future: Any) -> None:
        handle = future.result()
        if handle.accepted:
            handle.get_result_async().add_done_callback(self._on_ended)
        self._handle = handle

    def _on_ended(self, future: Any) -> None:
        self._answer = future.result()

    def _goal(self, start: Pose, goal: Pose) -> Any:
        message = self._type.Goal()
        frame, stamp = self._robot.global_frame, self._node.get_clock().now().to_msg()
        if hasattr(message, "path"):
            message.path.header.frame_id, message.path.header.stamp = frame, stamp
            message.path.poses = [_stamped(frame, stamp, pose) for pose in _straight(start, goal)]
        else:
            message.pose = _stamped(frame, stamp, goal)
        return message


def moved_by(node: "Node", robot: Ros2Robot, way: MovedByNavigation, check: Callable[[], None]) -> Navigation:
    """Return the navigation that drives a robot to its next pose.

    `check` is called again and again. Raises BenchbotError when it is not there, or something else commands velocities.
    """

    def lost(why: str, fix: str) -> BenchbotError:
        return failures.failed(f"The robot '{robot.name}' cannot be navigated.", why, fix)

    navigation = Navigation(node, robot, way.ros_action, way.ros_type, lost)
    navigation.await_server(check)
    _refuse_rivals(node, robot, lost)
    return navigation


def _refuse_rivals(node: "Node", robot: Ros2Robot, failed: Failed) -> None:
    """Raise an error when another node commands velocities on the guard's topic: the guard could not stop it there."""
    topic = robot.command.ros_topic

    def rivals() -> list[str]:
        names = {node_name(info) for info in publishers(node, robot.command)}
        return sorted(name for name in names if not name.rpartition("/")[2].startswith("benchbot_guard"))

    # A node may be discovered after its publisher: the guards', too.
    _wait(lambda: UNNAMED not in rivals(), robot.settings.timing.wait_s)
    if found := rivals():
        raise failed(
            f"{' and '.join(found)} commands velocities on {topic}, too, where BenchBot has to stop the robot.",
            f"Let Nav2 publish on a topic of its own, and twist_mux give {topic} priority over it: docs/ros2.md, Nav2.",
        )


def _straight(start: Pose, goal: Pose) -> list[Pose]:
    """Return poses on the straight way, headed along it; the last one is the goal."""
    (x, y, _), (goal_x, goal_y, _) = start.translation_xyz, goal.translation_xyz
    steps = max(1, math.ceil(math.hypot(goal_x - x, goal_y - y) / _PATH_STEP_M))
    heading_rad = math.atan2(goal_y - y, goal_x - x)
    shares = [number / steps for number in range(steps)]
    on_way = [Pose.planar(x + share * (goal_x - x), y + share * (goal_y - y), heading_rad) for share in shares]
    return [*on_way, goal]


def _stamped(frame: str, stamp: Any, pose: Pose) -> Any:
    from geometry_msgs.msg import PoseStamped

    message = PoseStamped()
    message.header.frame_id, message.header.stamp = frame, stamp
    message.pose = pose_message(pose)
    return message


def _wait(done: Callable[[], bool], timeout_s: float, check: Callable[[], None] = lambda: None) -> bool:
    """Wait until it is done, and say whether it is; `check` may raise meanwhile."""
    deadline_s = time.monotonic() + timeout_s
    while not done():
        check()
        if time.monotonic() > deadline_s:
            return False
        time.sleep(_POLL_S)
    return True
