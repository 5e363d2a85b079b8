"""`benchbot doctor --robot` on a live graph: is this robot ready, and what is missing?"""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from benchbot.plugin import BenchbotError, Finding, Level, MotionConfig, PlatformSpec
from benchbot_robot_ros2 import battery, callbacks, obstacles, ros, signals, transforms
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import Topic
from benchbot_robot_ros2.doctor import graph_checks, live_watch, message_checks, sensor_agreement, transform_checks
from benchbot_robot_ros2.doctor.live_watch import Stream
from benchbot_robot_ros2.doctor.settled import Settling
from benchbot_robot_ros2.guard.topic import VelocityPublisher
from benchbot_robot_ros2.provenance import discovery_range

if TYPE_CHECKING:
    from rclpy.node import Node

    from benchbot_robot_ros2.transforms import TransformTree

LOOK_S = 5.0
# Above, a domain's ports lie among those that Linux gives to clients, and may be taken.
HIGHEST_DOMAIN = 101
RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")


def diagnose(spec: PlatformSpec) -> Iterator[Finding]:
    """Look at the declared robot for `spec.options["seconds"]` (default 5) and yield what works and what does not.

    The look ends earlier when all is well and `settled` says so; what is wrong or missing has all of the time.
    Without that option a slow topic has as long for its first message as in a run, `driver.timing.wait_s`. Nothing is
    commanded: the robot does not move. Raises BenchbotError when the declaration itself is wrong.
    """
    robot = Ros2Robot.from_declaration(spec.robot)
    seconds = float(spec.options.get("seconds", LOOK_S))
    obstacles.check_declared(robot, MotionConfig.from_robot(spec.robot, spec.localisation))
    signals.check(robot)
    ros.prepare()
    surroundings = list(environment(robot.graph))
    yield from surroundings
    if any(finding.level is Level.BROKEN for finding in surroundings):
        return
    with ros.running_node("benchbot_doctor", use_sim_time=robot.settings.use_sim_time, graph=robot.graph) as node:
        found = live_watch.others(node, seconds)
        if not found:
            yield _nobody(robot.graph)
            return
        yield Finding(Level.OK, "graph", f"{len(found)} other node{'s' * (len(found) != 1)}: {_some(found)}")
        seen = _Seen(
            robot,
            node,
            transforms.listen(node, topics=robot.graph.transforms),
            VelocityPublisher(node, robot.command, robot.base_frame),
            node.get_clock().now().nanoseconds,
            seconds=seconds,
            patience_s=seconds if "seconds" in spec.options else max(seconds, robot.settings.timing.wait_s),
        )
        # What is not declared does not change by looking.
        undeclared = list(graph_checks.safety_devices(robot.settings.safety))

        def fine(streams: list[Stream]) -> bool:
            return all(finding.level is Level.OK or finding in undeclared for finding in _findings(seen, streams))

        settling = Settling(node, robot, seconds, fine)
        wanted = list(live_watch.uses(robot))
        yield from _findings(seen, live_watch.watch(node, wanted, seconds, seen.patience_s, settling.over))


@dataclass(frozen=True)
class _Seen:
    """A robot, the node that looks at it, and for how long at most."""

    robot: Ros2Robot
    node: "Node"
    tree: "TransformTree | None"
    publisher: VelocityPublisher
    began_ns: int
    seconds: float
    patience_s: float


def _findings(seen: _Seen, streams: list[Stream]) -> Iterator[Finding]:
    """Yield what is to be said of what was seen until now."""
    robot, node, tree = seen.robot, seen.node, seen.tree
    clock = list(_clock(node, robot.graph.clock, simulated=robot.settings.use_sim_time, began_ns=seen.began_ns))
    yield from clock
    yield from _topics(node, robot, streams, seen.patience_s, timed=all(f.level is not Level.BROKEN for f in clock))
    yield from _observations(robot, tree, streams)
    published = any(map(node.count_publishers, robot.graph.transforms))
    yield from transform_checks.check(robot, tree, published=published)
    yield from graph_checks.velocity(node, robot, seen.publisher, seen.seconds)
    yield from graph_checks.arm(node, robot)
    yield from graph_checks.safety_devices(robot.settings.safety)
    yield from _devices(robot, streams)
    yield from graph_checks.return_to_start(node, robot)
    yield from graph_checks.navigation(node, robot)
    yield from graph_checks.calls(node, robot)


