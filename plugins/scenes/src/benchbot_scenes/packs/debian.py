"""Debian packages: fetched with apt, read as the archives that they are (deb(5): ar of tar)."""

import io
import lzma
import shutil
import subprocess
import tarfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import IO, Any

from benchbot.plugin import BenchbotError, ExitCode

_MAGIC = b"!<arch>\n"
_HEADER_BYTES = 60
MEMBER_LIMIT_BYTES = 2**30
_BROKEN = (tarfile.TarError, lzma.LZMAError, zlib.error, EOFError, OSError, ValueError)


def download(package: str, folder: Path, timeout_s: float = 900.0) -> Path:
    """Fetch a package's file with apt-get, which needs no special rights; raises BenchbotError when it cannot."""
    apt = shutil.which("apt-get")
    if apt is None:
        raise BenchbotError(
            f"The package {package} cannot be fetched here.",
            "It is a package of Debian and Ubuntu, and this machine has no apt-get.",
            f"Fetch it from https://packages.debian.org/stable/{package}, then name the file with --from FILE.deb",
        )
    try:
        done = subprocess.run(
            [apt, "download", "--quiet", package],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise _not_fetched(package, f"apt-get took longer than {timeout_s:g} seconds.") from error
    found = sorted(folder.glob(f"{package}_*.deb"))
    if done.returncode != 0 or not found:
        raise _not_fetched(package, (done.stderr or done.stdout).strip() or f"apt-get ended with {done.returncode}.")
    return found[0]


def unpack(path: Path, folder: Path, suffixes: tuple[str, ...]) -> list[Path]:
    """Write the files of a package whose names end so into `folder`, by their bare names; raises BenchbotError."""
    found = []
    try:
        with path.open("rb") as stream, _data(stream, path) as archive:
            for member in archive:
                name = PurePosixPath(member.name).name
                if not member.isfile() or not name.endswith(suffixes):
                    continue
                if member.size > MEMBER_LIMIT_BYTES:
                    raise ValueError(f"{member.name} is larger than {MEMBER_LIMIT_BYTES >> 20} MiB")
                source = archive.extractfile(member)
                if source is not None:
                    found.append(folder / name)
                    with found[-1].open("wb") as target:
                        shutil.copyfileobj(source, target)
    except _BROKEN as error:
        raise BenchbotError(
            f"{path} is not a Debian package that can be read.", f"{error}.", "Fetch it again; it may be cut short."
        ) from error
    return found


def _data(stream: IO[bytes], path: Path) -> tarfile.TarFile:
    """Return the package's files as a tar that is read front to back."""
    for name, size in _members(stream):
        if name.startswith("data.tar"):
            if name.endswith(".zst"):
                return _unpacked_by_dpkg(path)
            return tarfile.open(fileobj=io.BufferedReader(_Part(stream, size)), mode="r|*")
        stream.seek(size + size % 2, 1)
    raise ValueError("it has no member data.tar")


def _members(stream: IO[bytes]) -> Iterator[tuple[str, int]]:
    """Yield name and size of an ar archive's members, with the stream at the member's first byte."""
    if stream.read(len(_MAGIC)) != _MAGIC:
        raise ValueError("it does not begin as an ar archive does")
    while header := stream.read(_HEADER_BYTES):
        if len(header) < _HEADER_BYTES or header[58:] != b"`\n":
            raise ValueError("the header of a member is damaged")
        yield header[:16].decode("ascii", "replace").strip().rstrip("/"), int(header[48:58])


class _Part(io.RawIOBase):
    """The next bytes of a stream, as a stream."""

    def __init__(self, stream: IO[bytes], size: int) -> None:
        self._stream = stream
        self._left = size

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        data = self._stream.read(min(len(buffer), self._left))
        self._left -= len(data)
        buffer[: len(data)] = data
        return len(data)


def _unpacked_by_dpkg(path: Path) -> tarfile.TarFile:
    # Zstandard, as Ubuntu packs, is in Python only from 3.14 on.
    dpkg = shutil.which("dpkg-deb")
    if dpkg is None:
        raise ValueError("it is packed with Zstandard, and there is no dpkg-deb here to read that")
    done = subprocess.run([dpkg, "--fsys-tarfile", str(path.absolute())], capture_output=True, check=False)
    if done.returncode != 0:
        raise ValueError(done.stderr.decode("utf-8", "replace").strip())
    return tarfile.open(fileobj=io.BytesIO(done.stdout))


def _not_fetched(package: str, why: str) -> BenchbotError:
    return BenchbotError(
        f"The package {package} could not be fetched.",
        why,
        "Look at the network and apt's sources (apt-get update), or name a file that you have: --from FILE.deb",
        exit_code=ExitCode.INTERNAL,
    )
