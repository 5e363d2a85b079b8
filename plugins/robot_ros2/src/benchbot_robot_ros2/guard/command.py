"""`benchbot guard`: on the robot's own computer, stops a base without a time-out of its own when the network fails."""

import math
import signal
import threading
import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.plugin import BenchbotError
from benchbot_robot_ros2.ramp import REST

if TYPE_CHECKING:
    from rclpy.node import Node

    from benchbot.plugin import MotionConfig
    from benchbot_robot_ros2.declaration import Ros2Robot
    from benchbot_robot_ros2.declaration_keys import Topic
    from benchbot_robot_ros2.guard.velocity import GuardedVelocity

PERIOD_S = 0.02
# A stopped robot moves again after so long without a command to move: whoever drives it has let go.
RELEASED_AFTER_S = 1.0


def guard(
    robot: Annotated[str, typer.Option(metavar="ROBOT", help="The robot: benchbot list robots.")],
    source: Annotated[
        str, typer.Option("--in", metavar="TOPIC", help="Where BenchBot publishes velocities.")
    ] = "benchbot/cmd_vel",
    target: Annotated[
        str | None,
        typer.Option("--out", metavar="TOPIC", help="Where the base listens. [default: as the robot declares]"),
    ] = None,
) -> None:
    """Stand between the network and the base: pass velocities on within the limits, and stop the base on silence.

    Runs on the robot's own computer until Ctrl-C. It stops the base when no velocity came for the declared
    command_timeout_s, or by the declared e-stop or dead-man switch; the robot moves again after a second without a
    command to move.
    """
    from benchbot.plugin import Catalog, MotionConfig
    from benchbot.plugin import load_plugins as load

    declaration = Catalog(load()).get("robots", robot).data
    if declaration["type"] != "ros2":
        raise BenchbotError(
            f"The robot '{robot}' is no ROS 2 robot.",
            f"It is of the type {declaration['type']}: nobody needs to guard it.",
            "Name a robot of the type ros2: benchbot list robots",
        )
    from benchbot_robot_ros2.declaration import Ros2Robot

    ros2_robot = Ros2Robot.from_declaration(declaration)
    source = ros2_robot.names.resolved(source)
    target = ros2_robot.command.ros_topic if target is None else ros2_robot.names.resolved(target)
    if source == target:
        raise BenchbotError(
            f"The guard would listen to itself: both topics are {source}.",
            "BenchBot publishes on one topic, and the base listens on another; the guard stands between them.",
            "Name the base's topic with --out, or BenchBot's with --in.",
        )
    _stand_between(ros2_robot, MotionConfig.from_robot(declaration, "ground_truth"), source, target)


def _stand_between(robot: "Ros2Robot", motion: "MotionConfig", source: str, target: str) -> None:
    import msgspec

    from benchbot_robot_ros2.guard.velocity import GuardedVelocity
    from benchbot_robot_ros2.ros import running_node

    settings = robot.settings
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: ended.set())
    with running_node("benchbot_base_guard", use_sim_time=settings.use_sim_time, graph=robot.graph) as node:
        command = msgspec.structs.replace(robot.command, ros_topic=target)
        # A person's take-over is the driver's to heed: it commands nothing then.
        safety = msgspec.structs.replace(settings.safety, take_over=None)
        velocity = GuardedVelocity(node, command, robot.base_frame, safety, motion, use_sim_time=settings.use_sim_time)
        deadline_s = time.monotonic() + settings.timing.wait_s
        while (problem := velocity.missing(robot.name, settings.timing.wait_s)) is not None:
            if ended.wait(PERIOD_S):
                return
            if time.monotonic() > deadline_s:
                raise problem
        velocity.listen_to_devices()
        is_holonomic = motion.lateral_limit_mps > 0
        relay = _Relay(node, velocity, msgspec.structs.replace(command, ros_topic=source), is_holonomic=is_holonomic)
        console.note(f"The base of {robot.name} is guarded: velocities from {source} go to {target}. Ctrl-C ends it.")
        try:
            while not ended.wait(PERIOD_S):
                relay.update()
            if velocity.moving:
                velocity.update(lambda state, _: state.stop("The guard ended."))
        finally:
            velocity.finish()


class _Relay:
    """A relay of commands from a topic to the guard; it reports stops, and releases them once commands cease."""

    def __init__(self, node: "Node", velocity: "GuardedVelocity", source: "Topic", *, is_holonomic: bool) -> None:
        from rclpy.qos import qos_profile_sensor_data

        from benchbot_robot_ros2.guard.topic import message_type

        self._velocity = velocity
        self._is_holonomic = is_holonomic
        self._stopped = False
        self._driven_s = -math.inf
        # Best effort, even where more is offered: a late command is worse than none.
        node.create_subscription(message_type(source), source.ros_topic, self._on_command, qos_profile_sensor_data)

    def update(self) -> None:
        """Update the guard of the base; it is called at least every 20 ms."""
        self._velocity.update()
        trip = self._velocity.trip
        if trip is not None and not self._stopped:
            console.note(f"Stopped: {trip.why}")
        elif trip is not None and time.monotonic() - self._driven_s > RELEASED_AFTER_S:
            self._velocity.update(lambda state, _: state.release())
            if self._velocity.trip is None:
                console.note("Nobody drives any more: the base may move again.")
        self._stopped = self._velocity.trip is not None

    def _on_command(self, message: Any) -> None:
        from benchbot_robot_ros2.guard.topic import velocity_of

        wanted = velocity_of(message)
        if wanted != REST:
            self._driven_s = time.monotonic()
        if wanted.lateral_mps and not self._is_holonomic:
            # Without it the base would go where nobody sent it.
            self._velocity.update(
                lambda state, _: state.stop(
                    f"A velocity of {wanted.lateral_mps:.2f} m/s sideways was commanded, and the robot's declaration "
                    "has no limits.lateral_mps.",
                    "Let what drives the base command linear.x and angular.z only (in Nav2: vy_max: 0), or declare how "
                    "fast a holonomic base is to both sides: limits: {lateral_mps: 0.5}",
                )
            )
        self._velocity.update(lambda state, now_s: state.command(wanted, now_s))
