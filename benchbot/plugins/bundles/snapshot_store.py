"""Storing a snapshot: the files of a solution are copied, hashed as they were copied, and there all at once."""

import fcntl
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.plugins.bundles.snapshot import FILES, MANIFEST, ChangedError, Content, Snapshot, sha256_of

TOLD_BYTES = 256 * 2**20
_FICLONE = 0x40049409
"""`ioctl_ficlone(2)`: the copy shares its blocks with the original until one of the two is changed."""
_CHUNK_BYTES = 2**20
_MAKING = ".making-"


def store(
    folder: Path,
    content: Content,
    origin: Path,
    *,
    ran_in: Path,
    details: Mapping[str, Any],
    left_out: tuple[str, ...] = (),
    tell: Callable[[str], object] = lambda _: None,
) -> Path:
    """Keep the files of a content, which lie below `origin`, under its hash; return the folder of the snapshot.

    One that is there already stays, unless it is damaged: then it is set aside. Raises BenchbotError when a file was
    changed since the content was hashed, and when there is no room.
    """
    target = folder / content.hash
    if target.exists():
        try:
            Snapshot.opened(target)
        except ChangedError:
            tell(f"The snapshot of the solution in {target} was damaged: it is set aside, and made anew.")
            target.rename(tempfile.mkdtemp(prefix=f"damaged-{content.hash[:8]}-", dir=folder))
        else:
            return target
    try:
        sizes = {name: (origin / name).stat().st_size for name in content.files}
        folder.mkdir(parents=True, exist_ok=True)
        _check_room(folder, sizes, tell)
        with _making(folder) as making:
            _write(making / FILES, content, origin)
            document = {
                "content": asdict(content),
                "details": dict(details),
                "origin": str(origin),
                "ran_in": str(ran_in),
            }
            text = json.dumps({**document, "left_out": list(left_out)}, indent=1, sort_keys=True)
            (making / MANIFEST).write_text(f"{text}\n", "utf-8")
            making.chmod(0o755)
            making.rename(target)
    except OSError as error:
        if target.exists():  # another process was faster, with the same content
            return target
        raise BenchbotError(
            "The solution cannot be copied to where it is run from.",
            f"{error.filename}: {error.strerror}.",
            "Free some disk space, and see that the solution's files can be read.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        ) from error
    return target


@contextmanager
def _making(folder: Path) -> Iterator[Path]:
    """Yield a new folder, which is removed unless it is renamed, and remove those whose process was killed.

    It is locked meanwhile, so that nobody else takes it for one of those.
    """
    for left in folder.glob(f"{_MAKING}*"):
        with suppress(OSError), _locked(left):
            _remove(left)
    making: Path | None = None
    while making is None:
        with ExitStack() as stack:
            made = Path(tempfile.mkdtemp(prefix=_MAKING, dir=folder))
            try:
                stack.enter_context(_locked(made))
            except (BlockingIOError, FileNotFoundError):
                continue  # another process was faster, and removes it
            except OSError:
                pass  # where nothing can be locked, nothing is removed
            if made.exists():
                making = made
                stack.callback(_remove, made)
                yield making


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock a folder; raises OSError when another process has, or it is gone, or cannot be locked."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(handle)


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)


def _write(root: Path, content: Content, origin: Path) -> None:
    for name in (content.folder, *content.folders, *content.search):
        (root / name).mkdir(parents=True, exist_ok=True)
    for name, aim in content.links.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).symlink_to(aim)
    for name, expected in content.files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        if _copy(origin / name, root / name) != expected:
            raise BenchbotError(
                f"The solution's file {name} was changed just now.",
                "It is no longer what it was when the command began.",
                "Run the command again, when nobody writes to it.",
            )
        # An image keeps the modes of its files: those of what it is built from are left to their owner.
        writable = 0o200 if content.folders else 0
        (root / name).chmod((0o555 if name in content.executable else 0o444) | writable)


def _copy(source: Path, target: Path) -> str:
    """Copy a file, by sharing its blocks where the file system can; return the SHA-256 of the copy's own bytes."""
    with source.open("rb") as file, target.open("wb") as copy:
        try:
            fcntl.ioctl(copy.fileno(), _FICLONE, file.fileno())
        except OSError:
            hashed = sha256()
            while chunk := file.read(_CHUNK_BYTES):
                hashed.update(chunk)
                copy.write(chunk)
            return hashed.hexdigest()
    return sha256_of(target)


def _check_room(folder: Path, sizes: Mapping[str, int], tell: Callable[[str], object]) -> None:
    total, free = sum(sizes.values()), shutil.disk_usage(folder).free
    largest = max(sizes, key=lambda name: sizes[name], default="")
    if total > free:
        raise BenchbotError(
            "There is no room for a copy of the solution.",
            f"Its files are {total >> 20} MiB, {largest} the largest of them, and {free >> 20} MiB are free.",
            f"Free some disk space. What is none of the solution is named in .benchbotignore, beside it: /{largest}",
            exit_code=ExitCode.INTERNAL,
        )
    if total > TOLD_BYTES:
        tell(f"Copying the solution, {total >> 20} MiB; the largest of its files is {largest}")
