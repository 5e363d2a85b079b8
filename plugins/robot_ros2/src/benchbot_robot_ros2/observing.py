"""Observing: the messages of one instant, taken after a moment, checked and turned into observations."""

import threading
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from benchbot.plugin import BenchbotError
from benchbot_robot_ros2 import callbacks
from benchbot_robot_ros2.arm import Arm
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import Connection, Timing
from benchbot_robot_ros2.failures import failed
from benchbot_robot_ros2.instant import Stamped, joined, one_instant
from benchbot_robot_ros2.robot_clock import RobotClock
from benchbot_robot_ros2.streams import Sample, Stream

# How long the clock of a simulated robot may stand still, as a multiple of `feedback_timeout_s`: it waits for its
# simulator, which may be slow.
STILL_FACTOR = 4.0
POLL_S = 0.1


@dataclass(frozen=True)
class Channel:
    """An observation of a robot: the streams of its parts, the frame of their messages, and the arm of its joints."""

    name: str
    callback: callbacks.Callback
    streams: Mapping[str, Stream]
    frame: str | None
    arm: Arm | None = None

    def decode(self, messages: Mapping[str, Any]) -> Any:
        """Return the observation; raises BenchbotError when a message is malformed or in another frame."""
        for part, message in messages.items():
            check_frame(self.streams[part].topic.ros_topic, message, self.frame)
        try:
            decoded = self.callback.decode(messages)
            return decoded if self.arm is None else self.arm.select(decoded)
        except ValueError as error:
            topics = ", ".join(stream.topic.ros_topic for stream in self.streams.values())
            raise failed(
                f"The robot's {self.name} cannot be read.",
                f"The message on {topics} is malformed: {error}.",
                f"Mend what publishes {topics}, or choose another callback_robot for connections.{self.name}.",
            ) from error


def callback_of(robot: str, name: str, connection: Connection) -> callbacks.Callback:
    """Return the callback of a connection; raises BenchbotError when it does not take the connection's topics."""
    callback = callbacks.find(connection.callback_robot or name)
    parts = connection.parts()
    for part in sorted({*parts, *callback.types}):
        accepted = callback.types.get(part)
        topic = parts.get(part)
        if accepted is None or topic is None or topic.ros_type not in accepted:
            where = f"connections.{name}" + (f".topics.{part}" if part else "")
            raise BenchbotError(
                f"The robot '{robot}' cannot be observed: its declaration is wrong at '{where}'.",
                f"The callback '{callback.name}' has no such part."
                if accepted is None
                else f"The callback '{callback.name}' needs a topic there of the type {' or '.join(sorted(accepted))}"
                f"{f', not {topic.ros_type}' if topic else ''}.",
                "Correct it, or choose another callback_robot.",
            )
    return callback


def frame_of(channel: str, robot: Ros2Robot) -> str | None:
    """Return the frame that a channel's messages must be in; None where any will do."""
    if channel.startswith("image_"):
        return robot.camera_frame
    return {"laser": robot.laser_frame, "lidar": robot.lidar_frame, "imu": robot.imu_frame}.get(channel)


def check_frame(topic: str, message: Any, frame: str | None) -> None:
    """Raise BenchbotError when a message with a header is in another frame than the declared one."""
    header = getattr(message, "header", None)
    if frame is None or header is None or header.frame_id.lstrip("/") == frame:
        return
    raise wrong_frame(topic, f"frame_id '{header.frame_id}'", frame)


def wrong_frame(topic: str, found: str, frame: str) -> BenchbotError:
    """Return the error of a message in another frame than the declared one."""
    return failed(
        "The robot's messages are in another frame than declared.",
        f"The messages on {topic} have the {found}; the robot's declaration has '{frame}' there.",
        f"Correct the frame in the declaration (with its place under 'frames'), or in what publishes {topic}.",
    )


def longest_delay_s(timing: Timing, *, simulated: bool) -> float:
    """Return how long after its stamp an observation may come.

    A simulated robot has one clock, which does not wait for a slow camera: as long as we would wait for a picture.
    """
    return timing.wait_s if simulated else timing.skew_s


def check_skew(stream: Stream, sample: Sample, timing: Timing, delay_s: float | None = None) -> None:
    """Raise BenchbotError when a stamp is so far from the clock that the clocks must differ.

    It may be `delay_s` behind, `timing.skew_s` by default, and `timing.skew_s` ahead.
    """
    delay_s = timing.skew_s if delay_s is None else delay_s
    if stream.holds or -timing.skew_s <= sample.skew_s <= delay_s:
        return
    topic = stream.topic.ros_topic
    if sample.stamp_ns == 0:
        raise failed(
            "The robot's messages carry no time.",
            f"The stamp of the messages on {topic} is zero.",
            f"Let what publishes {topic} fill in header.stamp.",
        )
    raise failed(
        f"The robot's clock and that of this computer differ by {abs(sample.skew_s):.1f} s.",
        f"That is how far the stamps of the messages on {topic} are {'behind' if sample.skew_s > 0 else 'ahead'}; "
        f"driver.timing.skew_s allows {timing.skew_s:g} s.",
        "Synchronise both computers' clocks (for example with chrony), or, if the robot's time is simulated, "
        "declare driver.use_sim_time: true.",
    )


