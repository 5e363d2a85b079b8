"""A connected robot: its node, clock, streams, localisation and guard, which are there for a whole run."""

import math
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import Any

from benchbot.plugin import OBSERVATIONS, BenchbotError, MotionConfig, Pose, did_you_mean
from benchbot_robot_ros2 import calls, ros, signals
from benchbot_robot_ros2.callbacks import Callback as Decoder
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import LocalisedByTopic, LocalisedByTransforms, Topic
from benchbot_robot_ros2.failures import failed
from benchbot_robot_ros2.guard.link import Guard
from benchbot_robot_ros2.localisation import Localisation
from benchbot_robot_ros2.observing import (
    Channel,
    Wait,
    check_frame,
    check_skew,
    frame_of,
    longest_delay_s,
    missing,
    wrong_frame,
)
from benchbot_robot_ros2.robot_clock import RobotClock
from benchbot_robot_ros2.standstill import measured_velocity, rested, speed_mps
from benchbot_robot_ros2.streams import HISTORY_NS, Sample, Stream

PICTURES = frozenset({"sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"})


class ConnectedRobot:
    """Connects to a robot and waits until every declared topic is heard.

    `changed` is notified of all that comes from it; `feedback` has to keep coming while it moves; `contact` is set when
    its collision topic says so. Raises BenchbotError that names each topic on which nothing comes, and why.
    """

    def __init__(
        self,
        robot: Ros2Robot,
        motion: MotionConfig,
        callbacks: dict[str, Decoder],
        changed: threading.Condition,
    ) -> None:
        self.robot = robot
        self.changed = changed
        with ExitStack() as resources:
            settings = robot.settings
            self.node = resources.enter_context(
                ros.running_node("benchbot", use_sim_time=settings.use_sim_time, graph=robot.graph)
            )
            # Until there is a guard, which outlives this process, to see to it.
            ending = resources.enter_context(ExitStack())
            ending.callback(calls.after, self.node, robot.name, settings.after)
            calls.before(self.node, robot.name, settings.before)
            self.clock = RobotClock(self.node, simulated=settings.use_sim_time, changed=changed)
            resources.callback(self.clock.close)
            self.tree = self._transforms()
            self.odometry = self._stream(settings.odometry)
            self.place = self._place()
            self.contact = threading.Event()
            self._collision = self._collisions()
            self.battery = None if settings.safety.battery is None else self._stream(settings.safety.battery)
            self.channels = {
                name: Channel(
                    name,
                    callback,
                    {part: self._observed(topic) for part, topic in robot.observations[name].parts().items()},
                    frame_of(name, robot),
                    robot.arm if name == "joint_states" else None,
                )
                for name, callback in callbacks.items()
            }
            looked_at = settings.safety.obstacles if motion.stops_before_contact else ()
            models = ("image_depth_info",) if "image_depth" in looked_at else ()
            joints = ("joint_states",) if robot.arm_commands else ()
            self._watched = [self.channels[name] for name in (*looked_at, *models, *joints)]
            ahead = [self.channels[name].streams[""] for name in (*looked_at, *joints)]
            self.feedback = [stream for stream in (self.odometry, self.place, *ahead) if stream and not stream.holds]
            self.localisation = Localisation(robot, self.odometry, self.place, self.tree)
            self._await_first_messages()
            self.check_feedback()
            self.guard = Guard.start(robot, motion)
            ending.pop_all()
            resources.callback(self.guard.close)
            self._resources = resources.pop_all()

    def await_rest(self, check: Callable[[], None]) -> None:
        """Start again: wait until new odometry shows that the robot is at rest, and its position is known.

        `check` is called again and again. Afterwards nothing has touched the robot yet. Raises BenchbotError when it
        does not come to rest.
        """
        wait, since_ns = self._forget()
        while True:
            check()
            if self.clock.set_back_s:
                # A simulator that starts again may begin its time again.
                wait, since_ns = self._forget()
            # What was under way while the robot was brought here does not count.
            odometry = [sample for sample in self.odometry.samples if sample.stamp_ns >= since_ns]
            place = self.place.newest if self.place is not None else None
            placed = (
                self.place is None
                or self._is_told
                or (place is not None and (self.place.holds or place.stamp_ns >= since_ns))
            )
            # Without a scan of now the robot would stop at its first move: it may come seldom.
            unheard = [stream for stream in self.feedback if stream.newest is None]
            if placed and not unheard and rested(odometry, odometry[0].arrived_s if odometry else math.inf):
                self.contact.clear()
                return
            if wait.over():
                self.check_feedback()
                raise missing(unheard) if unheard else self._restless(odometry, placed=placed)

    def channel(self, name: str) -> Channel:
        """Return the channel of an observation; raises BenchbotError when the robot has none."""
        if name in self.channels:
            return self.channels[name]
        known = [*self.channels, "poses"]
        raise BenchbotError(
            f"The robot '{self.robot.name}' has no observation '{name}'."
            if name in OBSERVATIONS
            else f"There is no observation '{name}'.",
            f"It has: {', '.join(known)}.{did_you_mean(name, known)}",
            "Name one of these in the task, or connect it in the robot's declaration.",
        )

    def subscribe(self, wanted: list[Channel]) -> None:
        """Subscribe what these channels and the robot's safety need, and nothing else."""
        needed = [stream for channel in (*wanted, *self._watched) for stream in channel.streams.values()]
        for channel in self.channels.values():
            for stream in channel.streams.values():
                if stream in needed:
                    stream.open()
                else:
                    stream.close()

    def wait(self, seconds: float) -> Wait:
        """Return a wait of the run's seconds."""
        return Wait(self.clock, self.changed, self.robot.settings.timing, seconds)

    def mount(self, frame: str) -> Pose:
        """Return a frame's pose in the base frame: from the transform tree if it has the frame, else as declared."""
        if frame == self.robot.base_frame:
            return Pose()
        if self.tree is not None:
            with suppress(LookupError):
                found: Pose = self.tree.lookup(self.robot.base_frame, frame, None)
                return found
        if frame in self.robot.mounts:
            return self.robot.mounts[frame]
        known = [self.robot.base_frame, *self.robot.mounts]
        raise failed(
            f"Where the frame '{frame}' is on the robot '{self.robot.name}' is not known.",
            f"Neither the transform tree nor the declaration has it. Declared: {', '.join(known)}."
            f"{did_you_mean(frame, known)}",
            "Add its place to 'frames' in the robot's declaration, or let the robot publish it on /tf_static.",
        )

    @property
    def streams(self) -> list[Stream]:
        """All that is, or was, subscribed."""
        channels = [stream for channel in self.channels.values() for stream in channel.streams.values()]
        return [stream for stream in (self.odometry, self.place, self._collision, *channels) if stream is not None]

    def check_feedback(self) -> None:
        """Raise BenchbotError when odometry or localisation are in other frames than declared, or of another time."""
        for stream in (self.odometry, self.place):
            sample = stream.newest if stream is not None else None
            if stream is None or sample is None:
                continue
            check_skew(stream, sample, self.robot.settings.timing)
            child = getattr(sample.message, "child_frame_id", self.robot.base_frame)
            if child.lstrip("/") != self.robot.base_frame:
                raise wrong_frame(stream.topic.ros_topic, f"child_frame_id '{child}'", self.robot.base_frame)
            if stream is self.place:
                check_frame(stream.topic.ros_topic, sample.message, self.robot.global_frame)

    def close(self) -> None:
        """Stop the robot, end its guard and leave the graph. Safe to call twice."""
        self._resources.close()

    @property
    def _is_told(self) -> bool:
        return self.robot.settings.initial_pose is not None

    def _stream(self, topic: Topic) -> Stream:
        return Stream(self.node, topic, self.clock, self.changed)

    def _observed(self, topic: Topic) -> Stream:
        # Pictures are large and come late: what is small is kept until the picture of its instant is there.
        timing, pictures = self.robot.settings.timing, topic.ros_type in PICTURES
        delay_s = 0.0 if pictures else longest_delay_s(timing, simulated=self.clock.simulated)
        return Stream(self.node, topic, self.clock, self.changed, history_ns=HISTORY_NS + round(delay_s * 1e9))

    def _transforms(self) -> Any:
        from benchbot_robot_ros2 import transforms

        tree = transforms.listen(self.node, self.clock.now_s, self.robot.graph.transforms)
        if tree is None and isinstance(self.robot.settings.localisation, LocalisedByTransforms):
            raise failed(
                f"Where the robot '{self.robot.name}' is cannot be known.",
                "Its declaration says driver.localisation.by: tf, and the messages of tf2_msgs are not installed.",
                "Start this Python with a ROS 2 installation sourced that has tf2_msgs (apt install "
                "ros-jazzy-tf2-msgs), or declare driver.localisation by topic or odometry.",
            )
        return tree

    def _place(self) -> Stream | None:
        place = self.robot.settings.localisation
        if not isinstance(place, LocalisedByTopic):
            return None
        return self._stream(Topic(ros_topic=place.ros_topic, ros_type=place.ros_type, qos=place.qos))

    def _collisions(self) -> Stream | None:
        topic = self.robot.settings.safety.collision
        if topic is None:
            return None

        def touch(message: Any) -> None:
            if signals.says(topic, message):
                self.contact.set()

        return Stream(self.node, topic, self.clock, self.changed, touch)

    def _forget(self) -> tuple[Wait, int]:
        streams = [stream for channel in self.channels.values() for stream in channel.streams.values()]
        for stream in (*streams, self.odometry, self.place):
            if stream is not None:
                stream.forget()
        self.clock.forgive()
        return self.wait(self.robot.settings.timing.wait_s), self.clock.now_ns()

    def _restless(self, odometry: list[Sample], *, placed: bool) -> BenchbotError:
        if not odometry:
            return missing([self.odometry])
        if not placed and self.place is not None:
            return missing([self.place])
        return failed(
            f"The robot '{self.robot.name}' does not stand still.",
            f"Its odometry measured {abs(speed_mps(odometry[-1].message)):.3f} m/s and "
            f"{measured_velocity(odometry[-1].message).angular_radps:.3f} rad/s last.",
            "See what else moves it: benchbot doctor --robot NAME names every node that commands velocities.",
        )

    def _await_first_messages(self) -> None:
        streams = [
            self.odometry,
            *(stream for channel in self.channels.values() for stream in channel.streams.values()),
        ]
        # Localisation that is told where the robot starts says nothing before.
        streams += [stream for stream in (self.place,) if stream is not None and not self._is_told]
        streams += [stream for stream in (self.battery,) if stream is not None]

        def silent() -> list[Stream]:
            quiet = [stream for stream in streams if stream.newest is None]
            if self._collision is not None and self._collision.newest is None and not self._collision.heard():
                quiet.append(self._collision)
            return quiet

        clock_wait = self.wait(self.robot.settings.timing.wait_s)
        while self.robot.settings.use_sim_time and self.clock.now_ns() == 0:
            if clock_wait.over():
                raise missing(silent()) if silent() else _clockless(self.robot)
        for stream in streams:
            # What came before the clock seems to be of another time.
            if stream.newest is not None and stream.newest.arrived_ns == 0:
                stream.forget()
        wait = self.wait(self.robot.settings.timing.wait_s)
        while silent():
            if wait.over():
                raise missing(silent())


def _clockless(robot: Ros2Robot) -> BenchbotError:
    return failed(
        f"The clock of the robot '{robot.name}' does not run.",
        f"Its declaration says driver.use_sim_time: true, and nothing comes on {robot.graph.clock}.",
        "Start the simulator that publishes it, or declare driver.use_sim_time: false for a real robot.",
    )
