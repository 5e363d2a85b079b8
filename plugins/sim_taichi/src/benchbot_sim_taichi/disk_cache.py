"""Arrays kept on disk between runs, by content hash, and mapped into memory: processes share what they do not change.

A file is an .npz archive without compression, whose arrays begin at multiples of 64 bytes.
"""

import fcntl
import io
import logging
import mmap
import os
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Arrays = dict[str, npt.NDArray[Any]]

ALIGNMENT = 64
LEAST_MAPPED_BYTES = 2**20
"""Smaller files are read: they are not worth sharing, and stay whole whatever becomes of the file."""
# PKWARE's APPNOTE.TXT, section 4.3.7: a member's header, after which its name, extra fields and content follow.
_HEADER = struct.Struct("<4s22xHH")
_PADDING_FIELD = 0xD935

log = logging.getLogger(__name__)


def load(path: Path) -> Arrays | None:
    """Arrays stored at `path`, or None when there are none or the file is damaged.

    They may be written to: what is changed is this process's own, and the file stays as it is. The file may be replaced
    or deleted while it is mapped, as `store` does; one that is cut short in its place ends this process (SIGBUS).
    """
    try:
        with path.open("rb") as file, zipfile.ZipFile(file) as archive:
            is_large = os.fstat(file.fileno()).st_size >= LEAST_MAPPED_BYTES
            content = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY) if is_large else bytearray(path.read_bytes())
            return {member.filename.removesuffix(".npy"): _array(content, member) for member in archive.infolist()}
    # All that a damaged archive can raise.
    except (OSError, ValueError, EOFError, RuntimeError, SyntaxError, struct.error, zipfile.BadZipFile):
        return None


def store(path: Path, arrays: Arrays) -> None:
    """Write atomically, so that a reader sees the whole file or none. A folder that cannot be written is no error."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    except OSError:
        return
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file, zipfile.ZipFile(file, "w") as archive:
            for key, array in arrays.items():
                _write(archive, file.tell(), key, array)
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)


def load_or_make(path: Path, names: set[str], make: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of these names at `path`; where they are not there, they are made and stored.

    Of several processes one makes them, and the others wait for it. One that is killed meanwhile leaves the next to it.
    """

    def kept() -> Arrays | None:
        found = load(path)
        return found if found is not None and found.keys() == names else None

    found = kept()
    if found is not None:
        return found
    with _alone(path):
        found = kept()
        if found is not None:
            return found
        made = make()
        store(path, made)
    # The mapped ones: memory that other processes have, too.
    return kept() or made


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold the lock of a file; where there can be none, as on some network disks, go on without."""
    lock = path.with_suffix(".lock")
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError:
        yield
        return
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log.warning("%s is being made by another process: waiting for it.", path.name)
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX)
        except OSError:
            pass
        yield
        lock.unlink(missing_ok=True)
    finally:
        os.close(handle)


def _write(archive: zipfile.ZipFile, start: int, key: str, array: npt.NDArray[Any]) -> None:
    """Add an array to an archive whose next member begins at byte `start`."""
    member = zipfile.ZipInfo(f"{key}.npy")
    padding = -(start + _HEADER.size + len(member.filename.encode()) + 4) % ALIGNMENT
    member.extra = struct.pack("<HH", _PADDING_FIELD, padding) + bytes(padding)
    member.file_size = array.nbytes  # the archive has to know of more than 2 GiB beforehand
    with archive.open(member, "w") as file:
        np.lib.format.write_array(file, array, allow_pickle=False)


def _array(archive: mmap.mmap | bytearray, member: zipfile.ZipInfo) -> npt.NDArray[Any]:
    """Return the array of a member where it lies; raises ValueError and others for a damaged one."""
    magic, name_size, extra_size = _HEADER.unpack_from(archive, member.header_offset)
    start = member.header_offset + _HEADER.size + name_size + extra_size
    content = memoryview(archive)[start : start + member.file_size]
    whole = len(content) == member.file_size and zlib.crc32(content) == member.CRC
    if magic != b"PK\3\4" or member.compress_type != zipfile.ZIP_STORED or not whole:
        raise ValueError(f"{member.filename} is damaged")
    header = io.BytesIO(content[: 2**16])
    np.lib.format.read_magic(header)
    shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(header)
    flat = np.frombuffer(content, dtype, count=int(np.prod(shape)), offset=header.tell())
    array = flat.reshape(shape, order="F" if is_fortran else "C")
    return array if array.flags.aligned else array.copy()
