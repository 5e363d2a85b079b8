"""The encoding of the v1 API and of the platform's process: MessagePack, with arrays as an extension type.

An array is extension type 1. Its data: one byte, the length n of the header; n bytes, the header, itself MessagePack:
`[dtype.str, [size, …]]` (`"<f4"`, `[480, 640]`); then the elements, C order, little-endian, without padding.
MessagePack: https://github.com/msgpack/msgpack/blob/master/spec.md
"""

import math
import struct
from collections.abc import Iterable
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from benchbot.core.errors import BenchbotError

MAX_BODY_BYTES = 64 * 2**20
ARRAY_CODE = 1
MAX_NDIM = 8
MAX_ARRAY_BYTES = 256 * 2**20
DTYPES = frozenset({"|b1", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f2", "<f4", "<f8"})

_header_decoder = msgspec.msgpack.Decoder(tuple[str, list[int]])


def encode(value: Any) -> bytes:
    """Return a value as MessagePack; raises BenchbotError for one that the wire cannot carry.

    It carries None, bool, int (64 bits), float, str, bytes, list, tuple, dict with string keys, and numpy's arrays and
    scalars of bool, int, uint and float.
    """
    parts: list[bytes | memoryview] = []
    try:
        _append(parts, value)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise BenchbotError(
            "A value cannot be sent.",
            str(error),
            "Use dicts, lists, strings, numbers, booleans, None and numpy arrays of bool, int, uint or float.",
        ) from error
    return b"".join(parts)


def decode(data: bytes | bytearray | memoryview) -> Any:
    """Return the value in a MessagePack message; arrays in a bytearray are views into it where alignment permits.

    Raises BenchbotError for everything that is not a whole message within the caps of this module.
    """
    try:
        return _decoder.decode(data)
    except (msgspec.DecodeError, TypeError, ValueError, RecursionError) as error:
        raise BenchbotError(
            "A message cannot be read.",
            f"It is not MessagePack as BenchBot speaks it: {error}",
            "See docs/wire.md for the encoding.",
        ) from error


def _append(parts: list[bytes | memoryview], value: Any) -> None:
    """Append the encoding of a value. Arrays stay where they are: joining the parts is the only copy of an image."""
    if isinstance(value, np.ndarray):
        _append_array(parts, value)
    elif isinstance(value, dict) and _holds_array(value.values()):
        parts.append(_map_header(len(value)))
        for key, item in value.items():
            parts.append(_encoder.encode(key))
            _append(parts, item)
    elif isinstance(value, list | tuple) and _holds_array(value):
        parts.append(_array_header(len(value)))
        for item in value:
            _append(parts, item)
    else:
        parts.append(_encoder.encode(value))


def _holds_array(values: Iterable[Any]) -> bool:
    for value in values:
        if isinstance(value, np.ndarray):
            return True
        if isinstance(value, dict) and _holds_array(value.values()):
            return True
        if isinstance(value, list | tuple) and _holds_array(value):
            return True
    return False


def _append_array(parts: list[bytes | memoryview], array: NDArray[Any]) -> None:
    """Append an array as extension data; raises ValueError for a dtype, rank or size outside of the caps."""
    dtype = array.dtype.newbyteorder("<") if array.dtype.kind in "iuf" else array.dtype
    size = _check(dtype.str, list(array.shape))
    header = _encoder.encode((dtype.str, array.shape))
    parts.append(struct.pack(">BIbB", 0xC9, 1 + len(header) + size, ARRAY_CODE, len(header)) + header)
    if size:
        parts.append(np.ascontiguousarray(array, dtype).reshape(-1).view(np.uint8).data)


def _map_header(count: int) -> bytes:
    return struct.pack(">BI", 0xDF, count)


def _array_header(count: int) -> bytes:
    return struct.pack(">BI", 0xDD, count)


def _encode_scalar(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"values of type {type(value).__name__} are not supported")


def unpack_array(data: memoryview) -> NDArray[Any]:
    """Return the array in extension data; raises ValueError when it is not one within the caps."""
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


def _check(dtype: str, shape: list[int]) -> int:
    """Return the size in bytes of an array within the caps; raises ValueError for others."""
    if dtype not in DTYPES:
        raise ValueError(f"arrays of {dtype} are not supported")
    if len(shape) > MAX_NDIM or any(size < 0 for size in shape):
        raise ValueError(f"an array cannot have the shape {shape}")
    # An empty array's other sizes count too: numpy refuses those whose product overflows.
    size = np.dtype(dtype).itemsize * math.prod(max(1, size) for size in shape)
    if size > MAX_ARRAY_BYTES:
        raise ValueError(f"an array of {size} bytes is larger than {MAX_ARRAY_BYTES}")
    return 0 if 0 in shape else size


def _decode_hook(code: int, data: memoryview) -> NDArray[Any]:
    if code != ARRAY_CODE:
        raise ValueError(f"extension type {code} is not known")
    return unpack_array(data)


_encoder = msgspec.msgpack.Encoder(enc_hook=_encode_scalar)
_decoder: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(ext_hook=_decode_hook)
