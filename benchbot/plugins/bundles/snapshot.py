"""Snapshots: the files of a solution, kept under the hash of what they hold, and run from there.

FOLDER/HASH/snapshot.json   the content, which HASH is of; beside it what the files were called where they came from
FOLDER/HASH/files/…         the files, read-only
"""

import json
import os
import shlex
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.request import digest

FOLDER = "solutions"
"""The folder of a batch that its snapshots are in."""
MANIFEST, FILES = "snapshot.json", "files"
COPIED_BYTES = 2**20
"""Larger files are links in the copies that a solution works in: it can read them, and not change them."""
_CHUNK_BYTES = 2**20

Marks = dict[str, tuple[int, ...]]


class ChangedError(BenchbotError):
    """The files of a snapshot are not what its hash is of."""


@dataclass(frozen=True)
class Content:
    """All that makes a snapshot what it is; names are relative to one folder, with slashes."""

    folder: str
    """The folder that the solution runs in."""
    files: Mapping[str, str]
    """SHA-256 by name."""
    executable: tuple[str, ...] = ()
    search: tuple[str, ...] = ()
    """The folders that Python looks for modules in, beside that of the solution."""
    links: Mapping[str, str] = field(default_factory=dict)
    """The symbolic links, where these count as such: in what an image is built from."""
    folders: tuple[str, ...] = ()
    """Folders that are there though they may be empty."""

    @cached_property
    def hash(self) -> str:
        """The SHA-256 of the content, by which it is found."""
        return digest(asdict(self))


@dataclass(frozen=True)
class Snapshot:
    """A snapshot in its folder, checked when it was opened."""

    path: Path
    content: Content
    details: Mapping[str, Any]
    """The solution as results name it: its command, the files that this names, and its revision."""
    origin: Path
    """The folder that the names of the files are relative to, where they came from."""
    ran_in: Path
    """The folder that the solution would run in, where its files came from."""
    left_out: tuple[str, ...]
    """Files beside those of the solution that are none of it."""
    marks: Marks

    @classmethod
    def opened(cls, path: Path) -> Self:
        """Return the snapshot in a folder; raises ChangedError unless it holds just what the folder's name says."""
        content, document = _manifest(path)
        marks = _marks(path / FILES)
        if content is None or content.hash != path.name:
            raise _changed(path, f"Its {MANIFEST} is missing or damaged.")
        known = {*content.files, *content.links}
        there = {name for name in marks if not _is_folder(path / FILES / name)}
        odd = sorted(known ^ there) or sorted(
            name for name, expected in content.files.items() if sha256_of(path / FILES / name) != expected
        )
        if odd:
            what = "was added" if odd[0] in there - known else "is missing" if odd[0] in known - there else "is changed"
            raise _changed(path, f"{odd[0]} {what}.")
        origin, ran_in = Path(document["origin"]), Path(document["ran_in"])
        return cls(path, content, document["details"], origin, ran_in, tuple(document["left_out"]), marks)

    @property
    def files(self) -> Path:
        """The folder of the files."""
        return self.path / FILES

    def check(self) -> None:
        """Raise ChangedError when anything was written into it since it was opened, even if it was put back since."""
        now = _marks(self.files)
        if now != self.marks:
            odd = min(name for name in {*now, *self.marks} if now.get(name) != self.marks.get(name))
            raise _changed(self.path, f"{odd or 'The folder'} was written to while the solution ran.")

    def missed(self, said: str) -> str | None:
        """Return advice to a solution that failed, with these last words, for want of a file that was left out."""
        missing = [name for name in self.left_out if Path(name).name in said or f"'{Path(name).stem}'" in said]
        if not missing or not ("No such file" in said or "No module named" in said or "Error" in said):
            return None
        names = " ".join(f"--source {shlex.quote(name)}" for name in missing[:3])
        return f"{', '.join(missing[:3])} lies beside the solution and is none of its files. If it is needed: {names}"

    def moved(self, word: str, root: Path) -> str:
        """Return a word of the command for where the files lie below `root`; a file that is none of it stays put."""
        option, equals, value = word.rpartition("=")
        path = Path(os.path.normpath(self.ran_in / value))
        if not value or not os.path.lexists(path):
            return word
        if path.is_relative_to(self.origin):
            name = path.relative_to(self.origin).as_posix()
            if name in self.content.files or any(one.startswith(f"{name}/") for one in self.content.files):
                return f"{option}{equals}{root / name}" if Path(value).is_absolute() else word
        return f"{option}{equals}{path}" if os.sep in value or path.is_file() else word

    def portable(self, solution: Mapping[str, Any]) -> dict[str, Any]:
        """Return a solution, as a result names it, with its words relative to the folder of all files."""

        def inside(word: str) -> str:
            path = Path(os.path.normpath(self.ran_in / word))
            name = path.relative_to(self.origin).as_posix() if path.is_relative_to(self.origin) else ""
            return name if name in self.content.files and os.path.normpath(word) != name else word

        files = {inside(word): found for word, found in (solution.get("files") or {}).items()}
        return {**solution, "command": [inside(word) for word in solution["command"]], "files": files}

    @contextmanager
    def copied(self, folder: Path) -> Iterator[None]:
        """Make a copy to work in, with links to large files; on leaving only what was written into it is left.

        Raises ChangedError, and OSError when it cannot be written.
        """
        made: Marks = {}
        try:
            (folder / self.content.folder).mkdir(parents=True)
            for name, expected in self.content.files.items():
                source, target = self.files / name, folder / name
                target.parent.mkdir(parents=True, exist_ok=True)
                if source.stat().st_size > COPIED_BYTES:
                    target.symlink_to(source.absolute())
                else:
                    found = source.read_bytes()
                    if sha256(found).hexdigest() != expected:
                        raise _changed(self.path, f"{name} is changed.")
                    target.write_bytes(found)
                    target.chmod(0o755 if name in self.content.executable else 0o644)
                made[name] = _mark(target)
            yield
        finally:
            _clear(folder, made)


