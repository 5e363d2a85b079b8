"""The topic /clock, which one node of a domain publishes: this bridge, or another whose time it then follows."""

import time
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, ExitCode, FailureClass
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.bridge.pace import LONGEST_TICK_S, NANOSECONDS, SimulatedTime
from benchbot_robot_ros2.messages import message_type

if TYPE_CHECKING:
    from rclpy.node import Node

CLOCK, CLOCK_TYPE = "/clock", "rosgraph_msgs/msg/Clock"
DISCOVERY_S = 1.0
"""How long the other publishers of a machine take to be seen, as a rule."""
POLL_S = 1.0
OLDER_S = 1.0
"""How long a clock that is followed may tell only what is older: two that are becoming one do so for a moment."""


class SharedTime:
    """The simulated time of a domain: this node's, which it publishes, until it hears of a later one, which it follows.

    So nobody's time jumps back when two bridges did not see each other at first: the one that is ahead stays. Of
    bridges that start at once, the one whose node's name sorts first publishes. A tick takes `period_s` of this node's
    own time, at least that of another's.
    """

    def __init__(self, node: "Node", period_s: float) -> None:
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import QoSProfile, ReliabilityPolicy

        self._node = node
        self._period_ns = round(period_s * NANOSECONDS)
        self._heard_ns = 0
        self._older_since_s: float | None = None
        self._has_jumped = False
        self._own: SimulatedTime | None = None
        self._stamp_ns = 0
        self._type = message_type(CLOCK_TYPE)
        self._publisher = node.create_publisher(self._type, CLOCK, qos.sending(depth=10))
        # Best effort, as rclpy's own subscription to /clock; more than the newest, which may be what this node told.
        profile = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        node.create_subscription(self._type, CLOCK, self._hear, profile)

        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        deadline_s = time.monotonic() + DISCOVERY_S
        while not self._heard_ns and (left_s := deadline_s - time.monotonic()) > 0:
            executor.spin_once(timeout_sec=left_s)
        executor.shutdown()
        others = map(qos.node_name, node.get_publishers_info_by_topic(CLOCK))
        if self._heard_ns or any(other < node.get_fully_qualified_name() for other in others):
            node.destroy_publisher(self._publisher)
        else:
            self._own = SimulatedTime(period_s)

    @property
    def follows(self) -> bool:
        """True when the time is that of another node."""
        return self._own is None

    @property
    def stamp_ns(self) -> int:
        """The robot's time, in nanoseconds."""
        return self._own.stamp_ns if self._own else self._stamp_ns

    def left_s(self) -> float:
        """Return how long to wait at most; raises BenchbotError when the time that is followed has jumped back."""
        if self._own:
            return self._own.left_s()
        if self._has_jumped:
            raise BenchbotError(
                "The time on /clock jumped back.",
                "This bridge follows the time of another node, which was probably started anew.",
                "Start this bridge again, too; a bridge that is there first publishes /clock itself.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.PLATFORM,
            )
        return 0.0 if self._heard_ns >= self._stamp_ns + self._period_ns else POLL_S

    def next_tick(self) -> float:
        """Go on to the next tick; return how long it takes, in seconds: up to 0.15 of another's, no robot jumps."""
        if self._own:
            return self._own.next_tick()
        elapsed_ns, self._stamp_ns = self._heard_ns - self._stamp_ns, self._heard_ns
        return min(elapsed_ns / NANOSECONDS, LONGEST_TICK_S)

    def publish(self) -> None:
        """Publish the time, if it is this node's."""
        if self._own:
            message = self._type()
            message.clock.sec, message.clock.nanosec = divmod(self._own.stamp_ns, NANOSECONDS)
            self._publisher.publish(message)

    def _hear(self, message: Any) -> None:
        stamp_ns = int(message.clock.sec) * NANOSECONDS + int(message.clock.nanosec)
        if stamp_ns > self._heard_ns:
            self._heard_ns, self._older_since_s = stamp_ns, None
        elif stamp_ns < self._heard_ns:
            now_s = time.monotonic()
            self._older_since_s = self._older_since_s or now_s
            self._has_jumped |= now_s > self._older_since_s + OLDER_S
        # What this node has published itself is never later than its time.
        if self._own and stamp_ns > self._own.stamp_ns:
            self._stamp_ns = self._own.stamp_ns
            self._own = None
            self._node.destroy_publisher(self._publisher)
