"""The files of a solution, as far as its command names them: their hashes are part of the key of every result."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from benchbot.core.provenance import files_named

FILES_LIMIT = 500
"""The most Python files that are hashed below one folder: one with more is no solution's."""
ENTRIES_LIMIT = 20_000
"""The most entries of folders that are searched for them."""
_PASSED_OVER = frozenset({"__pycache__", "node_modules", "site-packages"})


@dataclass(frozen=True)
class SourceFiles:
    """SHA-256 by name, relative to where the solution runs; `unread` are folders with too many files to hash all."""

    hashes: dict[str, str]
    unread: tuple[str, ...]

    @property
    def text(self) -> str:
        """The files that make another batch when they are edited, in words."""
        if not self.hashes and not self.unread:
            return "No file of the solution is part of the keys: its command names none that is in a folder of its own."
        count = len(self.hashes)
        shown = ", ".join([*list(self.hashes)[:8], *([f"… {count - 8} more"] if count > 8 else [])])
        counted = "1 file of the solution is" if count == 1 else f"{count} files of the solution are"
        lines = [f"{counted} part of the keys: {shown}"]
        lines += [
            f"{folder} holds too many files to look into the folders below it: put the solution into one of its own"
            for folder in self.unread
        ]
        return "\n".join(lines)


def find(command: Sequence[str], folder: Path) -> SourceFiles:
    """Return the files that a command names, and all Python files in and below the folders that it may import from."""
    hashes = files_named(list(command), folder)
    unread = []
    for root in _roots(command, folder, hashes):
        found = _python_files(folder / root)
        if found is None:
            unread.append(str((folder / root).resolve()))
            beside = sorted(path.name for path in (folder / root).glob("*.py") if path.is_file())
            found = beside if len(beside) <= FILES_LIMIT else []
        read = files_named(["", *found], folder / root)
        hashes |= {str(root / name): content for name, content in read.items()}
    return SourceFiles(hashes, tuple(unread))


def _roots(command: Sequence[str], folder: Path, named: dict[str, str]) -> Iterator[Path]:
    """Yield what Python puts first on its path: the folder of a script, or where `python -m` is typed."""
    yield from dict.fromkeys(Path(word).parent for word in named if word.endswith(".py"))
    for flag, module in pairwise(command):
        path = folder / module.replace(".", "/")
        if flag == "-m" and (path.is_dir() or path.with_suffix(".py").is_file()):
            yield Path()


def _python_files(root: Path) -> list[str] | None:
    """Return the Python files below a folder, sorted; None when it holds so much that it is no solution's."""
    found: list[str] = []
    looked_at = 0
    for place, folders, files in os.walk(root):
        looked_at += len(folders) + len(files)
        folders[:] = [name for name in folders if _may_be_imported(Path(place, name))]
        found += [str(Path(place, name).relative_to(root)) for name in files if name.endswith(".py")]
        if looked_at > ENTRIES_LIMIT or len(found) > FILES_LIMIT:
            return None
    return sorted(found)


def _may_be_imported(folder: Path) -> bool:
    """Say whether a folder may hold modules of a solution: not caches, environments, or what batches have computed."""
    if folder.name.startswith(".") or folder.name in _PASSED_OVER:
        return False
    return not (folder / "pyvenv.cfg").exists() and not _is_batch(folder)


def _is_batch(folder: Path) -> bool:
    return (folder / "plan.json").exists() and (folder / "episodes").is_dir()
