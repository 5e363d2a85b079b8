import os
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis.extra import numpy as arrays_of
from numpy.typing import NDArray

from benchbot.wire import arena


@pytest.fixture
def handle() -> Iterator[int]:
    handle = arena.create()
    yield handle
    os.close(handle)


def write(writer: arena.ArenaWriter, arrays: Sequence[NDArray[Any]]) -> list[int]:
    """Write arrays and return their offsets."""
    layout = arena.Layout()
    offsets = [layout.add(array) for array in arrays]
    writer.write(layout)
    return offsets


def transfer(handle: int, *sent: NDArray[np.generic]) -> list[NDArray[np.generic]]:
    writer, reader = arena.ArenaWriter(handle), arena.ArenaReader(handle)
    offsets = write(writer, sent)
    return [reader.read(array.dtype.str, array.shape, offset) for array, offset in zip(sent, offsets, strict=True)]


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    arrays_of.arrays(arrays_of.scalar_dtypes(), arrays_of.array_shapes(min_dims=0, max_dims=5, min_side=0, max_side=6))
)
def test_arrays_arrive_as_they_were(handle: int, array: NDArray[np.generic]) -> None:
    first, second = transfer(handle, array, np.arange(3))
    assert (first.dtype, first.shape) == (array.dtype, array.shape)
    assert first.tobytes() == array.tobytes()
    assert second.tolist() == [0, 1, 2]


def test_an_array_that_is_not_contiguous_arrives_in_order(handle: int) -> None:
    array = np.arange(24).reshape(4, 6)[::-2, ::3]
    (arrived,) = transfer(handle, array)
    np.testing.assert_array_equal(arrived, array)


def test_the_memory_grows_with_what_is_written(handle: int) -> None:
    writer, reader = arena.ArenaWriter(handle), arena.ArenaReader(handle)
    for size in (10, 10_000, 3_000_000, 5):
        array = np.arange(size, dtype=np.uint32)
        (offset,) = write(writer, [array])
        np.testing.assert_array_equal(reader.read("<u4", [size], offset), array)


def test_what_was_read_is_the_readers_to_keep(handle: int) -> None:
    writer, reader = arena.ArenaWriter(handle), arena.ArenaReader(handle)
    (offset,) = write(writer, [np.zeros(4)])
    kept = reader.read("<f8", [4], offset)
    write(writer, [np.ones(4)])
    assert kept.tolist() == [0, 0, 0, 0]
    kept[0] = 7


@pytest.mark.parametrize(
    ("dtype", "shape", "offset"),
    [
        ("<f8", [2**20], 64),
        ("<f8", [2**62, 2**62], 64),
        ("<f8", [-1], 64),
        ("<f8", [1], -8),
        ("<f8", [1], 0),
        ("<f8", [1], 2**60),
        ("|O", [1], 64),
    ],
)
def test_nothing_outside_of_the_memory_is_read(handle: int, dtype: str, shape: list[int], offset: int) -> None:
    write(arena.ArenaWriter(handle), [np.zeros(8)])
    with pytest.raises(ValueError, match="array"):
        arena.ArenaReader(handle).read(dtype, shape, offset)


def test_the_child_cannot_pull_the_memory_away(handle: int) -> None:
    write(arena.ArenaWriter(handle), [np.zeros(8)])
    sealed = hasattr(os, "memfd_create")
    with pytest.raises(PermissionError) if sealed else nullcontext():
        os.ftruncate(handle, 0)


def test_a_view_is_not_copied_cannot_be_written_and_is_found_again(handle: int) -> None:
    writer, reader = arena.ArenaWriter(handle), arena.ArenaReader(handle)
    offsets = write(writer, [np.zeros(4), np.ones((2, 3), np.float32)])
    view = reader.view("<f4", [2, 3], offsets[1])
    assert not view.flags.writeable
    assert reader.offset_of(view) == offsets[1]
    write(writer, [np.zeros(4), np.full((2, 3), 7, np.float32)])
    assert view.tolist() == [[7] * 3] * 2


def test_only_whole_arrays_of_the_memory_are_found_in_it(handle: int) -> None:
    writer, reader = arena.ArenaWriter(handle), arena.ArenaReader(handle)
    (offset,) = write(writer, [np.arange(12).reshape(3, 4)])
    view = reader.view("<i8", [3, 4], offset)
    assert reader.offset_of(view[1:]) == offset + 32
    assert reader.offset_of(view[:, 1:]) is None
    assert reader.offset_of(view.copy()) is None
    assert reader.offset_of(view[:0]) is None


def test_every_writing_has_an_even_number_of_its_own(handle: int) -> None:
    writer, reader = arena.ArenaWriter(handle), arena.ArenaReader(handle)
    numbers = []
    for size in (1, 10_000, 3):
        write(writer, [np.zeros(size)])
        numbers.append(reader.sequence)
    assert numbers == [2, 4, 6]
    write(writer, [])
    assert reader.sequence == 6


def test_each_memory_has_a_nonce_of_its_own(handle: int) -> None:
    other = arena.create()
    nonces = {arena.ArenaReader(each).nonce for each in (handle, other)}
    os.close(other)
    assert len(nonces) == 2
    assert {len(nonce) for nonce in nonces} == {2 * arena.NONCE_BYTES}


def test_a_file_without_a_header_is_no_arena(tmp_path: Path) -> None:
    (tmp_path / "short").write_bytes(b"x")
    with (tmp_path / "short").open("rb") as file, pytest.raises(ValueError, match="at least 64 bytes"):
        arena.ArenaReader(file.fileno())
