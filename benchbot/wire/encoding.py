"""The encoding of the v1 API and of the platform's process: MessagePack, with arrays as an extension type.

An array is extension type 1. Its data: one byte, the length n of the header; n bytes, the header, itself MessagePack:
`[dtype.str, [size, …]]` (`"<f4"`, `[480, 640]`); then the elements, C order, little-endian, without padding.
Extension type 2 is an array that lies in shared memory: MessagePack `[dtype.str, [size, …], offset]`.
MessagePack: https://github.com/msgpack/msgpack/blob/master/spec.md
"""

import math
import struct
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import msgspec

from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:  # where no array is sent or received, numpy is not imported: it takes as long as all of the client
    import numpy as np
    from numpy.typing import NDArray

ARENA_HEADER = "X-BenchBot-Arena"
MAX_BODY_BYTES = 64 * 2**20
ARRAY_CODE = 1
PLACE_CODE = 2
MAX_NDIM = 8
# A smaller array is copied sooner than it is aligned.
ALIGNED_FROM_BYTES = 4096
MAX_ARRAY_BYTES = 256 * 2**20
DTYPES = ("|b1", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f2", "<f4", "<f8")
"""The names of dtypes that arrays may have on the wire; the last digit is an element's size in bytes."""

Locate = Callable[["NDArray[Any]"], int | None]
"""Returns the offset of an array in shared memory, or None for one that does not lie there."""
Fetch = Callable[[str, list[int], int], "NDArray[Any]"]
"""Returns the array of a dtype and shape that lies at an offset in shared memory; raises ValueError for none."""

_header_decoder = msgspec.msgpack.Decoder(tuple[str, list[int]])
decode_place = msgspec.msgpack.Decoder(tuple[str, list[int], int]).decode
"""Returns dtype, shape and offset of an array in shared memory, from the data of its extension."""


def encode(value: Any, locate: Locate | None = None) -> bytes:
    """Return a value as MessagePack; raises BenchbotError for one that the wire cannot carry.

    With `locate`, of an array that lies in shared memory only its place is sent.

    It carries None, bool, int (64 bits), float, str, bytes, list, tuple, dict with string keys, and numpy's arrays and
    scalars of bool, int, uint and float.
    """
    try:
        if locate is not None:
            return _placed(value, locate)
        message = _Message()
        message.append(value)
        return b"".join(message.parts)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise BenchbotError(
            "A value cannot be sent.",
            str(error),
            "Use dicts, lists, strings, numbers, booleans, None and numpy arrays of bool, int, uint or float.",
        ) from error


def decode(data: bytes | bytearray | memoryview, fetch: Fetch | None = None) -> Any:
    """Return the value in a MessagePack message; arrays in a bytearray are views into it where alignment permits.

    `fetch` returns those that lie in shared memory.
    Raises BenchbotError for everything that is not a whole message within the caps of this module.
    """
    try:
        return (_decoder if fetch is None else _decoder_with(fetch)).decode(data)
    except (msgspec.DecodeError, TypeError, ValueError, RecursionError) as error:
        raise BenchbotError(
            "A message cannot be read.",
            f"It is not MessagePack as BenchBot speaks it: {error}",
            "See docs/wire.md for the encoding.",
        ) from error


def place_of(dtype: str, shape: Sequence[int], offset: int) -> msgspec.msgpack.Ext:
    """Return the extension that stands for an array in shared memory."""
    return msgspec.msgpack.Ext(PLACE_CODE, _encoder.encode((dtype, shape, offset)))


def _placed(value: Any, locate: Locate) -> bytes:
    """Return a message with the places of its arrays; those that have none go by their elements, aligned to nothing."""

    def place(item: Any) -> Any:
        if not is_array(item):
            return _encode_scalar(item)
        dtype, _ = _checked(item)
        offset = locate(item) if dtype == item.dtype else None
        if offset is None:
            header = _encoder.encode((dtype.str, item.shape))
            return msgspec.msgpack.Ext(ARRAY_CODE, bytes([len(header)]) + header + item.astype(dtype).tobytes())
        return place_of(dtype.str, item.shape, offset)

    return msgspec.msgpack.Encoder(enc_hook=place).encode(value)


class _Message:
    """A message being put together. Arrays stay where they are: joining the parts is the only copy of an image."""

    def __init__(self) -> None:
        self.parts: list[bytes | memoryview] = []
        self._size = 0

    def append(self, value: Any) -> None:
        """Append the encoding of a value."""
        if is_array(value):
            self._append_array(value)
        elif isinstance(value, dict) and _holds_array(value.values()):
            self._add(struct.pack(">BI", 0xDF, len(value)))
            for key, item in value.items():
                self._add(_encoder.encode(key))
                self.append(item)
        elif isinstance(value, list | tuple) and _holds_array(value):
            self._add(struct.pack(">BI", 0xDD, len(value)))
            for item in value:
                self.append(item)
        else:
            self._add(_encoder.encode(value))

    def _append_array(self, array: "NDArray[Any]") -> None:
        """Append an array; raises ValueError for a dtype, rank or size outside of the caps."""
        import numpy as np

        dtype, size = _checked(array)
        header = _encoder.encode((dtype.str, array.shape))
        if size >= ALIGNED_FROM_BYTES:
            header = _widened(header, -(self._size + 7 + len(header)) % dtype.itemsize, len(array.shape))
        self._add(struct.pack(">BIbB", 0xC9, 1 + len(header) + size, ARRAY_CODE, len(header)) + header)
        if size:
            self._add(np.ascontiguousarray(array, dtype).reshape(-1).view(np.uint8).data)

    def _add(self, part: bytes | memoryview) -> None:
        self.parts.append(part)
        self._size += len(part)


def _widened(header: bytes, padding: int, rank: int) -> bytes:
    """Return an array's header, 0 to 7 bytes longer: what MessagePack writes in one byte, it also reads in more.

    So the elements lie aligned in the message, and a reader need not copy them.
    """
    text_end = 2 + (header[1] & 0x1F)
    pair = b"\xdc\x00\x02" if padding & 2 else header[:1]
    text = (b"\xd9" + bytes([header[1] & 0x1F]) if padding & 1 else header[1:2]) + header[2:text_end]
    sizes = struct.pack(">BI", 0xDD, rank) if padding & 4 else header[text_end : text_end + 1]
    return pair + text + sizes + header[text_end + 1 :]


def is_array(value: Any) -> bool:
    """Return whether a value is an array; there is none where numpy is not imported, or not yet to its end."""
    return isinstance(value, getattr(sys.modules.get("numpy"), "ndarray", ()))


def is_scalar(value: Any) -> bool:
    """Return whether a value is a number of numpy's."""
    return isinstance(value, getattr(sys.modules.get("numpy"), "generic", ()))


def _holds_array(values: Iterable[Any]) -> bool:
    for value in values:
        if is_array(value):
            return True
        if isinstance(value, dict) and _holds_array(value.values()):
            return True
        if isinstance(value, list | tuple) and _holds_array(value):
            return True
    return False


def _encode_scalar(value: Any) -> Any:
    if is_scalar(value):
        return value.item()
    raise TypeError(f"values of type {type(value).__name__} are not supported")


def unpack_array(data: memoryview) -> "NDArray[Any]":
    """Return the array in extension data; raises ValueError when it is not one within the caps."""
    import numpy as np

    if len(data) < 1 or len(data) < 1 + data[0]:
        raise ValueError("an array ends within its header")
    start = 1 + data[0]
    dtype, shape = _header_decoder.decode(data[1:start])
    size = _check(dtype, shape)
    if len(data) - start != size:
        raise ValueError(f"an array of {dtype} {shape} has {len(data) - start} bytes instead of {size}")
    if size == 0:
        return np.empty(shape, dtype)
    array = np.frombuffer(data, dtype, offset=start).reshape(shape)
    return array if array.flags.aligned and array.flags.writeable else array.copy()


def _checked(array: "NDArray[Any]") -> tuple["np.dtype[Any]", int]:
    """Return the dtype that an array has on the wire, and its size; raises ValueError outside of the caps."""
    dtype = array.dtype
    if dtype.str.startswith(">"):
        dtype = dtype.newbyteorder("<")
    return dtype, _check(dtype.str, array.shape)


def _check(dtype: str, shape: Sequence[int]) -> int:
    """Return the size in bytes of an array within the caps; raises ValueError for others."""
    if dtype not in DTYPES:
        raise ValueError(f"arrays of {dtype} are not supported")
    if len(shape) > MAX_NDIM or min(shape, default=0) < 0:
        raise ValueError(f"an array cannot have the shape {shape}")
    # An empty array's other sizes count too: numpy refuses those whose product overflows.
    size = int(dtype[-1]) * (math.prod(shape) or math.prod(filter(None, shape)))
    if size > MAX_ARRAY_BYTES:
        raise ValueError(f"an array of {size} bytes is larger than {MAX_ARRAY_BYTES}")
    return 0 if 0 in shape else size


def has_place(dtype: str, shape: Sequence[int]) -> bool:
    """Return True when an array in shared memory is sent by its place: it is neither empty nor outside of the caps."""
    try:
        return _check(dtype, shape) > 0
    except ValueError:
        return False


def _decoder_with(fetch: Fetch | None) -> "msgspec.msgpack.Decoder[Any]":
    def hook(code: int, data: memoryview) -> "NDArray[Any]":
        if code == ARRAY_CODE:
            return unpack_array(data)
        if code != PLACE_CODE or fetch is None:
            raise ValueError(f"extension type {code} is not known")
        dtype, shape, offset = decode_place(data)
        _check(dtype, shape)
        return fetch(dtype, shape, offset)

    return msgspec.msgpack.Decoder(ext_hook=hook)


_encoder = msgspec.msgpack.Encoder(enc_hook=_encode_scalar)
_decoder = _decoder_with(None)
