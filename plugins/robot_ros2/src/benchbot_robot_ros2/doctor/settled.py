"""When a look at a graph may end early: what it has measured holds, and the rest of it is not expected to say more.

A finding that something is there needs it once. Ages and rates need several messages, which come until now and do not
drift. A finding that nothing else is there, such as a second robot, needs everybody to have had time to be discovered.
"""

import time
from collections.abc import Callable
from statistics import median
from typing import TYPE_CHECKING

from benchbot.plugin import Level
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import Timing
from benchbot_robot_ros2.doctor.live_watch import Stream, names
from benchbot_robot_ros2.doctor.message_checks import DEVICES, freshness

if TYPE_CHECKING:
    from rclpy.node import Node

# Whoever is there answers a node's announcements, which this one repeats each 0.3 s (fastdds.xml).
QUIET_S = 1.0
FEWEST, FEWEST_OF_FEEDBACK = 3, 6
# Of a topic's messages about half come in the later half of the time; of one that stops or began with a burst, fewer.
LATER = 1 / 3
AGAIN_S = 0.25


class Settling:
    """Says when a look has seen enough: the graph is quiet, all streams are steady, and all findings are `fine`."""

    def __init__(self, node: "Node", robot: Ros2Robot, seconds: float, fine: Callable[[list[Stream]], bool]) -> None:
        self._node, self._robot, self._fine = node, robot, fine
        self._quiet_since_s = self._again_s = time.monotonic()
        self._ends_s = time.monotonic() + seconds
        self._graph: tuple[object, ...] = ()

    def over(self, streams: list[Stream]) -> bool:
        """Return whether the look may end; to be asked again and again."""
        now_s = time.monotonic()
        graph = self._seen(streams)
        if graph != self._graph:
            self._graph, self._quiet_since_s = graph, now_s
        if now_s < max(self._quiet_since_s + QUIET_S, self._again_s):
            return False
        timing, simulated = self._robot.settings.timing, self._robot.settings.use_sim_time
        now_ns = self._node.get_clock().now().nanoseconds
        for stream in streams:
            seen_s, left_s = now_s - stream.since_s, max(0.0, self._ends_s - now_s)
            if not steady(stream, timing, now_ns, left_s / max(seen_s, 1e-3), simulated=simulated):
                return False
        # Reading pictures is dear.
        self._again_s = now_s + AGAIN_S
        return self._fine(streams)

    def _seen(self, streams: list[Stream]) -> tuple[object, ...]:
        graph, command = self._robot.graph, self._robot.command.ros_topic
        topics = [*(stream.use.topic.ros_topic for stream in streams), command, graph.clock, *graph.transforms]
        return (*names(self._node), *map(self._node.count_publishers, topics))


def steady(stream: Stream, timing: Timing, now_ns: int, left: float, *, simulated: bool) -> bool:
    """Return whether a stream is fine, and would be if it were watched for longer.

    `now_ns` is the node's time, `left` the rest of the look in lengths of the time since the first message. The later
    messages alone have to be fine, too, and all of them as old as they would be at the look's end if their age goes on
    to change as it has. Nothing is known of a silent stream. A device without a rate has said all with one message.
    """
    arrivals, use = list(stream.arrivals_ns), stream.use
    if use.role in DEVICES and use.rate_hz is None:
        return bool(arrivals)
    if len(arrivals) < (FEWEST if use.rate_hz is None else FEWEST_OF_FEEDBACK):
        return False
    later = [arrival for arrival in arrivals if arrival[0] >= (arrivals[0][0] + now_ns) / 2]
    if len(later) < LATER * len(arrivals):
        return False
    ageing_ns = round(_ageing_ns(arrivals) * left / 2)
    aged = [(received, None if stamp is None else stamp - ageing_ns) for received, stamp in arrivals]
    return all(
        finding.level is Level.OK
        for seen in (arrivals, later, aged)
        for finding in freshness(Stream(use, seen), timing, simulated=simulated)
    )


def _ageing_ns(arrivals: list[tuple[int, int | None]]) -> float:
    """Return by how much messages get older from the first to the last, by the medians of the two halves."""
    ages = [received - stamp for received, stamp in arrivals if stamp is not None]
    half = len(ages) // 2
    # A single late message is no trend. The halves' middles are half of the time apart.
    return 2 * (median(ages[-half:]) - median(ages[:half])) if half else 0.0
