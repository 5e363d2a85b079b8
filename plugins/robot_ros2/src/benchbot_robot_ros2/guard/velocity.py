"""A robot's guarded velocity: the published commands, and the state of the robot's safety devices."""

import math
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, FailureClass, MotionConfig
from benchbot_robot_ros2.declaration_keys import DeadMan, Safety, Signal, Topic
from benchbot_robot_ros2.guard.state import FIND_OUT, GuardState, Trip
from benchbot_robot_ros2.guard.topic import VelocityPublisher
from benchbot_robot_ros2.ramp import REST

if TYPE_CHECKING:
    from rclpy.node import Node

# A simulated robot whose clock stands still does not move either; for longer than this, something else is wrong.
CLOCK_STALL_S = 2.0
STOP = "benchbot/stop"
"""A std_srvs/srv/Trigger, and a topic of std_msgs/msg/Bool: whoever can reach the robot can stop it."""
# Looking at the graph costs little, but not nothing.
GRAPH_PERIOD_S = 0.1
LAST_ZEROS_STOPPED, LAST_ZEROS_AT_REST, LAST_ZEROS_PERIOD_S = 20, 4, 0.05
# A network that was gone keeps packets for about so long, and delivers them when it is back (Linux: 3 ARP requests).
STALE_COMMANDS_S = 3.0

# How long a guard that has stopped the robot waits before it publishes zero again.
STOPPED_PERIOD_S = 0.05

Change = Callable[[GuardState, float], None]


def stopping(trip: Trip) -> Change:
    """Return the change that stops the robot, for good."""
    return lambda state, _now_s: state.stop(trip.why, trip.fix)


