"""The messages between the driver and its guard: one MessagePack message per packet of a socket pair."""

import socket
from contextlib import suppress

import msgspec

from benchbot.plugin import MotionConfig
from benchbot_robot_ros2.declaration_keys import Call, Safety, Topic
from benchbot_robot_ros2.guard.state import Trip
from benchbot_robot_ros2.ros import HERE, Graph

MAX_MESSAGE_BYTES = 65536


class Begin(msgspec.Struct, tag="begin", frozen=True):
    """The first message to a guard: the robot to guard.

    `navigation` is the action by which something else may drive it; its goals are called off when the robot is stopped.
    `after` are the services that it calls when all is over, also when the driver was killed. `stopped` when it is to be
    kept at rest from the beginning; `stands_by_for` is the process of the other guard, of the one that publishes
    nothing for as long as that one does well.
    """

    robot: str
    base_frame: str
    command: Topic
    safety: Safety
    wait_s: float
    use_sim_time: bool
    motion: MotionConfig
    navigation: str | None = None
    graph: Graph = HERE
    after: tuple[Call, ...] = ()
    stopped: Trip | None = None
    stands_by_for: int | None = None


class Command(msgspec.Struct, tag="command", frozen=True):
    """The velocity that the robot shall have now."""

    linear_mps: float
    angular_radps: float
    lateral_mps: float = 0.0

    @property
    def moves(self) -> bool:
        """Whether it is not zero."""
        return bool(self.linear_mps or self.angular_radps or self.lateral_mps)


class Attend(msgspec.Struct, tag="attend", frozen=True):
    """The robot is driven by its navigation now: nothing is published, and all is watched."""


class Stop(msgspec.Struct, tag="stop", frozen=True):
    """Stop the robot, for good."""

    trip: Trip


class Resume(msgspec.Struct, tag="resume", frozen=True):
    """Heed commands again after a person had taken the robot over."""


ToGuard = Begin | Command | Attend | Stop | Resume


class Beat(msgspec.Struct, tag="beat", frozen=True):
    """A sign of life from one guard to the other: its process, and whether it publishes a motion now."""

    pid: int
    moving: bool


class Armed(msgspec.Struct, tag="armed", frozen=True):
    """The base has subscribed to the guard's topic: commands may be sent."""


class Refused(msgspec.Struct, tag="refused", frozen=True):
    """The robot cannot be guarded, so it shall not move: an error's words."""

    title: str
    why: str
    fix: str


class Tripped(msgspec.Struct, tag="tripped", frozen=True):
    """The robot was stopped, for good."""

    trip: Trip


class Hand(msgspec.Struct, tag="hand", frozen=True):
    """A person holds the take-over switch or not; the robot is theirs (`yielded`) until the driver resumes."""

    held: bool
    yielded: bool


FromGuard = Armed | Refused | Tripped | Hand

_to_guard: msgspec.msgpack.Decoder[ToGuard] = msgspec.msgpack.Decoder(ToGuard)
_beats: msgspec.msgpack.Decoder[Beat] = msgspec.msgpack.Decoder(Beat)
_from_guard: msgspec.msgpack.Decoder[FromGuard] = msgspec.msgpack.Decoder(FromGuard)


def pair() -> tuple[socket.socket, socket.socket]:
    """Return two connected sockets that keep messages apart and tell each side of the other's end."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def send(connection: socket.socket, message: ToGuard | FromGuard | Beat) -> None:
    """Send without ever blocking; raises OSError when the other side is gone, or does not read for a long time."""
    connection.send(msgspec.msgpack.encode(message), socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)


def tell(connection: socket.socket, message: FromGuard | Beat) -> None:
    """Send what nobody needs to know any more if the other side is gone, or does not read."""
    with suppress(OSError):
        send(connection, message)


def receive_at_guard(connection: socket.socket) -> ToGuard | None:
    """Return the next message to the guard, None at the end; blocks as the socket does."""
    data = _received(connection)
    return _to_guard.decode(data) if data else None


def receive_from_guard(connection: socket.socket) -> FromGuard | None:
    """Return the guard's next message, None at the end; blocks as the socket does."""
    data = _received(connection)
    return _from_guard.decode(data) if data else None


def receive_beat(connection: socket.socket) -> Beat | None:
    """Return the next sign of life, None at the guard's end; blocks as the socket does."""
    data = _received(connection)
    return _beats.decode(data) if data else None


def _received(connection: socket.socket) -> bytes:
    try:
        return connection.recv(MAX_MESSAGE_BYTES)
    except ConnectionError:
        return b""
