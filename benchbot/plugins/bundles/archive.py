"""The file of a bundle: a ZIP archive of one canonical form; every other file is known to be damaged or hostile.

Members are stored, not compressed, in the order of their names, with one fixed time and nothing optional: the same
members give the same bytes on every machine. Reading writes the archive again and compares, and refuses a file that
differs in a single bit. That excludes bombs (nothing is compressed), overlapping members and hidden data between them.
"""

import os
import shutil
import stat
import struct
import tempfile
import unicodedata
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import IO

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError

MAX_MEMBERS = 10_000
MAX_BYTES = 2**31 - 2**24
"""Less than 2 GiB, so that no member or offset needs ZIP64."""
MAX_PATH_BYTES, MAX_DEPTH = 240, 32

_TIME = (1980, 1, 1, 0, 0, 0)
_PLAIN, _EXECUTABLE = (stat.S_IFREG | 0o644) << 16, (stat.S_IFREG | 0o755) << 16
_UNIX, _UTF_8 = 3, 0x800
_END_BYTES = 22
_CHUNK_BYTES = 2**20


@dataclass(frozen=True)
class Member:
    """One file of a bundle: its path in it, with slashes, and its content, in memory, on disk or in an archive."""

    path: str
    content: bytes | Path | tuple[zipfile.ZipFile, zipfile.ZipInfo]
    executable: bool = False

    @property
    def size_bytes(self) -> int:
        """The size of its content."""
        if isinstance(self.content, tuple):
            return self.content[1].file_size
        return len(self.content) if isinstance(self.content, bytes) else self.content.stat().st_size

    @property
    def sha256(self) -> str:
        """The SHA-256 of its content."""
        digest = sha256()
        with self.opened() as content:
            while chunk := content.read(_CHUNK_BYTES):
                digest.update(chunk)
        return digest.hexdigest()

    def opened(self) -> IO[bytes]:
        """Open its content for reading."""
        if isinstance(self.content, tuple):
            archive, info = self.content
            return archive.open(info)
        return BytesIO(self.content) if isinstance(self.content, bytes) else self.content.open("rb")

    def read(self) -> bytes:
        """Return its content."""
        with self.opened() as content:
            return content.read()


def flaw(paths: Iterable[str]) -> str | None:
    """Return why paths cannot be those of one bundle, and of a folder on any machine; None when they can."""
    seen: dict[str, str] = {}
    folders: set[str] = set()
    for path in paths:
        parts = path.split("/")
        if "" in parts or "." in parts or ".." in parts:
            return f"{path!r:.100} is not a plain path below the bundle."
        if any(unicodedata.category(letter) in ("Cc", "Cf", "Cs") for letter in path) or set(path) & set('\\:*?"<>|'):
            return f"{path!r:.100} holds a character that not every machine can have in a name."
        if len(path.encode()) > MAX_PATH_BYTES or len(parts) > MAX_DEPTH:
            return f"{path!r:.100} is longer than {MAX_PATH_BYTES} bytes, or deeper than {MAX_DEPTH} folders."
        folded = unicodedata.normalize("NFC", path).casefold()
        if folded in seen:
            return f"{path!r:.100} and {seen[folded]!r:.100} are one file on some machines."
        seen[folded] = path
        folders |= {str(parent) for parent in PurePosixPath(folded).parents}
    both = sorted(folders & set(seen))
    return f"{seen[both[0]]!r:.100} is a file and a folder." if both else None


def write(target: Path, members: Sequence[Member]) -> None:
    """Write a bundle, whole or not at all.

    Raises BenchbotError for paths that cannot be in one, for one that is too large, and when it cannot be written.
    """
    size_bytes = sum(member.size_bytes for member in members)
    wrong = flaw(member.path for member in members)
    if wrong is None and len(members) > MAX_MEMBERS:
        wrong = f"It would have {len(members)} files; {MAX_MEMBERS} are the most."
    if wrong is None and size_bytes > MAX_BYTES:
        wrong = f"It would hold {size_bytes >> 20} MiB; {MAX_BYTES >> 20} MiB are the most."
    if wrong is not None:
        raise BenchbotError(
            "The bundle cannot be made.", wrong, "Rename the file, or leave it out: --leave-out PATTERN (repeatable)."
        )
    try:
        with atomic.writing(target) as file:
            _write(file, members)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error


@dataclass(frozen=True)
class Archive:
    """An open bundle whose form has been checked: its paths are safe to create files with."""

    source: Path
    members: Mapping[str, Member]

    def extract(self, below: str, folder: Path) -> None:
        """Write the members whose path begins with `below/` into a folder, without that prefix."""
        for path, member in self.members.items():
            if path.startswith(f"{below}/"):
                target = folder / path.removeprefix(f"{below}/")
                target.parent.mkdir(parents=True, exist_ok=True)
                with member.opened() as content, target.open("xb") as file:
                    shutil.copyfileobj(content, file, _CHUNK_BYTES)
                target.chmod(0o755 if member.executable else 0o644)


@contextmanager
def opened(path: Path) -> Iterator[Archive]:
    """Open a bundle; raises BenchbotError for a file that is not, to the bit, in the form of one."""
    with ExitStack() as stack:
        try:
            file = stack.enter_context(path.open("rb"))
            _check_end(path, file)
            archive = stack.enter_context(zipfile.ZipFile(file))
            _check_members(path, archive)
            members = [
                Member(info.filename, (archive, info), info.external_attr == _EXECUTABLE) for info in archive.infolist()
            ]
            _check_bytes(path, file, members)
        # zipfile raises all of these for archives that are damaged.
        except (zipfile.BadZipFile, EOFError, NotImplementedError, ValueError, struct.error) as error:
            raise damaged(path, f"It is no ZIP archive that can be read: {error}.") from error
        except OSError as error:
            raise BenchbotError(
                f"Cannot read {path}.", error.strerror or str(error), "Check that the path is right, and yours to read."
            ) from error
        yield Archive(path, {member.path: member for member in members})


def damaged(path: Path, why: str) -> BenchbotError:
    """Return the error of a file that is not a sound bundle."""
    return BenchbotError(
        f"{path} is not a sound bundle.",
        why,
        "Get it again from whoever made it. Archives that another program than 'benchbot bundle' has packed, or packed "
        "anew, are refused.",
    )


def _write(file: IO[bytes], members: Iterable[Member]) -> None:
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=False) as archive:
        for member in sorted(members, key=lambda member: member.path):
            info = zipfile.ZipInfo(member.path, _TIME)
            # The default depends on the machine.
            info.create_system = _UNIX
            info.external_attr = _EXECUTABLE if member.executable else _PLAIN
            info.file_size = member.size_bytes
            with member.opened() as content, archive.open(info, "w") as written:
                shutil.copyfileobj(content, written, _CHUNK_BYTES)


def _check_end(path: Path, file: IO[bytes]) -> None:
    """Check the end record before zipfile reads it: it says how much there is to read."""
    status = os.fstat(file.fileno())
    if not stat.S_ISREG(status.st_mode) or not _END_BYTES <= status.st_size <= MAX_BYTES + MAX_MEMBERS * 1024:
        raise damaged(path, "It is no file, or one of a size that no bundle has.")
    file.seek(-_END_BYTES, os.SEEK_END)
    end = file.read(_END_BYTES)
    count = int.from_bytes(end[10:12], "little")
    length, offset = int.from_bytes(end[12:16], "little"), int.from_bytes(end[16:20], "little")
    if end[:4] != b"PK\5\6" or offset + length + _END_BYTES != status.st_size:
        raise damaged(path, "Its end is missing or damaged.")
    if count > MAX_MEMBERS:
        raise damaged(path, f"It has {count} members; {MAX_MEMBERS} are the most.")


def _check_members(path: Path, archive: zipfile.ZipFile) -> None:
    members = archive.infolist()
    wrong = flaw(info.filename for info in members)
    if wrong is not None:
        raise damaged(path, wrong)
    for info in members:
        if info.external_attr not in (_PLAIN, _EXECUTABLE):
            raise damaged(path, f"{info.filename!r:.100} is a link, a folder or a device, not a plain file.")
        if info.compress_type != zipfile.ZIP_STORED or info.compress_size != info.file_size:
            raise damaged(path, f"{info.filename!r:.100} is compressed; nothing in a bundle is.")
        if info.flag_bits & ~_UTF_8:
            raise damaged(path, f"{info.filename!r:.100} is encrypted, or of no known form.")


def _check_bytes(path: Path, file: IO[bytes], members: Sequence[Member]) -> None:
    """Write the archive again, and compare."""
    with tempfile.TemporaryFile() as again:
        _write(again, members)
        again.seek(0)
        file.seek(0)
        while chunk := file.read(_CHUNK_BYTES):
            if chunk != again.read(_CHUNK_BYTES):
                raise damaged(path, "It is not, to the bit, as 'benchbot bundle' writes it.")
        if again.read(1):
            raise damaged(path, "It is shorter than what it holds.")
