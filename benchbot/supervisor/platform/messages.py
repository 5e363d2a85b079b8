"""The messages between the supervisor and the platform's process: typed, over a socket pair.

A message is its length (4 bytes, little-endian) and MessagePack. Arrays travel in the arena; the message then holds
extension type 2, as on the wire: MessagePack `[dtype.str, [size, …], offset]`.
"""

import socket
import struct
import time
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import msgspec

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.geometry import Pose
from benchbot.core.platform import Localisation
from benchbot.wire.arena import ArenaWriter, Layout
from benchbot.wire.encoding import PLACE_CODE, Fetch, decode_place, is_array, is_scalar, place_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAX_MESSAGE_BYTES = 64 * 2**20

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class SceneMessage(msgspec.Struct, frozen=True):
    """An environment's declaration and the folder that it was read from."""

    environment: dict[str, Any]
    folder: str


class Start(msgspec.Struct, tag="start", frozen=True):
    """The first request: create the platform. Everything that the child needs to know of the selection.

    The reply has the findings of the diagnosis of a real robot; none of a simulated one.
    """

    robot: dict[str, Any]
    scenes: list[SceneMessage]
    localisation: Localisation
    cache_dir: str
    options: dict[str, Any]
    can_ask: bool
    despite: tuple[str, ...] = ()


class Load(msgspec.Struct, tag="load", frozen=True):
    """`Host.load`; the seed in digits, since it may have more bits than a number of MessagePack."""

    scene_index: int
    seed: str


class Act(msgspec.Struct, tag="act", frozen=True):
    """`Host.act`."""

    action: str
    arguments: dict[str, Any]
    goal: Pose | None


class Observe(msgspec.Struct, tag="observe", frozen=True):
    """`Host.observe`."""

    channels: list[str]


class Scenes(msgspec.Struct, tag="scenes", frozen=True):
    """`InProcessHost.change_scenes`: the next run is in other scenes, or starts elsewhere in them."""

    scenes: list[SceneMessage]


class Close(msgspec.Struct, tag="close", frozen=True):
    """`Host.close`, and the end of the process."""


Request = Start | Load | Act | Observe | Scenes | Close


class Halt(msgspec.Struct, tag="halt", frozen=True):
    """`Host.halt`: needs no reply, and does not wait for the request under way."""

    why: str


class Answered(msgspec.Struct, tag="answered", frozen=True):
    """The operator has done what the last `Question` asks."""


class Alive(msgspec.Struct, tag="alive", frozen=True):
    """A sign of life of the supervisor, while a request is under way that may move a real robot."""


ControlMessage = Halt | Answered | Alive
"""A message to the child in the middle of a request."""


class Done(msgspec.Struct, tag="done", frozen=True):
    """The reply to a request that succeeded."""

    value: msgspec.Raw


class Failed(msgspec.Struct, tag="failed", frozen=True):
    """The reply to a request that raised: a BenchbotError in transit."""

    title: str
    why: str
    fix: str
    exit_code: int
    failure: FailureClass | None
    ends_run: bool = False

    @classmethod
    def of(cls, error: BenchbotError) -> "Failed":
        """Return the message that carries an error."""
        return cls(error.title, error.why, error.fix, int(error.exit_code), error.failure, error.ends_run)

    def error(self) -> BenchbotError:
        """Return the error that the message carries."""
        return BenchbotError(
            self.title,
            self.why,
            self.fix,
            exit_code=ExitCode(self.exit_code),
            failure=self.failure,
            ends_run=self.ends_run,
        )


class Question(msgspec.Struct, tag="question", frozen=True):
    """A request to the operator; the reply to the request under way comes some time after their answer.

    Where none is wanted, the text says what the platform waits for.
    """

    text: str
    wants_answer: bool = True


class Preparing(msgspec.Struct, tag="preparing", frozen=True):
    """What the platform does meanwhile, where the reply to the request under way takes long."""

    text: str


class Resumed(msgspec.Struct, tag="resumed", frozen=True):
    """The request under way goes on: the answer to the question has arrived, or what was waited for."""


Reply = Done | Failed

_Incoming = Request | ControlMessage
_Outgoing = Reply | Question | Preparing | Resumed

decode_request = msgspec.msgpack.Decoder[_Incoming](_Incoming).decode
"""Returns the request or control message in the bytes; raises msgspec.DecodeError for anything else."""
decode_message = msgspec.msgpack.Decoder[_Outgoing](_Outgoing).decode
"""Returns the reply in the bytes, or what may come before it; raises msgspec.DecodeError for anything else."""


def encode(message: Request | ControlMessage | Failed | Question | Preparing | Resumed) -> bytes:
    """Return the bytes of a message that is no value."""
    return msgspec.msgpack.encode(message, enc_hook=_scalar)


def encode_value(reply: Any, arena: ArenaWriter | None = None) -> bytes:
    """Return the bytes of a reply with a value, whose arrays go to the arena; without one, it has none."""
    layout = Layout()

    def place(value: Any) -> Any:
        if arena and is_array(value):
            return place_of(value.dtype.str, value.shape, layout.add(value))
        return _scalar(value)

    value = msgspec.Raw(msgspec.msgpack.encode(reply, enc_hook=place))
    if arena:
        arena.write(layout)
    return msgspec.msgpack.encode(Done(value))


def decode_reply(data: bytes | bytearray, kind: type[T]) -> T:
    """Return the value of the reply in the bytes, which has no arrays, or raise the BenchbotError in it."""
    return value_of(msgspec.msgpack.decode(data, type=Reply), decoder(kind))


def decoder(kind: type[T], fetch: Fetch | None = None) -> "msgspec.msgpack.Decoder[T]":
    """Return what decodes the values of replies as `kind`; their arrays are fetched from the arena."""

    def array(code: int, where: memoryview) -> "NDArray[Any]":
        if fetch is None or code != PLACE_CODE:
            raise ValueError(f"extension type {code} is not known")
        return fetch(*decode_place(where))

    return msgspec.msgpack.Decoder(kind, ext_hook=array)


class Decoder(Protocol[T_co]):
    """Decodes values of one type."""

    def decode(self, message: msgspec.Raw, /) -> T_co:
        """Return the value; raises ValueError or msgspec.MsgspecError when it is none."""


def value_of(reply: Reply, decoder: Decoder[T]) -> T:
    """Return the value of a reply, or raise the BenchbotError in it."""
    if isinstance(reply, Failed):
        raise reply.error()
    return decoder.decode(reply.value)


def _scalar(value: Any) -> Any:
    if is_scalar(value):
        return value.item()
    raise TypeError(f"values of type {type(value).__name__} cannot leave the platform's process")


def send(connection: socket.socket, data: bytes) -> None:
    """Send one message; raises OSError when the other end is gone."""
    connection.sendall(framed(data))


def framed(data: bytes) -> bytes:
    """Return a message as it is sent, behind its length."""
    return struct.pack("<I", len(data)) + data


def receive(connection: socket.socket, timeout_s: float | None = None) -> bytearray:
    """Return the next message.

    Raises EOFError when the other end is gone, TimeoutError when no whole message came in time.
    """
    deadline_s = None if timeout_s is None else time.monotonic() + timeout_s
    (size,) = struct.unpack("<I", _receive_exactly(connection, 4, deadline_s))
    if size > MAX_MESSAGE_BYTES:
        raise EOFError(f"a message of {size} bytes is larger than {MAX_MESSAGE_BYTES}")
    return _receive_exactly(connection, size, deadline_s)


def _receive_exactly(connection: socket.socket, size: int, deadline_s: float | None) -> bytearray:
    data = bytearray(size)
    view = memoryview(data)
    while view:
        connection.settimeout(None if deadline_s is None else max(deadline_s - time.monotonic(), 1e-3))
        try:
            count = connection.recv_into(view)
        except ConnectionError as error:
            raise EOFError(str(error)) from error
        if count == 0:
            raise EOFError("the other end is gone")
        view = view[count:]
    return data
