"""The folder that a solution hands its result over in, and its removal, whatever the solution has made of it."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path


@contextmanager
def exchange_folder() -> Iterator[Path]:
    """Yield a fresh folder (0700), which goes in the end, with all that a solution has put into it."""
    folder = Path(tempfile.mkdtemp(prefix="benchbot-"))
    try:
        yield folder
    finally:
        remove(folder)


def remove(folder: Path) -> None:
    """Remove a folder, however deep it is: `shutil.rmtree` gives up at a thousand levels, and so do paths.

    What lies two levels down is moved up before what is above it goes. What another user owns may stay.
    """
    numbers = count()
    # With links and files gone at once, every round leaves less, or nothing can be done any more.
    while _flattened(folder, numbers):
        pass
    with suppress(OSError):
        folder.rmdir()


def _flattened(folder: Path, numbers: "count[int]") -> bool:
    """Take one level of folders away; say whether there was one, and it went."""
    changed = False
    for entry in list(os.scandir(folder)):
        if not entry.is_dir(follow_symlinks=False):
            with suppress(OSError):
                Path(entry).unlink()
            continue
        with suppress(OSError):
            Path(entry).chmod(0o700)
            for inner in list(os.scandir(entry)):
                if inner.is_dir(follow_symlinks=False):
                    # To rename a folder, one must be able to write to it.
                    Path(inner).chmod(0o700)
                    Path(inner).rename(_free(folder, numbers))
                else:
                    Path(inner).unlink()
            Path(entry).rmdir()
            changed = True
    return changed


def _free(folder: Path, numbers: "count[int]") -> Path:
    """Return a name that nothing in the folder has."""
    while True:
        path = folder / f"benchbot-removing-{next(numbers)}"
        if not path.is_symlink() and not path.exists():
            return path