class Wait:
    """A wait of the run's seconds, that also ends when the clock of a simulated robot stands still."""

    def __init__(self, clock: RobotClock, changed: threading.Condition, timing: Timing, seconds: float) -> None:
        self._clock = clock
        self._changed = changed
        self._still_s = max(STILL_FACTOR * timing.feedback_timeout_s, seconds)
        self._deadline_s = clock.now_s() + seconds

    def over(self) -> bool:
        """Wait for something to change; say whether the time is over."""
        if self._clock.now_s() >= self._deadline_s or self._clock.still_s >= self._still_s:
            return True
        with self._changed:
            self._changed.wait(POLL_S)
        return False


class Moment(NamedTuple):
    """A moment by the stamps of the robot, whose clock may differ from ours a little, and by the run's seconds."""

    stamp_ns: int
    arrived_s: float


def gather(channels: Iterable[Channel], since: Moment, timing: Timing, wait: Wait) -> dict[str, dict[str, Sample]]:
    """Wait for the samples of one instant, by channel and part, that were taken and came after `since`.

    What holds until the next message is there as it is. Raises BenchbotError saying what is missing, and why.
    """
    wanted = list(channels)
    while True:
        series = {channel.name: _since(channel, since, timing) for channel in wanted}
        stamped = {channel.name: series[channel.name] for channel in wanted if _stamped(channel)}
        held = {channel.name: _held(channel) for channel in wanted}
        chosen = one_instant(stamped, round(timing.sync_tolerance_s * 1e9))
        if chosen is not None and all(samples is not None for samples in held.values()):
            return {
                channel.name: {**(held[channel.name] or {}), **(chosen[channel.name][1] if _stamped(channel) else {})}
                for channel in wanted
            }
        if wait.over():
            raise _incomplete(wanted, since, timing)


def taken_ns(channels: Iterable[Channel], samples: Mapping[str, Mapping[str, Sample]]) -> int | None:
    """Return when an observation was taken, by its pictures if it has any; None where all of it holds for long."""
    stamps = {
        channel.name: sample.stamp_ns
        for channel in channels
        for part, sample in samples[channel.name].items()
        if not channel.streams[part].holds
    }
    return next((stamps[name] for name in sorted(stamps, key=lambda name: not name.startswith("image_"))), None)


def catch_up(odometry: Stream, stamp_ns: int | None, wait: Wait) -> None:
    """Wait until odometry tells of a time, if one is given: it comes later than pictures where its delay is longer."""
    while stamp_ns is not None and (odometry.newest is None or odometry.newest.stamp_ns < stamp_ns):
        if wait.over():
            return


def _stamped(channel: Channel) -> dict[str, Stream]:
    return {part: stream for part, stream in channel.streams.items() if not stream.holds}


def _held(channel: Channel) -> dict[str, Sample] | None:
    held = {part: stream.newest for part, stream in channel.streams.items() if stream.holds}
    return None if None in held.values() else {part: sample for part, sample in held.items() if sample is not None}


def _since(channel: Channel, since: Moment, timing: Timing) -> list[Stamped]:
    return joined({part: _newer(stream, since, timing) for part, stream in _stamped(channel).items()})


def _newer(stream: Stream, since: Moment, timing: Timing) -> list[Sample]:
    samples = [s for s in stream.samples if s.stamp_ns >= since.stamp_ns and s.arrived_s >= since.arrived_s]
    for sample in samples[-1:]:
        check_skew(stream, sample, timing, longest_delay_s(timing, simulated=stream.simulated))
    return samples


def _incomplete(channels: list[Channel], since: Moment, timing: Timing) -> BenchbotError:
    silent = [
        stream
        for channel in channels
        for stream in channel.streams.values()
        if (stream.newest is None if stream.holds else not _newer(stream, since, timing))
    ]
    if silent:
        return missing(silent)
    newest = {
        stream.topic.ros_topic: sample.stamp_ns / 1e9
        for channel in channels
        for stream in _stamped(channel).values()
        if (sample := stream.newest) is not None
    }
    first = min(newest.values())
    return failed(
        "The robot's sensors do not fit together in time.",
        f"No messages were taken within {timing.sync_tolerance_s:g} s of each other (driver.timing.sync_tolerance_s), "
        "parts of one observation at the same time. Newest stamps, from the earliest: "
        + ", ".join(f"{topic} +{stamp_s - first:.3f} s" for topic, stamp_s in sorted(newest.items()))
        + ".",
        "Publish them at rates that fit and with the time of the exposure, or declare a larger sync_tolerance_s.",
    )


def missing(silent: Iterable[Stream]) -> BenchbotError:
    """Return the error of topics on which nothing comes, with each one's reason."""
    reasons = {stream.topic.ros_topic: f"{stream.topic.ros_topic}: {stream.silence()}." for stream in silent}
    return failed(
        f"The robot does not tell everything: nothing came on {', '.join(reasons)}.",
        "\n".join(reasons.values()),
        "Start what publishes them on the robot, or correct the robot's declaration. Both computers need the same "
        "ROS_DOMAIN_ID and network; benchbot doctor --robot NAME shows the whole picture.",
    )