class GuardedVelocity:
    """Publishes what a GuardState decides; e-stop and dead-man switch reach it from the node's thread.

    An emergency stop must have a publisher for as long as the robot moves. That it is silent says nothing: many publish
    only when the button changes.
    """

    def __init__(
        self,
        node: "Node",
        command: Topic,
        base_frame: str,
        safety: Safety,
        motion: MotionConfig,
        *,
        use_sim_time: bool,
        navigation: str | None = None,
    ) -> None:
        self.publisher = VelocityPublisher(node, command, base_frame)
        self.use_sim_time = use_sim_time
        self._node = node
        self.dead_man_unheard = False
        self._safety = safety
        self._calling_off = _calling_off(node, navigation)
        self._state = GuardState(
            motion,
            safety.command_timeout_s,
            safety.dead_man.timeout_s if safety.dead_man is not None else None,
            safety.take_over.timeout_s if safety.take_over is not None else math.inf,
        )
        # A device's callback may stop the robot while the main thread is about to publish another velocity.
        self._lock = threading.Lock()
        self._last_s = self.now_s()
        self._advanced_wall_s = self._looked_wall_s = time.monotonic()

    @property
    def trip(self) -> Trip | None:
        """The reason why the robot is stopped, None if it is not."""
        return self._state.trip

    @property
    def moving(self) -> bool:
        """True while the robot is commanded to move, or still brakes."""
        return self._state.moving

    @property
    def hand(self) -> tuple[bool, bool]:
        """Whether a person holds the take-over switch, and whether the robot is left to them."""
        return self._state.held, self._state.yielded

    def now_s(self) -> float:
        """Return the robot's time in seconds: simulated, or this computer's monotonic clock, which cannot be set."""
        return self._node.get_clock().now().nanoseconds / 1e9 if self.use_sim_time else time.monotonic()

    def listen_to_devices(self) -> None:
        """Subscribe to the declared devices; e-stop and take-over switch must have publishers. Offer to stop."""
        from rclpy.qos import qos_profile_sensor_data
        from std_msgs.msg import Bool
        from std_srvs.srv import Trigger

        self._node.create_service(Trigger, STOP, self._on_stop_service)
        # In a namespace, a fleet's robot is stopped alone and by the one topic that stops all.
        for topic in dict.fromkeys((self._node.resolve_topic_name(STOP), f"/{STOP}")):
            self._node.create_subscription(Bool, topic, partial(self._on_stop, topic), 1)
        if self._safety.e_stop is not None:
            self._subscribe_e_stop(self._safety.e_stop)
        if self._safety.dead_man is not None:
            self.dead_man_unheard = True
            switch = self._safety.dead_man
            self._node.create_subscription(
                _switch_type(switch), switch.ros_topic, self._on_dead_man, qos_profile_sensor_data
            )
        if self._safety.take_over is not None:
            switch = self._safety.take_over
            self._node.create_subscription(
                _switch_type(switch), switch.ros_topic, self._on_take_over, qos_profile_sensor_data
            )

    def _subscribe_e_stop(self, signal: Signal) -> None:
        from benchbot_robot_ros2.messages import message_type
        from benchbot_robot_ros2.qos import mismatch, profile_for, wrong_type

        profile = profile_for(self._node, signal)
        problem = wrong_type(self._node, signal) or mismatch(self._node, signal, profile)
        if problem:
            raise BenchbotError(
                f"The emergency stop {signal.ros_topic} cannot be heard.",
                f"The robot would not stop when it is pressed: {problem}.",
                "Mend driver.safety.e_stop in the robot's declaration, or what publishes it.",
                failure=FailureClass.PLATFORM,
            )
        kind = message_type(signal.ros_type)
        self._node.create_subscription(kind, signal.ros_topic, partial(self._on_e_stop, signal), profile)

    def missing(self, robot: str, waited_s: float) -> BenchbotError | None:
        """Return the error for what a robot needs before it may move, and lacks: a base, a clock, its e-stop."""
        if not self.publisher.heard:
            return self.publisher.unheard(robot, waited_s)
        if self.now_s() == 0:
            return BenchbotError(
                f"The robot '{robot}' has no clock.",
                f"Its declaration says use_sim_time: true, but in {waited_s:g} s nobody published a time on /clock.",
                "Start the simulator, or write use_sim_time: false for a robot that is not simulated.",
                failure=FailureClass.PLATFORM,
            )
        if (device := self._absent) is not None:
            name, key = device
            return BenchbotError(
                f"The robot '{robot}' has no {name}.",
                f"Its declaration names one, but in {waited_s:g} s nobody published on its topic.",
                f"Start its node, or mend driver.safety.{key} in the robot's declaration.",
                failure=FailureClass.PLATFORM,
            )
        return None

    @property
    def _absent(self) -> tuple[str, str] | None:
        """A declared device that nobody publishes: its name, and its key in the declaration."""
        safety = self._safety
        for topic, name, key in (
            (safety.e_stop, "emergency stop", "e_stop"),
            (safety.take_over, "take-over switch", "take_over"),
        ):
            if topic is not None and self._node.count_publishers(topic.ros_topic) == 0:
                return name, key
        return None

    def update(self, *changes: Change) -> None:
        """Pass new events to the state machine, and publish its velocity; it is called at least every 20 ms."""
        with self._lock:
            now_s = self.now_s()
            for change in changes:
                change(self._state, now_s)
            self._look_around(now_s)
            velocity = self._state.step(now_s)
            if velocity is not None:
                self.publisher.publish(velocity)
            if self._state.trip is not None:
                self._call_off()

    def _call_off(self) -> None:
        """Cancel all goals of the robot's navigation, once: zeros alone hold it for no longer than they are published.

        A request without a goal's name and time means all (https://design.ros2.org/articles/actions.html).
        """
        if self._calling_off is not None and self._calling_off.service_is_ready():
            from action_msgs.srv import CancelGoal

            self._calling_off.call_async(CancelGoal.Request())
            self._calling_off = None

    def finish(self) -> None:
        """Publish the last zeros: for a second when the robot was stopped, as a network may lose some.

        Where the base does not say that it has them, a few more: a velocity that is still on its way is not to be the
        last word.
        """
        for _ in range(LAST_ZEROS_AT_REST if self.trip is None else LAST_ZEROS_STOPPED):
            self.publisher.publish(REST)
            time.sleep(LAST_ZEROS_PERIOD_S)
        deadline_s = time.monotonic() + STALE_COMMANDS_S
        while self.trip is not None and time.monotonic() < deadline_s:
            if self.publisher.acknowledged(LAST_ZEROS_PERIOD_S):
                break
            self.publisher.publish(REST)

    def _look_around(self, now_s: float) -> None:
        wall_s = time.monotonic()
        if now_s != self._last_s or not self._state.moving:
            self._last_s, self._advanced_wall_s = now_s, wall_s
        if wall_s - self._advanced_wall_s > CLOCK_STALL_S:
            self._state.stop(
                f"The robot's clock has stood still for {CLOCK_STALL_S:g} s while it moved.",
                "See whether the simulator still runs; a robot that is not simulated needs use_sim_time: false.",
            )
        if self._state.moving and wall_s - self._looked_wall_s > GRAPH_PERIOD_S:
            self._looked_wall_s = wall_s
            if (device := self._absent) is not None:
                self._state.stop(
                    f"The {device[0]} is gone: nobody publishes it any more.",
                    "See that its node runs and is in reach, then start the run again.",
                )

    def _on_e_stop(self, signal: Signal, message: Any) -> None:
        from benchbot_robot_ros2.signals import says

        pressed = says(signal, message)
        self._from_device(lambda state, _: state.e_stop(pressed=pressed))

    def _on_stop(self, topic: str, message: Any) -> None:
        if message.data:
            self._from_device(stopping(Trip(f"Somebody stopped it by the topic {topic}.", FIND_OUT)))

    def _on_stop_service(self, _request: Any, response: Any) -> Any:
        service = self._node.resolve_service_name(STOP)
        self._from_device(stopping(Trip(f"Somebody stopped it by the service {service}.", FIND_OUT)))
        response.success, response.message = True, "The robot was stopped, and the run is over."
        return response

    def _on_dead_man(self, message: Any) -> None:
        self.dead_man_unheard = False
        held = _held(message, self._safety.dead_man)
        self._from_device(lambda state, now_s: state.dead_man(held=held, now_s=now_s))

    def _on_take_over(self, message: Any) -> None:
        switch = self._safety.take_over
        held = _held(message, switch)
        self._from_device(lambda state, now_s: state.take_over(held=held, now_s=now_s))
        buttons = getattr(message, "buttons", None)
        if switch is not None and buttons is not None and switch.button >= len(buttons):
            why = f"Nobody could take the robot over: its switch is button {switch.button}, of {len(buttons)}."
            self._from_device(lambda state, _: state.stop(why, "Mend driver.safety.take_over.button; 0 is the first."))

    def _from_device(self, change: Change) -> None:
        with self._lock:
            change(self._state, self.now_s())
            if self._state.trip is not None:
                self.publisher.publish(REST)


def _calling_off(node: "Node", navigation: str | None) -> Any:
    """Return the client that calls off the goals of a navigation, None without one."""
    from action_msgs.srv import CancelGoal

    return None if navigation is None else node.create_client(CancelGoal, f"{navigation}/_action/cancel_goal")


def _held(message: Any, switch: DeadMan | None) -> bool:
    if switch is None or switch.ros_type == "std_msgs/msg/Bool":
        return bool(message.data)
    return switch.button < len(message.buttons) and bool(message.buttons[switch.button])


def _switch_type(switch: DeadMan) -> type[Any]:
    from sensor_msgs.msg import Joy
    from std_msgs.msg import Bool

    switch_type: type[Any] = Joy if switch.ros_type == "sensor_msgs/msg/Joy" else Bool
    return switch_type