def environment(graph: ros.Graph = ros.HERE) -> Iterator[Finding]:
    """Say which domain, discovery range and middleware ROS 2 uses in this process to reach a robot's graph."""
    domain = _domain(graph)
    reach = discovery_range()
    middleware = graph.rmw or os.environ["RMW_IMPLEMENTATION"]
    if not domain.isdecimal() or int(domain) > 232:
        fix = f"Set it to a number from 0 to {HIGHEST_DOMAIN}, the same as on the robot."
        yield Finding(Level.BROKEN, "ROS_DOMAIN_ID", f"'{domain}' is not a domain", fix)
    elif int(domain) > HIGHEST_DOMAIN:
        fix = f"Use a number from 0 to {HIGHEST_DOMAIN}, the same here and on the robot."
        yield Finding(Level.WARNING, "ROS_DOMAIN_ID", f"{domain}: its ports may be taken by other programs", fix)
    else:
        yield Finding(Level.OK, "ROS_DOMAIN_ID", domain)
    if reach not in RANGES:
        fix = f"Set it to one of {', '.join(RANGES)}; for a robot on the network: SUBNET."
        yield Finding(Level.BROKEN, "ROS_AUTOMATIC_DISCOVERY_RANGE", f"'{reach}' is not a range", fix)
    elif reach == "OFF":
        fix = "Set it to SUBNET for a robot on the network, to LOCALHOST for one on this machine."
        yield Finding(Level.BROKEN, "ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF: no robot can be found", fix)
    elif reach == "LOCALHOST":
        yield Finding(Level.OK, "discovery", "only this machine; for a robot on the network: SUBNET")
    else:
        yield Finding(Level.OK, "discovery", reach)
    if ros.is_installed(middleware):
        yield Finding(Level.OK, "middleware", middleware)
    else:
        fix = "Unset RMW_IMPLEMENTATION, or install it: sudo apt install ros-jazzy-" + middleware.replace("_", "-")
        yield Finding(Level.BROKEN, "middleware", f"{middleware} is not installed here", fix)


def _domain(graph: ros.Graph) -> str:
    return os.environ.get("ROS_DOMAIN_ID") or "0" if graph.domain is None else str(graph.domain)


def _nobody(graph: ros.Graph) -> Finding:
    fix = (
        "Switch the robot on; use its ROS_DOMAIN_ID; be in its network with multicast allowed; "
        "unset ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST when it is not on this machine (docs/ros2.md, network)."
    )
    return Finding(Level.BROKEN, "graph", f"no other node is in domain {_domain(graph)}", fix)


def _clock(node: "Node", topic: str, *, simulated: bool, began_ns: int) -> Iterator[Finding]:
    published = node.count_publishers(topic) > 0
    if simulated and not published:
        fix = "Start the simulator, or set driver.use_sim_time: false for a robot in the real world."
        yield Finding(Level.BROKEN, "clock", f"simulated time is declared, but nothing publishes {topic}", fix)
    elif simulated and node.get_clock().now().nanoseconds <= began_ns:
        yield Finding(Level.BROKEN, "clock", f"{topic} stands still", "Unpause the simulator, or start it again.")
    elif simulated:
        yield Finding(Level.OK, "clock", f"simulated time, from {topic}")
    elif published:
        fix = "Set driver.use_sim_time: true for a simulated robot, or end what publishes it."
        yield Finding(Level.WARNING, "clock", f"{topic} is published, but simulated time is not declared", fix)
    else:
        yield Finding(Level.OK, "clock", "this machine's")


def _topics(node: "Node", robot: Ros2Robot, streams: list[Stream], seconds: float, *, timed: bool) -> Iterator[Finding]:
    declared = {stream.use.topic.ros_topic for stream in streams}
    for stream in streams:
        if stream.last is None:
            yield graph_checks.silent(node, stream, declared, seconds)
            continue
        if timed:
            settings = robot.settings
            yield from message_checks.freshness(stream, settings.timing, simulated=settings.use_sim_time)
            if (end := message_checks.stopped(stream, node.get_clock().now().nanoseconds)) is not None:
                yield end
        yield from message_checks.frame(stream, robot.base_frame)
        if (rival := graph_checks.rivals(node, stream)) is not None:
            yield rival


