"""The weaker sandbox where there is no bubblewrap: a view of the file system as rules for Landlock."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchbot.plugins.sandbox.view import View
from benchbot.submission.init import landlock

DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
WEAKER = (
    "in a sandbox of Landlock instead of bubblewrap, which is weaker: it may see the names of files, though not what "
    "is in them, and talk to unix sockets that this user may"
)


def problem() -> str | None:
    """Return the reason why Landlock cannot hold a solution on this machine; None when it can."""
    found = landlock.version()
    if found >= landlock.NEEDED_VERSION:
        return None
    if found == 0:
        return "this kernel has no Landlock"
    return f"this kernel's Landlock is of version {found}, and {landlock.NEEDED_VERSION} is needed"


def rules(view: View, writable: Path) -> list[tuple[str, int]]:
    """Return rules for the paths that the view shows and does not hide, some devices, and one folder to write to.

    Landlock only ever allows, so a folder with something hidden in it is allowed piece by piece.
    """
    found = [(device, landlock.DEVICE) for device in DEVICES if Path(device).exists()]
    found.append((str(writable), landlock.EVERYTHING))
    # To import a module, Python reads the names in a folder; the right to that holds for all below it.
    found += [(str(path), landlock.NAMES) for path in view.searched]
    hidden = [path.resolve() for path in view.hidden]
    for path in view.shown:
        found += _pieces(path.resolve(), hidden)
    return found


def _pieces(path: Path, hidden: Sequence[Path]) -> Iterator[tuple[str, int]]:
    if any(path.is_relative_to(other) for other in hidden):
        return
    if not any(other.is_relative_to(path) for other in hidden):
        yield str(path), landlock.READ
        return
    yield str(path), landlock.NAMES
    with os.scandir(path) as entries:
        for entry in entries:
            if not entry.is_symlink():
                yield from _pieces(path / entry.name, hidden)
