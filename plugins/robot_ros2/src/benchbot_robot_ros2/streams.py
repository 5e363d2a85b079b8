"""Streams: the recent messages of a topic by stamp, and the reason why none arrive."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.declaration_keys import Topic
from benchbot_robot_ros2.messages import message_type, stamp_ns
from benchbot_robot_ros2.robot_clock import RobotClock

if TYPE_CHECKING:
    from rclpy.node import Node

# Long enough to find the odometry of a picture that took its time.
HISTORY_NS = 1_000_000_000
# Of so many messages the offset of the clocks is known: enough for its median, few enough for every step.
OFFSETS = 400
# Published once, or now and then, and true until the next one (AMCL tells where the robot is when it has moved).
HOLDING = frozenset(
    {
        "sensor_msgs/msg/BatteryState",
        "sensor_msgs/msg/CameraInfo",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
    }
)


@dataclass(frozen=True)
class Sample:
    """A message: its stamp (that of its arrival when it has none), ROS time and the run's seconds when it came."""

    stamp_ns: int
    arrived_ns: int
    arrived_s: float
    message: Any

    @property
    def skew_s(self) -> float:
        """ROS time at the message's arrival minus its stamp, in seconds: latency plus offset of the clocks."""
        return (self.arrived_ns - self.stamp_ns) / 1e9


class Stream:
    """Subscribes a topic, with QoS that follows its publishers, and keeps the messages of the last `history_ns`.

    A message whose stamp is not newer than those before it is counted as nothing new. Of messages that hold until the
    next one (`holds`), and of those without a stamp, only the newest is kept. `changed` is the lock of everything
    received, and is notified; `told` is called with each message, be its stamp new or not.
    """

    def __init__(
        self,
        node: "Node",
        topic: Topic,
        clock: RobotClock,
        changed: threading.Condition,
        told: Callable[[Any], None] | None = None,
        history_ns: int = HISTORY_NS,
    ) -> None:
        self.topic = topic
        self.simulated = clock.simulated
        self._node = node
        self._clock = clock
        self._changed = changed
        self._told = told
        self._history_ns = history_ns
        self._type = message_type(topic.ros_type)
        self._samples: deque[Sample] = deque()
        self._repeated = 0
        self._offsets_s: deque[float] = deque(maxlen=OFFSETS)
        self._subscribing = threading.RLock()
        self._subscription: Any = None
        self._profile: Any = None
        self.holds = topic.ros_type in HOLDING or not hasattr(self._type, "header")
        self.open()

    def open(self) -> None:
        """Subscribe, or subscribe anew where publishers offer other QoS than before."""
        with self._subscribing:
            self._subscribe()

    def close(self) -> None:
        """Unsubscribe; received messages are kept."""
        with self._subscribing:
            if self._subscription is not None:
                # By the executor: it hears nothing any more when another thread destroys what it is about to wait for.
                self._node.executor.create_task(self._node.destroy_subscription, self._subscription)
                self._subscription = None

    @property
    def samples(self) -> list[Sample]:
        """The messages that are kept, oldest first."""
        with self._changed:
            return list(self._samples)

    @property
    def newest(self) -> Sample | None:
        """The newest message."""
        with self._changed:
            return self._samples[-1] if self._samples else None

    @property
    def age_s(self) -> float:
        """The time since the newest message arrived, in seconds of the run; infinite if none has."""
        newest = self.newest
        return float("inf") if newest is None else self._clock.now_s() - newest.arrived_s

    @property
    def reliability(self) -> str:
        """The reliability of the subscription: `reliable` or `best_effort`."""
        return str(self._profile.reliability.name.lower())

    def quality(self) -> dict[str, Any]:
        """Return the quality of service that the newest subscription took."""
        profile = self._profile
        policies = {name: getattr(profile, name).name.lower() for name in ("reliability", "durability")}
        return {**policies, "depth": profile.depth}

    def clock_offset(self) -> dict[str, float] | None:
        """Return median and spread (the middle 90 %) of receive time minus stamp, in seconds, of the newest messages.

        None without stamps. It is the offset of the clocks and the latency, together.
        """
        with self._changed:
            offsets = sorted(self._offsets_s)
        if not offsets:
            return None
        low, median, high = (offsets[round(share * (len(offsets) - 1))] for share in (0.05, 0.5, 0.95))
        return {"median_s": round(median, 6), "spread_s": round(high - low, 6), "messages": len(offsets)}

    def forget(self) -> None:
        """Drop the messages that are kept, except those that hold until the next one."""
        with self._changed:
            self._repeated = 0
            if not self.holds:
                self._samples.clear()

    def heard(self) -> bool:
        """Return whether there is a publisher, and nothing between it and this stream."""
        return bool(qos.publishers(self._node, self.topic)) and not self._obstacle()

    def silence(self) -> str:
        """Say why nothing new comes on this topic, as part of a sentence."""
        if not qos.publishers(self._node, self.topic):
            return "nobody publishes it"
        if (obstacle := self._obstacle()) is not None:
            return obstacle
        names = ", ".join(sorted({qos.node_name(info) for info in qos.publishers(self._node, self.topic)}))
        if self._repeated:
            return f"the node {names} publishes it, but the stamps of its messages do not advance"
        return f"the node {names} publishes it, but sends nothing"

    def _obstacle(self) -> str | None:
        wrong_type = qos.wrong_type(self._node, self.topic)
        return wrong_type or qos.mismatch(self._node, self.topic, self._profile)

    def _subscribe(self) -> None:
        from rclpy.event_handler import SubscriptionEventCallbacks

        profile = qos.profile_for(self._node, self.topic)
        if self._subscription is not None and profile == self._profile:
            return
        self.close()
        self._profile = profile
        self._subscription = self._node.create_subscription(
            self._type,
            self.topic.ros_topic,
            self._on_message,
            profile,
            event_callbacks=SubscriptionEventCallbacks(
                matched=self._on_publishers,
                incompatible_qos=self._on_publishers,
                incompatible_type=lambda _: None,
                use_default_callbacks=False,
            ),
        )

    def _on_publishers(self, _event: Any) -> None:
        with self._subscribing:
            if self._subscription is not None:
                self._subscribe()

    def _on_message(self, message: Any) -> None:
        arrived_ns, arrived_s = self._clock.now_ns(), self._clock.now_s()
        stamp = stamp_ns(message)
        sample = Sample(arrived_ns if stamp is None else stamp, arrived_ns, arrived_s, message)
        with self._changed:
            if stamp is not None:
                self._offsets_s.append(sample.skew_s)
            if self._told is not None:
                self._told(message)
            if not self.holds and self._samples and sample.stamp_ns <= self._samples[-1].stamp_ns:
                self._repeated += 1
                return
            self._repeated = 0
            if self.holds:
                self._samples.clear()
            self._samples.append(sample)
            while sample.stamp_ns - self._samples[0].stamp_ns > self._history_ns:
                self._samples.popleft()
            self._changed.notify_all()
