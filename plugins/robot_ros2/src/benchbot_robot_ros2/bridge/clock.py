"""The topic /clock, which one node of a domain publishes: this bridge, or another whose time it then follows."""

import time
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, ExitCode, FailureClass
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.pace import LONGEST_TICK_S, NANOSECONDS, RobotTime, SimulatedTime
from benchbot_robot_ros2.messages import message_type

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.publisher import Publisher

CLOCK, CLOCK_TYPE = "/clock", "rosgraph_msgs/msg/Clock"
DISCOVERY_S = 1.0
"""How long the other publishers of a machine take to be seen."""
POLL_S = 1.0


class FollowedTime:
    """Time that goes on when another node says so on /clock; at least `period_s` a tick."""

    def __init__(self, node: "Node", period_s: float) -> None:
        from rclpy.qos import QoSProfile, ReliabilityPolicy

        self.stamp_ns = 0
        self._period_ns = round(period_s * NANOSECONDS)
        self._newest_ns = 0
        self._has_jumped = False
        # As rclpy's own subscription to /clock: best effort, the newest only.
        profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._subscription = node.create_subscription(message_type(CLOCK_TYPE), CLOCK, self._hear, profile)
        self._node = node

    @property
    def heard(self) -> bool:
        """True when another node has published its time."""
        return self._newest_ns > 0

    def left_s(self) -> float:
        """Return how long to wait at most; raises BenchbotError when the time that is followed has jumped back."""
        if self._has_jumped:
            raise BenchbotError(
                "The time on /clock jumped back.",
                "This bridge follows the time of another node, which was probably started anew.",
                "Start this bridge again, too; a bridge that is there first publishes /clock itself.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.PLATFORM,
            )
        return 0.0 if self._newest_ns >= self.stamp_ns + self._period_ns else POLL_S

    def next_tick(self) -> float:
        """Go on to the newest time; return how long the tick takes, up to 0.15 s: the robot does not jump."""
        elapsed_ns, self.stamp_ns = self._newest_ns - self.stamp_ns, self._newest_ns
        return min(elapsed_ns / NANOSECONDS, LONGEST_TICK_S)

    def end(self) -> None:
        """Follow no longer."""
        self._node.destroy_subscription(self._subscription)

    def _hear(self, message: Any) -> None:
        stamp_ns = int(message.clock.sec) * NANOSECONDS + int(message.clock.nanosec)
        self._has_jumped |= stamp_ns < self._newest_ns
        self._newest_ns = max(self._newest_ns, stamp_ns)


def simulated_time(node: "Node", period_s: float) -> "tuple[RobotTime, Publisher[Any] | None]":
    """Return the time to live in, and the publisher of /clock: None when another node publishes that.

    Of bridges that start at once, the one whose node's name sorts first publishes.
    """
    from rclpy.executors import SingleThreadedExecutor

    ours = node.get_fully_qualified_name()
    publisher = node.create_publisher(message_type(CLOCK_TYPE), CLOCK, qos.sending(depth=10))
    followed = FollowedTime(node, period_s)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    deadline_s = time.monotonic() + DISCOVERY_S
    while not followed.heard and (left_s := deadline_s - time.monotonic()) > 0:
        executor.spin_once(timeout_sec=left_s)
    executor.shutdown()
    others = map(qos.node_name, node.get_publishers_info_by_topic(CLOCK))
    if followed.heard or any(other < ours for other in others):
        node.destroy_publisher(publisher)
        return followed, None
    followed.end()
    return SimulatedTime(period_s), publisher