def found(hash_: str, near: Iterable[Path]) -> Snapshot | None:
    """Return the snapshot of a hash that lies with the batch of one of these results or folders; None without one.

    Raises ChangedError when it is damaged.
    """
    for path in near:
        for folder in (path.absolute(), *path.absolute().parents):
            if (folder / FOLDER / hash_ / MANIFEST).is_file():
                return Snapshot.opened(folder / FOLDER / hash_)
    return None


def _clear(folder: Path, made: Marks) -> None:
    """Remove from a copy all that is as it was made, bytecode, and the folders that are empty then."""
    with suppress(OSError):
        for name, mark in made.items():
            with suppress(OSError):
                if _mark(folder / name) == mark:
                    (folder / name).unlink()
        for place, folders, files in os.walk(folder, topdown=False):
            path = Path(place)
            if path.name == "__pycache__":
                for name in files:
                    (path / name).unlink()
            if not any(os.path.lexists(path / name) for name in (*folders, *files)):
                path.rmdir()


def _manifest(path: Path) -> tuple[Content | None, dict[str, Any]]:
    try:
        document = json.loads((path / MANIFEST).read_bytes())
        found = document["content"]
        tuples = {name: tuple(found[name]) for name in ("executable", "search", "folders")}
        return Content(**{**found, **tuples}), document
    except (OSError, ValueError, KeyError, TypeError):
        return None, {}


def _marks(root: Path) -> Marks:
    """Return what changes with every write below a folder: nobody can set the times of changes of inodes."""
    found = {"": _mark(root)} if root.is_dir() else {}
    for place, folders, files in os.walk(root):
        for name in (*folders, *files):
            path = Path(place, name)
            found[path.relative_to(root).as_posix()] = _mark(path)
    return found


def _mark(path: Path) -> tuple[int, ...]:
    status = path.lstat()
    return status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    hashed = sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK_BYTES):
            hashed.update(chunk)
    return hashed.hexdigest()


def _changed(path: Path, why: str) -> ChangedError:
    return ChangedError(
        "The snapshot of the solution is not what it was.",
        f"{path}: {why} Results of it would be of another solution than they say.",
        "Give the command that began the batch again: with the solution's files as they were, it makes the snapshot "
        "anew. Begin another batch with what they are now: --output-location FOLDER",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )
