"""The context of an image: a Dockerfile and the folder that it lies in, or a folder that is an OCI image layout."""

import hashlib
import os
import re
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers.layout import MARKER

NAMES = ("Dockerfile", "Containerfile", MARKER)
_FROM = re.compile(r"^\s*FROM\s+(?:--\S+\s+)*(\S+)", re.IGNORECASE | re.MULTILINE)


@dataclass(frozen=True)
class Context:
    """A folder, and the Dockerfile: its name in the folder, or its path where it lies elsewhere.

    Of an image layout, which is not built, it is the file that marks one.
    """

    folder: Path
    dockerfile: str

    @property
    def is_layout(self) -> bool:
        """Whether the image is there, to be loaded."""
        return self.dockerfile == MARKER

    @property
    def ignored(self) -> list[str]:
        """The patterns of `.dockerignore`."""
        path = self.folder / ".dockerignore"
        lines = path.read_text("utf-8").splitlines() if path.is_file() else []
        return [line.strip() for line in lines if line.strip() and not line.startswith("#")]

    @property
    def names(self) -> list[str]:
        """The files and folders that the image is built from, relative to the folder, without the Dockerfile."""
        from docker.utils.build import exclude_paths

        found: Iterable[str] = exclude_paths(str(self.folder), self.ignored, dockerfile=self.dockerfile)
        return sorted(found)

    def digest(self, identity: Callable[[str], str | None]) -> str:
        """Return a digest (SHA-256) of everything in the image: names, contents, executable bits, bases.

        `identity` returns the identifier of an image on this machine, or None where it is not here yet.
        """
        digest = hashlib.sha256((self.folder / self.dockerfile).read_bytes())
        for name in self.names:
            path = self.folder / name
            mode = path.lstat().st_mode
            content = b""
            if stat.S_ISLNK(mode):
                content = os.fsencode(path.readlink())
            elif stat.S_ISREG(mode):
                with path.open("rb") as file:
                    content = hashlib.file_digest(file, "sha256").digest()
            for part in (os.fsencode(name), oct(stat.S_IFMT(mode) | (mode & 0o111)).encode(), content):
                digest.update(len(part).to_bytes(8, "big") + part)
        for base in self.bases():
            digest.update(f"\0{base}={identity(base) or ''}".encode())
        return digest.hexdigest()

    def bases(self) -> list[str]:
        """Return the images that the Dockerfile starts from, as it names them."""
        return _FROM.findall((self.folder / self.dockerfile).read_text("utf-8", "replace"))


def find(path: Path, folder: Path | None = None) -> Context:
    """Return the context that a folder, a Dockerfile or a layout stands for; raises BenchbotError when there is none.

    The context is the folder of the Dockerfile, wherever the command is typed (BenchBot v2 took the working folder),
    or `folder`, where an example names one.
    """
    path = path.absolute()
    files = [path, *(path / name for name in NAMES)]
    for file in files:
        if file.is_file():
            inside = file.parent if folder is None else folder.absolute()
            if not inside.is_dir():
                raise _none(inside)
            within = file.is_relative_to(inside)
            return Context(inside, str(file.relative_to(inside) if within else file))
    raise _none(path)


def _none(path: Path) -> BenchbotError:
    return BenchbotError(
        f"There is no Dockerfile at {path}.",
        "It is a folder without one." if path.is_dir() else "There is nothing of that name.",
        "Name a Dockerfile, or a folder that has one: --containerised my_solution/",
    )
