"""Checks of a robot's ROS 2 graph that read no messages: publishers, subscribers and services."""

import difflib
from collections.abc import Iterator
from typing import TYPE_CHECKING

from benchbot.plugin import Finding, Level
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import MovedByNavigation, ReturnByNavigation, ReturnByService, Safety
from benchbot_robot_ros2.doctor.live_watch import Stream
from benchbot_robot_ros2.guard.topic import VelocityPublisher

if TYPE_CHECKING:
    from rclpy.node import Node

VELOCITY_TYPES = {"geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"}
NEAR = 0.5


def silent(node: "Node", stream: Stream, declared: set[str], seconds: float) -> Finding:
    """Say why a declared topic brought no message."""
    topic = stream.use.topic
    subject = f"topic {topic.ros_topic}"
    if stream.error is not None:
        return Finding(Level.BROKEN, subject, f"{stream.error.title} {stream.error.why}", stream.error.fix)
    if not node.count_publishers(topic.ros_topic):
        detail = f"nothing publishes it ({stream.use.role}, {topic.ros_type}){_near_miss(node, stream, declared)}"
        fix = "Start the robot's driver, or declare the topic's true name; ros2 topic list shows them all."
        return Finding(Level.BROKEN, subject, detail, fix)
    if (why := qos.wrong_type(node, topic)) is not None:
        return Finding(Level.BROKEN, subject, why, f"Declare the type that is published for {stream.use.role}.")
    if (why := qos.mismatch(node, topic, qos.profile_for(node, topic))) is not None:
        fix = "Leave qos out of the declaration, so that it is matched to the publisher."
        return Finding(Level.BROKEN, subject, why, fix)
    if stream.use.optional:
        return Finding(Level.OK, subject, f"{stream.use.role}, published, silent so far")
    names = ", ".join(_publishers(node, topic.ros_topic))
    detail = f"{names} publishes it, but nothing came in {seconds:g} s"
    fix = "Look at that node's log; between two computers, at the firewall and the network (docs/ros2.md)."
    return Finding(Level.BROKEN, subject, detail, fix)


def rivals(node: "Node", stream: Stream) -> Finding | None:
    """Warn when more than one node publishes a topic, as when two robots share a domain."""
    names = _publishers(node, stream.use.topic.ros_topic)
    if len(names) < 2:
        return None
    fix = "Give each robot its own ROS_DOMAIN_ID or namespace, or end one of the nodes."
    return Finding(Level.WARNING, f"topic {stream.use.topic.ros_topic}", f"{' and '.join(names)} publish it", fix)


def velocity(node: "Node", robot: Ros2Robot, publisher: VelocityPublisher, seconds: float) -> Iterator[Finding]:
    """Say who listens for velocity commands, and who else commands them; nothing is published."""
    command = robot.command
    subject = f"velocity {command.ros_topic}"
    if publisher.heard:
        listeners = node.get_subscriptions_info_by_topic(command.ros_topic)
        yield Finding(Level.OK, subject, f"{', '.join(sorted(map(qos.node_name, listeners)))} listens")
    else:
        error = publisher.unheard(robot.name, seconds)
        elsewhere = sorted(
            name
            for name, kinds in node.get_topic_names_and_types()
            if name != command.ros_topic and node.count_subscribers(name) and set(kinds) & VELOCITY_TYPES
        )
        hint = f" Somebody listens for velocities on {' and '.join(elsewhere)}." if elsewhere else ""
        yield Finding(Level.BROKEN, subject, f"{error.why}{hint}", error.fix)
    others = [name for name in _publishers(node, command.ros_topic) if name != node.get_fully_qualified_name()]
    if others:
        fix = "End it, or have twist_mux choose between them: two commanders fight over the robot."
        # A robot that Nav2 drives is stopped on this topic only.
        level = Level.BROKEN if isinstance(robot.settings.motion, MovedByNavigation) else Level.WARNING
        yield Finding(level, subject, f"{' and '.join(others)} commands velocities, too", fix)


def arm(node: "Node", robot: Ros2Robot) -> Iterator[Finding]:
    """Say whether a controller listens to the setpoints of each action of the arm; nothing is published."""
    for action, topic in robot.arm_commands.items():
        subject = f"{action} {topic.ros_topic}"
        listeners = node.get_subscriptions_info_by_topic(topic.ros_topic)
        heard = sorted(qos.node_name(info) for info in listeners if info.topic_type == topic.ros_type)
        if heard:
            yield Finding(Level.OK, subject, f"{', '.join(heard)} listens")
        else:
            fix = "Start its controller (ros2 control list_controllers), or declare the topic and the type it has."
            yield Finding(Level.BROKEN, subject, f"nobody subscribes to it as {topic.ros_type}", fix)


def safety_devices(safety: Safety) -> Iterator[Finding]:
    """Warn of safety devices that are not declared."""
    if safety.e_stop is None:
        fix = "Declare driver.safety.e_stop: {ros_topic: /e_stop, ros_type: std_msgs/msg/Bool}, true when pressed."
        yield Finding(Level.WARNING, "e-stop", "none is declared: BenchBot does not know when it is pressed", fix)
    if safety.dead_man is None:
        fix = "Declare driver.safety.dead_man: {ros_topic: /joy, ros_type: sensor_msgs/msg/Joy, button: 4}."
        yield Finding(Level.WARNING, "dead-man switch", "none is declared: nobody need hold a button", fix)


def navigation(node: "Node", robot: Ros2Robot) -> Iterator[Finding]:
    """Say whether somebody navigates the robot, and takes the pose that it starts at, where that is declared."""
    way, topic = robot.settings.motion, robot.settings.initial_pose
    if isinstance(way, MovedByNavigation) and f"{way.ros_action}/_action/send_goal" in dict(_services(node)):
        yield Finding(Level.OK, "motion", f"action {way.ros_action}")
    elif isinstance(way, MovedByNavigation):
        fix = "Start Nav2 with a map, or leave driver.motion out of the declaration."
        yield Finding(Level.BROKEN, "motion", f"nobody offers the action {way.ros_action}", fix)
    if topic is not None and not node.count_subscribers(topic):
        fix = "Start AMCL, or correct driver.localisation.initial_pose in the declaration."
        yield Finding(Level.BROKEN, "initial pose", f"nobody subscribes to {topic}", fix)
    elif topic is not None:
        yield Finding(Level.OK, "initial pose", f"told on {topic}")


def return_to_start(node: "Node", robot: Ros2Robot) -> Iterator[Finding]:
    """Say whether the robot can be brought back to its start."""
    subject, way = "return to start", robot.settings.return_to_start
    services = dict(_services(node))
    if isinstance(way, ReturnByService):
        kinds = services.get(way.ros_service)
        if kinds is None:
            fix = "Start the node that offers it, or declare driver.return_to_start: {by: operator}."
            yield Finding(Level.BROKEN, subject, f"nobody offers the service {way.ros_service}", fix)
        elif "std_srvs/srv/Trigger" not in kinds:
            fix = "Offer it as std_srvs/srv/Trigger."
            yield Finding(Level.BROKEN, subject, f"{way.ros_service} is a {', '.join(kinds)}", fix)
        else:
            yield Finding(Level.OK, subject, f"service {way.ros_service}")
        if way.scene_node is not None and f"{way.scene_node}/set_parameters" not in services:
            fix = "Start it, or leave scene_node out of the declaration."
            yield Finding(Level.BROKEN, subject, f"there is no node {way.scene_node}", fix)
    elif isinstance(way, ReturnByNavigation):
        if f"{way.ros_action}/_action/send_goal" in services:
            yield Finding(Level.OK, subject, f"action {way.ros_action}")
        else:
            fix = "Start Nav2 with a map, or declare driver.return_to_start: {by: operator}."
            yield Finding(Level.BROKEN, subject, f"nobody offers the action {way.ros_action}", fix)
    else:
        yield Finding(Level.OK, subject, "a person puts the robot there, when asked")


def calls(node: "Node", robot: Ros2Robot) -> Iterator[Finding]:
    """Say whether the services that are called before and after a run are there; none is called."""
    services = dict(_services(node))
    for call in (*robot.settings.before, *robot.settings.after):
        kinds = services.get(call.ros_service)
        if kinds is None:
            fix = "Start the node that offers it, or correct driver.before and driver.after."
            yield Finding(Level.BROKEN, f"service {call.ros_service}", "nobody offers it", fix)
        elif call.ros_type not in kinds:
            fix = f"Declare it as {' or '.join(kinds)}."
            yield Finding(Level.BROKEN, f"service {call.ros_service}", f"it is no {call.ros_type}", fix)
        else:
            yield Finding(Level.OK, f"service {call.ros_service}", call.ros_type)


def _services(node: "Node") -> Iterator[tuple[str, list[str]]]:
    # A graph's list of services has those of clients, too; a node's own list has what it serves.
    for name, namespace in node.get_node_names_and_namespaces():
        if f"{namespace.rstrip('/')}/{name}" != node.get_fully_qualified_name():
            yield from node.get_service_names_and_types_by_node(name, namespace)


def _publishers(node: "Node", topic: str) -> list[str]:
    return sorted(map(qos.node_name, node.get_publishers_info_by_topic(topic)))


def _near_miss(node: "Node", stream: Stream, declared: set[str]) -> str:
    """Return a hint at published topics of the same type with a similar name."""
    wanted = stream.use.topic
    candidates = [
        name
        for name, kinds in node.get_topic_names_and_types()
        if wanted.ros_type in kinds and name not in declared and node.count_publishers(name)
    ]
    near = difflib.get_close_matches(wanted.ros_topic, candidates, n=1, cutoff=NEAR)
    return f": did you mean {near[0]}?" if near else ""
