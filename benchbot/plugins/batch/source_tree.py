"""The folders of a solution: what lies in them, without what gathers there and what an ignore file names."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.core.errors import BenchbotError
from benchbot.core.provenance import is_file
from benchbot.plugins.batch.source_places import is_passed_over

if TYPE_CHECKING:
    from pathspec import GitIgnoreSpec

IGNORE_FILE = ".benchbotignore"
ENTRIES_LIMIT = 20_000
"""The most entries of folders that are looked at."""


class SourceTree:
    """The folder that a solution runs in, and the `roots` that Python looks into, in their order."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.roots: list[Path] = []
        self.is_too_large = False
        """Whether the folder that was looked through last has more entries than are looked at."""
        self._specs: dict[Path, GitIgnoreSpec] = {}

    def glob(self, start: Path, pattern: str) -> Iterator[Path]:
        """Yield what a pattern names below a folder; nothing for what is no pattern."""
        try:
            found = sorted(start.glob(pattern))
        except (ValueError, NotImplementedError, OSError):
            return
        for path in found:
            inside = path.relative_to(start).parents
            if not any(is_passed_over(start / folder) for folder in inside if folder != Path()):
                yield Path(os.path.normpath(path))

    def below(self, root: Path, *, bounded: bool = False) -> Iterator[Path]:
        """Yield the files below a folder; of too many only the first when it is `bounded`, else it is an error."""
        looked_at = 0
        for place, folders, files in os.walk(root):
            looked_at += len(folders) + len(files)
            self.is_too_large = looked_at > ENTRIES_LIMIT
            if self.is_too_large:
                if bounded:
                    return
                raise BenchbotError(
                    f"{root} holds too many files for a part of a solution.",
                    f"The solution names it, and it holds more than {ENTRIES_LIMIT}.",
                    f"Write what is none of it into {self.folder / IGNORE_FILE}, or name the folder by a path "
                    "that lies elsewhere: then it is not copied.",
                )
            folders[:] = sorted(name for name in folders if not is_passed_over(Path(place, name)))
            for name in sorted(files):
                path = Path(place, name)
                if not name.endswith(".pyc") and name != IGNORE_FILE and not self.is_ignored(path):
                    yield path

    def is_within(self, path: Path) -> bool:
        """Say whether a path lies in one of the folders."""
        return any(path.is_relative_to(root) for root in (self.folder, *self.roots))

    def _spec(self, root: Path) -> "GitIgnoreSpec":
        from pathspec import GitIgnoreSpec

        if root not in self._specs:
            file = root / IGNORE_FILE
            lines = file.read_text("utf-8").splitlines() if is_file(file) else []
            self._specs[root] = GitIgnoreSpec.from_lines(lines)
        return self._specs[root]

    def is_ignored(self, path: Path) -> bool:
        """Say whether the file for that, where the command runs or beside a script, names a path."""
        ending = "/" if path.is_dir() else ""
        return any(
            self._spec(root).match_file(path.relative_to(root).as_posix() + ending)
            for root in dict.fromkeys((self.folder, *self.roots))
            if path != root and path.is_relative_to(root)
        )
