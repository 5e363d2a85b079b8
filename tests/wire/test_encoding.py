import struct
import sys
from contextlib import suppress
from types import ModuleType
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of
from numpy.typing import NDArray

from benchbot.core.errors import BenchbotError
from benchbot.wire import encoding

numbers = arrays_of.boolean_dtypes() | arrays_of.integer_dtypes() | arrays_of.unsigned_integer_dtypes()
dtypes = numbers | arrays_of.floating_dtypes(sizes=(16, 32, 64))
arrays = arrays_of.arrays(dtypes, arrays_of.array_shapes(min_dims=0, max_dims=8, min_side=0, max_side=3))
plain = st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats(allow_nan=False) | st.text()
values = st.recursive(
    plain | st.binary(), lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=20
)


@settings(deadline=None)
@given(values)
def test_plain_values_arrive_as_they_were(value: Any) -> None:
    assert encoding.decode(encoding.encode(value)) == value


@settings(deadline=None)
@given(arrays)
def test_arrays_arrive_as_they_were(array: NDArray[np.generic]) -> None:
    arrived = encoding.decode(bytearray(encoding.encode({"a": array, "b": [array]})))
    for copy in (arrived["a"], arrived["b"][0]):
        assert copy.dtype == array.dtype.newbyteorder("<")
        assert copy.shape == array.shape
        assert copy.tobytes() == array.astype(copy.dtype).tobytes()
        assert copy.flags.writeable
        assert copy.flags.aligned


@settings(deadline=None)
@given(st.binary(max_size=200))
def test_random_bytes_are_understood_or_refused(data: bytes) -> None:
    with suppress(BenchbotError):
        encoding.decode(data)


@settings(deadline=None)
@given(st.binary(max_size=60))
def test_random_array_headers_are_understood_or_refused(data: bytes) -> None:
    message = msgspec.msgpack.encode([msgspec.msgpack.Ext(encoding.ARRAY_CODE, data)])
    with suppress(BenchbotError):
        (array,) = encoding.decode(message)
        assert isinstance(array, np.ndarray)


@settings(deadline=None)
@given(arrays, st.data())
def test_a_damaged_message_is_understood_or_refused(array: NDArray[np.generic], data: st.DataObject) -> None:
    message = bytearray(encoding.encode({"image": array, "name": "x"}))
    position = data.draw(st.integers(0, len(message) - 1))
    message[position] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(message)))
    for damaged in (message, message[:cut]):
        with suppress(BenchbotError):
            encoding.decode(damaged)


def extension(dtype: str, shape: list[int], data: bytes) -> bytes:
    header = msgspec.msgpack.encode([dtype, shape])
    return msgspec.msgpack.encode(msgspec.msgpack.Ext(1, bytes([len(header)]) + header + data))


