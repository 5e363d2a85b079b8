"""The messages between the bridge and its camera process: typed structs over a pair of packet sockets."""

import socket
from pathlib import Path
from typing import Any

import msgspec

from benchbot.plugin import BenchbotError, Pose, Scene
from benchbot_robot_ros2.bridge.robot import BridgedRobot

MAX_MESSAGE_BYTES = 2**18


class Start(msgspec.Struct, tag="start", frozen=True):
    """The first message: the robot whose camera it is, and the largest number of pictures per second."""

    robot: BridgedRobot
    rate_hz: float


class Load(msgspec.Struct, tag="load", frozen=True):
    """Go to a scene; answered by `Ready` or `Failed`."""

    environment: dict[str, Any]
    folder: str
    seed: int

    @classmethod
    def of(cls, scene: Scene, seed: int) -> "Load":
        """Return the message that carries a scene, without what only a robot that drives needs."""
        environment = {key: value for key, value in scene.environment.items() if key != "trajectory_poses"}
        return cls(environment, str(scene.folder.absolute()), seed)

    def scene(self) -> Scene:
        """Return the scene that the message carries."""
        return Scene(self.environment, Path(self.folder))


class Look(msgspec.Struct, tag="look", frozen=True):
    """The pose of the base at a time; it is not answered, and is skipped when a newer one has arrived."""

    stamp_ns: int
    base: Pose


class Ready(msgspec.Struct, tag="ready", frozen=True):
    """The scene is loaded, and pictures of it are taken without delay."""


class Failed(msgspec.Struct, tag="failed", frozen=True):
    """The scene cannot be loaded: a BenchbotError in transit."""

    title: str
    why: str
    fix: str

    @classmethod
    def of(cls, error: BenchbotError) -> "Failed":
        """Return the message that carries an error."""
        return cls(error.title, error.why, error.fix)

    def error(self) -> BenchbotError:
        """Return the error that the message carries."""
        return BenchbotError(self.title, self.why, self.fix)


Message = Start | Load | Look | Ready | Failed

_decoder: msgspec.msgpack.Decoder[Message] = msgspec.msgpack.Decoder(Message)


def pair() -> tuple[socket.socket, socket.socket]:
    """Return two connected sockets that keep messages apart."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


def send(connection: socket.socket, message: Message, *, wait: bool = True) -> None:
    """Send a message; without `wait`, raises BlockingIOError when the other end has not read what it was sent."""
    connection.send(msgspec.msgpack.encode(message), 0 if wait else socket.MSG_DONTWAIT)


def receive(connection: socket.socket) -> Message | None:
    """Return the next message; None when the other end is gone."""
    try:
        data = connection.recv(MAX_MESSAGE_BYTES)
    except ConnectionError:
        return None
    return _decoder.decode(data) if data else None


def receive_newest(connection: socket.socket) -> Message | None:
    """Return the next message, but of several `Look`s in a row only the last."""
    message = receive(connection)
    while isinstance(message, Look) and _another(connection):
        message = receive(connection)
    return message


def _another(connection: socket.socket) -> bool:
    try:
        return bool(connection.recv(1, socket.MSG_DONTWAIT | socket.MSG_PEEK))
    except BlockingIOError:
        return False
