"""Motion of a robot's arm over ROS 2: setpoints for its position controllers, and how an action ends.

Setpoints are streamed, one a control tick and each a tick ahead, as velocities of the base are: where they cease, since
the run was stopped or a process has died, the arm stands where the last of them is.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from benchbot.plugin import Outcome
from benchbot_robot_ros2 import qos
from benchbot_robot_ros2.arm import MOVE_GRIPPER, Arm, Floats, moved
from benchbot_robot_ros2.connected import ConnectedRobot
from benchbot_robot_ros2.declaration import ARRAY
from benchbot_robot_ros2.failures import failed
from benchbot_robot_ros2.messages import message_type, set_stamp

REACHED_RAD, REACHED_M = 0.01, 0.003
REST_S, REST_RAD, REST_M = 0.3, 0.003, 0.0005
LEAST_SEEN = 3
"""At rest is what has moved by less than this for so long, and in so many messages."""
REST_TIMEOUT_S = 3.0
LAG_RAD, LAG_S = 0.25, 0.3
"""A joint is held by something where it is so far from all that it was told within so long."""


class ArmMotion:
    """The arm of a connected robot, and publishers on the topics of its actions."""

    def __init__(self, robot: ConnectedRobot, arm: Arm, period_s: float, speed_factor: float) -> None:
        self._robot, self._arm, self._period_s, self._speed_factor = robot, arm, period_s, speed_factor
        self._topics = robot.robot.arm_commands
        self._publishers = {
            action: robot.node.create_publisher(message_type(topic.ros_type), topic.ros_topic, qos.sending(depth=1))
            for action, topic in self._topics.items()
        }
        self._told: dict[str, Floats] = {}

    def carry_out(self, action: str, arguments: Mapping[str, Any]) -> Iterator[Outcome | None]:
        """Send a setpoint and yield None, for each control tick, then yield how the action has ended.

        Raises BenchbotError for an argument that the arm does not have or that is beyond its limits, and when no
        controller listens.
        """
        goal = self._arm.target(action, arguments)
        self._check_heard(action)
        path = self._arm.path(action, self._start(action), goal, self._period_s, self._speed_factor)
        for tick, setpoint in enumerate(path):
            self._send(action, setpoint)
            yield None
            if action != MOVE_GRIPPER and self._lags(path[: tick + 1]):
                self.hold(action)
                yield Outcome.BLOCKED
                return
        since_s = self._robot.clock.now_s()
        while (ended := self._ended(action, goal, since_s)) is None:
            if self._robot.clock.now_s() - since_s > REST_TIMEOUT_S:
                ended = Outcome.TIMEOUT
                break
            self._send(action, goal)
            yield None
        if ended is Outcome.BLOCKED and action != MOVE_GRIPPER:
            self.hold(action)
        yield ended

    def hold(self, action: str) -> None:
        """Command what an action moves to stay where it is."""
        self._send(action, self._seen(action)[-1][1])

    def _start(self, action: str) -> Floats:
        """Return where a motion begins: where it was told to be, unless it is elsewhere, as fingers that hold are."""
        here = self._seen(action)[-1][1]
        told = self._told.get(action, here)
        return told if np.abs(told - here).max() < (REACHED_M if action == MOVE_GRIPPER else REACHED_RAD) else here

    def _seen(self, action: str) -> list[tuple[float, Floats]]:
        """Return when what an action moves was where, oldest first, by the messages of `REST_S`, three at least."""
        channel = self._robot.channels["joint_states"]
        (stream,) = channel.streams.values()
        samples = stream.samples
        count = sum(sample.arrived_s >= samples[-1].arrived_s - REST_S for sample in samples)
        recent = samples[-max(count, LEAST_SEEN) :]
        return [(sample.arrived_s, moved(action, channel.decode({"": sample.message}))) for sample in recent]

    def _lags(self, told: Floats) -> bool:
        here, recent = self._seen("move_joints")[-1][1], told[-1 - round(LAG_S / self._period_s) :]
        return bool(((here < recent.min(0) - LAG_RAD) | (here > recent.max(0) + LAG_RAD)).any())

    def _ended(self, action: str, goal: Floats, since_s: float) -> Outcome | None:
        """Return how an action ends whose last setpoint was sent at a time, None while something still moves."""
        seen = self._seen(action)
        if len(seen) < LEAST_SEEN or seen[0][0] < since_s:
            return None
        still, near = (REST_M, REACHED_M) if action == MOVE_GRIPPER else (REST_RAD, REACHED_RAD)
        if np.ptp([positions for _, positions in seen], axis=0).max() > still:
            return None
        return Outcome.REACHED if np.abs(seen[-1][1] - goal).max() < near else Outcome.BLOCKED

    def _check_heard(self, action: str) -> None:
        if not self._publishers[action].get_subscription_count():
            topic = self._topics[action]
            raise failed(
                f"The robot's arm does not listen: nobody subscribes to {topic.ros_topic}.",
                f"'{action}' sends its setpoints there, as {topic.ros_type}.",
                "Start its controller (ros2 control list_controllers shows it), or correct the topic of "
                f"connections.{action}.",
            )

    def _send(self, action: str, setpoint: Floats) -> None:
        """Publish a setpoint of the joints (N,), or of the gripper's width (1,), which its fingers share."""
        self._told[action] = setpoint
        is_gripper = action == MOVE_GRIPPER
        names = list(self._arm.gripper if is_gripper else self._arm.joints)
        values = [float(value) for value in setpoint]
        if is_gripper:
            values = [values[0] / len(names)] * len(names)
        topic = self._topics[action]
        kind = message_type(topic.ros_type)
        if topic.ros_type == ARRAY:
            message = kind(data=values)
        else:
            message = kind(name=names, position=values)
            set_stamp(message, self._robot.node.get_clock().now().nanoseconds)
        self._publishers[action].publish(message)