def _observations(robot: Ros2Robot, tree: "TransformTree | None", streams: list[Stream]) -> Iterator[Finding]:
    """Turn the last messages into observations, as the driver would, and look at these."""
    last = {stream.use.role: stream.last for stream in streams}
    decoded: dict[str, Any] = {}
    for channel, connection in robot.observations.items():
        parts = connection.parts()
        if not parts:
            continue
        arrived = {part: last.get(f"{channel}.{part}" if part else channel) for part in parts}
        try:
            callback = callbacks.find(connection.callback_robot or channel)
            yield from _unreadable(channel, parts, callback)
            if all(message is not None for message in arrived.values()):
                decoded[channel] = callback.decode(arrived)
                if channel == "joint_states" and robot.arm is not None:
                    decoded[channel] = robot.arm.select(decoded[channel])
        except BenchbotError as error:
            yield Finding(Level.BROKEN, channel, f"{error.title} {error.why}", error.fix)
        except ValueError as error:
            fix = "Correct the robot's driver, or name another callback with callback_robot."
            yield Finding(Level.BROKEN, channel, f"its messages cannot be used: {error}", fix)
    for channel, message in last.items():
        if channel.endswith("_info") and message is not None:
            image = decoded.get(channel.removesuffix("_info"))
            shape = getattr(image, "shape", None)
            size = (int(shape[0]), int(shape[1])) if shape is not None else None
            yield from message_checks.camera_info(_topic(robot, channel), message, size)
    if "image_depth" in decoded:
        yield from message_checks.depth(_topic(robot, "image_depth"), decoded["image_depth"])
    if "laser" in decoded:
        mount = transform_checks.mounted(robot, tree, robot.laser_frame)
        yield from message_checks.laser(_topic(robot, "laser"), decoded["laser"], mount)
        camera = transform_checks.mounted(robot, tree, robot.camera_frame)
        if mount is not None and camera is not None and {"image_depth", "image_depth_info"} <= decoded.keys():
            intrinsics = decoded["image_depth_info"]["matrix_intrinsics"]
            yield from sensor_agreement.check(decoded["laser"], mount, decoded["image_depth"], camera, intrinsics)


def _unreadable(channel: str, parts: Mapping[str, Topic], callback: callbacks.Callback) -> Iterator[Finding]:
    for part, topic in parts.items():
        accepted = callback.types.get(part, frozenset())
        if topic.ros_type not in accepted:
            name = f"{channel}.{part}" if part else channel
            detail = f"the callback '{callback.name}' cannot read {topic.ros_type} as {name}"
            fix = f"Declare one of {', '.join(sorted(accepted)) or 'its parts: ' + ', '.join(callback.types)}."
            yield Finding(Level.BROKEN, channel, detail, fix)


def _devices(robot: Ros2Robot, streams: list[Stream]) -> Iterator[Finding]:
    """Say what the safety devices said last."""
    last = {stream.use.role: stream.last for stream in streams}
    safety = robot.settings.safety
    e_stop, collision, charge = last.get("e_stop"), last.get("collision"), last.get("battery")
    if e_stop is not None and safety.e_stop is not None and signals.says(safety.e_stop, e_stop):
        fix = "Release it before a run; a run that meets it pressed is stopped."
        yield Finding(Level.WARNING, "e-stop", "it is pressed", fix)
    elif e_stop is not None:
        yield Finding(Level.OK, "e-stop", "released")
    for switch, role, name in (
        (safety.dead_man, "dead_man", "dead-man switch"),
        (safety.take_over, "take_over", "take-over switch"),
    ):
        buttons = getattr(last.get(role), "buttons", None)
        if switch is not None and buttons is not None and switch.button >= len(buttons):
            detail = f"button {switch.button} is declared, but the joystick has {len(buttons)}"
            fix = "Declare another button, counted from 0: ros2 topic echo shows which one changes when it is pressed."
            yield Finding(Level.BROKEN, name, detail, fix)
    if safety.battery is not None and charge is not None:
        problem = battery.problem(safety.battery, charge)
        fix = "Charge it before a run; a trial does not begin like this."
        if problem is None:
            yield Finding(Level.OK, "battery", battery.charge(safety.battery, charge))
        else:
            yield Finding(Level.WARNING, "battery", problem, fix)
    if collision is not None and safety.collision is not None and signals.says(safety.collision, collision):
        yield Finding(Level.WARNING, "collision", "the robot touches something", "Free it, and reset its bumper.")


def _topic(robot: Ros2Robot, channel: str) -> str:
    return robot.observations[channel].parts()[""].ros_topic


def _some(names: list[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