def test_the_layout_of_an_array_is_the_documented_one() -> None:
    array = np.array([[1, 2, 3]], dtype="<u2")
    header = b"\x92\xa3<u2\x92\x01\x03"
    data = bytes([len(header)]) + header + struct.pack("<3H", 1, 2, 3)
    assert encoding.encode(array) == b"\xc9" + struct.pack(">I", len(data)) + b"\x01" + data


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (extension("|O", [1], b"\0" * 8), "arrays of |O are not supported"),
        (extension("<c16", [1], b"\0" * 16), "arrays of <c16"),
        (extension("<f4,<f4", [1], b"\0" * 8), "arrays of <f4,<f4"),
        (extension("<f4", [1] * 9, b"\0" * 4), "shape"),
        (extension("<f4", [-1], b""), "shape"),
        (extension("<f4", [2], b"\0" * 4), "4 bytes instead of 8"),
        (extension("<f4", [1], b"\0" * 8), "8 bytes instead of 4"),
        (extension("|u1", [2**14, 2**15], b""), "larger than"),
        (extension("|u1", [2**62, 0], b""), "larger than"),
        (msgspec.msgpack.encode(msgspec.msgpack.Ext(1, b"")), "within its header"),
        (msgspec.msgpack.encode(msgspec.msgpack.Ext(9, b"x")), "extension type 9"),
        (b"\xdd\xff\xff\xff\xff", "truncated"),
        (b"\x91" * 100_000, "recursion"),
        (b"\x01\x02", "trailing"),
    ],
)
def test_what_is_not_within_the_caps_is_refused(message: bytes, why: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        encoding.decode(message)
    assert why in caught.value.why


@pytest.mark.parametrize(
    "value",
    [np.array(["text"]), np.array([object()]), np.zeros(1, complex), np.zeros((1,) * 9), object(), 2**70],
)
def test_what_the_wire_cannot_carry_is_told(value: Any) -> None:
    with pytest.raises(BenchbotError, match="cannot be sent"):
        encoding.encode({"value": value})


def test_arrays_in_a_bytearray_are_not_copied() -> None:
    image = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    message = bytearray(encoding.encode(image))
    arrived = encoding.decode(message)
    message[-1] = 255
    assert arrived[-1, -1, -1] == 255


@settings(deadline=None, max_examples=200)
@given(
    st.text(max_size=9), st.sampled_from(["<u2", "<f4", "<f8"]), st.lists(st.sampled_from([1, 9, 70, 300]), max_size=4)
)
def test_large_arrays_are_aligned_wherever_they_begin(name: str, dtype: str, sizes: list[int]) -> None:
    array = np.zeros([2100, *sizes[:1]], dtype)
    message = bytearray(encoding.encode({name: array, "next": [array, sizes]}))
    arrived = encoding.decode(message)
    for image in (arrived[name], arrived["next"][0]):
        assert image.shape == array.shape
        # A view of the message, not a copy that had to be made.
        assert image.base is not None
        assert image.flags.aligned


def test_the_place_of_an_array_is_sent_instead_of_it() -> None:
    shared, own = np.arange(6, dtype="<u2").reshape(2, 3), np.zeros(3)
    message = encoding.encode({"shared": shared, "own": own}, lambda array: 4096 if array is shared else None)
    place = b"\x93\xa3<u2\x92\x02\x03\xcd\x10\x00"
    assert b"\xc7" + bytes([len(place)]) + b"\x02" + place in message
    arrived = encoding.decode(message, lambda *asked: np.array([str(asked)]))
    assert arrived["shared"].tolist() == ["('<u2', [2, 3], 4096)"]
    assert arrived["own"].tolist() == [0, 0, 0]


def test_what_is_not_little_endian_is_sent_itself() -> None:
    array = np.arange(3, dtype=">u2")
    assert encoding.decode(encoding.encode(array, lambda array: 64)).tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    "place", [("|O", [1], 64), ("<f4", [2**40], 64), ("<f4", [-1], 64), ("<f4", [1] * 9, 64), ("<f4", [1]), 3, "x"]
)
def test_a_place_that_is_not_within_the_caps_is_refused(place: Any) -> None:
    message = msgspec.msgpack.encode(msgspec.msgpack.Ext(encoding.PLACE_CODE, msgspec.msgpack.encode(place)))
    for fetch in (None, lambda *asked: np.zeros(1)):
        with pytest.raises(BenchbotError, match="cannot be read"):
            encoding.decode(message, fetch)


@pytest.mark.parametrize("numpy", [None, ModuleType("numpy")], ids=["not imported", "being imported by another thread"])
def test_messages_without_arrays_need_no_numpy(numpy: ModuleType | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", numpy)
    assert encoding.decode(encoding.encode({"names": ["a", 1, 0.5, None]})) == {"names": ["a", 1, 0.5, None]}
    with pytest.raises(BenchbotError, match="A value cannot be sent"):
        encoding.encode({"what": object()})


def test_numpy_scalars_travel_as_numbers() -> None:
    assert encoding.decode(encoding.encode([np.float32(0.5), np.int64(3), np.bool_(True)])) == [0.5, 3, True]
