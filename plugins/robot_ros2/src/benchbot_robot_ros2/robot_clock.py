"""The robot's clock: ROS time as a node has it, and the seconds of a run, which never go back."""

import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rclpy.clock import TimeJump
    from rclpy.node import Node

# The system's clock is slewed by at most 0.5 ms per second (adjtime(3)); what goes back further was set back.
SET_BACK_NS = 50_000_000


class RobotClock:
    """Reads a node's clock. In wall time, seconds are counted by the steady clock, which cannot be set.

    `changed` is notified whenever simulated time changes.
    """

    def __init__(self, node: "Node", *, simulated: bool, changed: threading.Condition) -> None:
        from rclpy.clock import JumpThreshold
        from rclpy.duration import Duration

        self._clock = node.get_clock()
        self.simulated = simulated
        self._changed = changed
        self._lock = threading.Lock()
        self._ros_ns = self._clock.now().nanoseconds
        self._steady_ns = time.monotonic_ns()
        self._least_offset_ns = self._ros_ns - self._steady_ns
        self._advanced_ns = self._steady_ns
        self._elapsed_ns = 0
        self._set_back_ns = 0
        self._jumps = self._clock.create_jump_callback(
            JumpThreshold(
                min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1), on_clock_change=False
            ),
            post_callback=self._on_change,
        )

    def now_ns(self) -> int:
        """Return ROS time: that of messages' stamps; 0 while nothing has come on /clock yet."""
        return int(self._clock.now().nanoseconds)

    def now_s(self) -> float:
        """Return the seconds since this object was made; never less than before, whatever happens to ROS time."""
        with self._lock:
            self._read()
            return self._elapsed_ns / 1e9

    @property
    def set_back_s(self) -> float:
        """The total by which ROS time has jumped back since `forgive`, in seconds; 0 if it has not."""
        with self._lock:
            self._read()
            return self._set_back_ns / 1e9

    @property
    def still_s(self) -> float:
        """The wall time since the clock last advanced, in seconds."""
        with self._lock:
            self._read()
            return (self._steady_ns - self._advanced_ns) / 1e9

    def forgive(self) -> None:
        """Forget that ROS time jumped back."""
        with self._lock:
            self._read()
            self._set_back_ns = 0

    def close(self) -> None:
        """Stop watching the node's clock."""
        self._jumps.unregister()

    def _on_change(self, _jump: "TimeJump") -> None:
        with self._lock:
            self._read()
        with self._changed:
            self._changed.notify_all()

    def _read(self) -> None:
        # On a busy machine any time may pass between looking at two clocks: their offset is known within bounds only.
        before_ns, ros_ns, steady_ns = time.monotonic_ns(), self.now_ns(), time.monotonic_ns()
        ros_step_ns, steady_step_ns = ros_ns - self._ros_ns, steady_ns - self._steady_ns
        if self.simulated:
            step_ns, back_ns = max(0, ros_step_ns), -ros_step_ns
        else:
            step_ns, back_ns = steady_step_ns, self._least_offset_ns - (ros_ns - before_ns) - SET_BACK_NS
        self._ros_ns, self._steady_ns, self._least_offset_ns = ros_ns, steady_ns, ros_ns - steady_ns
        if step_ns > 0:
            self._advanced_ns = steady_ns
        self._elapsed_ns += step_ns
        self._set_back_ns += max(0, back_ns)
