"""The files of a solution: those that its command names, and what these import and name in turn.

They are the content of its snapshot, and their hash is part of the key of every result. docs/batch.md has the rules.
"""

import os
import re
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import file_digest, sha256
from itertools import pairwise
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.core.provenance import is_file
from benchbot.plugins.batch import mentions
from benchbot.plugins.batch.mentions import Import, Mentions
from benchbot.plugins.batch.source_places import (
    brings_own,
    exists,
    is_installed,
    is_passed_over,
    is_python,
    linked_folders,
    module_files,
    packages_known,
    python_path,
)
from benchbot.plugins.batch.source_tree import IGNORE_FILE, SourceTree
from benchbot.plugins.bundles.snapshot import Content

ELSEWHERE = ".elsewhere"
"""The empty folder that a solution runs in whose files all lie elsewhere."""
FILES_LIMIT = 500
"""The most Python files below one folder that count because any of them may be imported."""
TEXT_BYTES = 2**20
"""Larger files that are no Python code are not searched for the names of others."""
_SHOWN = 8
_SYSTEM = tuple(map(Path, ("/bin", "/dev", "/etc", "/lib", "/proc", "/sbin", "/sys", "/usr")))
_EVERYWHERE = tuple(map(Path, ("/", "/opt", "/root", "/home", "/tmp", "/var/tmp")))  # noqa: S108
_LEAST_LETTERS = 2
_MODULE = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*(\.\*?)?")
_SUFFIX = re.compile(r"\*?\.\w{1,10}")


@dataclass(frozen=True)
class SourceFiles:
    """The content of a solution; `origin` is the folder that its names are relative to.

    `unread` are folders with too many Python files to count all, `elsewhere` paths that the solution names and that lie
    outside, `left_out` files beside those of the solution.
    """

    content: Content
    origin: Path
    unread: tuple[str, ...] = ()
    elsewhere: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    @property
    def lines(self) -> list[str]:
        """The files that make another batch when they are edited, and what is none of them, in words."""
        names = list(self.content.files)
        if not names:
            lines = [
                "No file of the solution is part of the keys: its command names none that is in a folder of its own."
            ]
        else:
            counted = "1 file of the solution is" if len(names) == 1 else f"{len(names)} files of the solution are"
            lines = [f"{counted} part of the keys: {_some(names)}"]
        if self.left_out:
            lines.append(
                f"Not part of it, and not there when it runs: {_some(self.left_out)}. "
                "What it needs of them is added by --source GLOB"
            )
        if self.elsewhere:
            lines.append(
                f"It names what is elsewhere, which stays as it is and counts for nothing: {_some(self.elsewhere)}"
            )
        lines += [
            f"{folder} holds too many files to look into the folders below it: put the solution into one of its own"
            for folder in self.unread
        ]
        return lines


def find(command: Sequence[str], folder: Path, globs: Sequence[str] = ()) -> SourceFiles:
    """Return the files of a solution whose command runs in `folder`; `globs` name more of them.

    Raises BenchbotError for a glob without a file, for a folder of more files than a solution has, and for a file that
    cannot be read.
    """
    try:
        return _Finder(Path(os.path.normpath(folder.absolute()))).find(command, globs)
    except OSError as error:
        raise BenchbotError(
            "A file of the solution cannot be read.",
            f"{error.filename}: {error.strerror}.",
            f"Make it readable; or, if it is none of the solution, name it in {folder / IGNORE_FILE}",
        ) from error


class _Finder:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.tree = SourceTree(folder)
        self.hashes: dict[Path, str] = {}
        self.elsewhere: dict[str, None] = {}
        self.unread: dict[str, None] = {}
        self._search = list(python_path(folder))
        self._used = set[Path]()
        self._is_relative = False
        self._left: list[tuple[Path, Mentions]] = []

    def find(self, command: Sequence[str], globs: Sequence[str]) -> SourceFiles:
        self._program(command[0])
        for flag, argument in pairwise(command):
            if flag not in ("-m", "-c"):
                self._word(argument)
            else:
                self.tree.roots.append(self.folder)
                named = Mentions((Import(0, argument), Import(0, f"{argument}.__main__")))
                self._left.append((self.folder / "-", named if flag == "-m" else mentions.of_python(argument)))
        for pattern in globs:
            found = [path for path in self.tree.glob(self.folder, pattern) if not self.tree.is_ignored(path)]
            if not found:
                raise BenchbotError(
                    f"--source {pattern} names no file.",
                    f"Nothing in {self.folder} is called so, but for what {IGNORE_FILE} names.",
                    "Name files of the solution, from where the command is typed: --source 'weights/*.pt'",
                )
            for path in found:
                self._add(path)
        while self._left:
            self._follow(*self._left.pop())
        return self._found()

    def _found(self) -> SourceFiles:
        used = [root for root in self._search if root in self._used]
        places = [*used, *(path.parent for path in self.hashes)]
        # Where nothing of the solution is, and no word leads from there, it does not matter where it is typed.
        matters = not places or self._is_relative or any(path.is_relative_to(self.folder) for path in places)
        origin = Path(os.path.commonpath([*places, *([self.folder] if matters else [])]))

        def name(path: Path) -> str:
            return path.relative_to(origin).as_posix()

        files = {name(path): self.hashes[path] for path in sorted(self.hashes)}
        executable = tuple(name(path) for path in sorted(self.hashes) if os.access(path, os.X_OK))
        folder = name(self.folder) if matters else ELSEWHERE
        content = Content(folder, files, executable, tuple(map(name, used)))
        near = dict.fromkeys([root for root in self.tree.roots if root not in self._search])
        beside = dict.fromkeys(
            path
            for root in near
            for path in self.tree.below(root, bounded=True)
            if path not in self.hashes and not path.name.startswith(".")
        )
        left_out = tuple(os.path.relpath(path, self.folder) for path in beside)
        return SourceFiles(content, origin, tuple(self.unread), tuple(self.elsewhere), left_out)

    def _program(self, word: str) -> None:
        """Take the program of the command: a file of the solution, or one that is installed and imports from it."""
        path = self.folder / word if os.sep in word else Path(shutil.which(word) or os.devnull)
        if not is_file(path):
            return
        if os.sep not in word or is_installed(path):
            self._search += [root for root in linked_folders(path.parent.parent) if root not in self._search]
            if is_python(path):
                self._left.append((path, mentions.of_python(path.read_bytes())))
        else:
            self._is_relative |= not Path(word).is_absolute()
            self._script(path)

    def _word(self, word: str) -> None:
        """Take what a word of the command names, perhaps after an option: `s.py`, `--weights=w.pt`, `maps/`."""
        for text in dict.fromkeys((word, word.partition("=")[2])):
            path = Path(os.path.normpath(self.folder / text))
            ours = exists(path) and not self.tree.is_ignored(path) and not is_installed(path)
            if text and not text.startswith("-") and ours:
                self._is_relative |= not Path(text).is_absolute()
                if path.is_file():
                    self._script(path)
                elif not self.folder.is_relative_to(path) and (path / "__main__.py").is_file():
                    self.tree.roots.append(path)
                    self._add(path)
                elif self.tree.is_within(path) and path != self.folder:
                    self._add(path)

    def _script(self, path: Path) -> None:
        path = Path(os.path.normpath(path))
        if path.suffix == ".py" or is_python(path):
            self.tree.roots.append(path.parent)
            if path.is_symlink():  # Python imports from beside what the link stands for
                self._search.insert(0, path.resolve().parent)
        elif path.parent == self.folder or self.tree.is_within(path):
            self.tree.roots.append(self.folder)
        self._add(path)

    def _add(self, path: Path) -> None:
        """Take a file, or all in a folder; what they mention is looked at later."""
        if path.is_dir():
            for inside in list(self.tree.below(path)):
                self._add(inside)
        elif path not in self.hashes and is_file(path):
            if path.suffix == ".py" or is_python(path):
                content = path.read_bytes()
                self.hashes[path] = sha256(content).hexdigest()
                self._left.append((path, mentions.of_python(content)))
            elif path.stat().st_size <= TEXT_BYTES or os.access(path, os.X_OK):
                content = path.read_bytes()
                self.hashes[path] = sha256(content).hexdigest()
                self._left.append((path, mentions.of_text(content)))
            else:
                with path.open("rb") as file:
                    self.hashes[path] = file_digest(file, "sha256").hexdigest()

    def _follow(self, path: Path, said: Mentions) -> None:
        for one in said.imports:
            self._import(path, one)
        for text in said.texts:
            self._text(path, text)
        if said.is_dynamic and self._is_local(path):
            root = next((root for root in reversed(self.tree.roots) if path.is_relative_to(root)), path.parent)
            self._any_module(root)

    def _import(self, path: Path, one: Import) -> None:
        parts = one.module.split(".") if one.module else []
        if one.level:
            starts = [path.parents[one.level - 1]] if one.level <= len(path.parents) else []
        else:
            starts = [*self.tree.roots, path.parent, *self._search]
            if parts[0] in packages_known() and not brings_own(starts, parts[0]):
                return
        for start in dict.fromkeys(starts):
            if self._module(start, parts, one.names):
                self._used.add(start)
                return

    def _module(self, start: Path, parts: Sequence[str], names: Sequence[str]) -> bool:
        """Take a module below a folder with its packages, and the modules among the names; say whether any is there."""
        package, found = start, list[Path]()
        for part in parts:
            found += module_files(package, part)
            package /= part
        if names and package.is_dir():
            found += [file for name in ("__init__", *names) for file in module_files(package, name)]
        for file in found:
            self._add(file)
        return bool(found)

    def _text(self, path: Path, text: str) -> None:
        """Take what a text names, if it is a path, a pattern, a module or the end of a name."""
        if text.startswith(("/", "~/")):
            named = Path(os.path.normpath(Path(text).expanduser()))
            system = named in _EVERYWHERE or any(named.is_relative_to(one) for one in _SYSTEM)
            # Nothing in a file can be led to the snapshot: what it names by an absolute path is read where it is.
            if exists(named) and not system and not is_installed(named):
                self.elsewhere[text] = None
            return
        if _MODULE.fullmatch(text) and "." in text:
            stem = text.rstrip(".*")
            self._import(path, Import(0, stem))
            if stem != text:
                for start in (*self.tree.roots, *self._search):
                    self._any_module(start.joinpath(*stem.split(".")))
        # A pattern such as `*_*.*` names everything, and so nothing.
        if text.strip("./*") == "" or ("*" in text and sum(map(str.isalnum, text)) < _LEAST_LETTERS):
            return
        if _SUFFIX.fullmatch(text) and not text.endswith(".py"):
            text = f"*{text.lstrip('*')}"
        for start in self._starts(path):
            if "*" in text:
                for found in self.tree.glob(start, text):
                    self._mentioned(found)
            else:
                self._mentioned(Path(os.path.normpath(start / text)))

    def _starts(self, path: Path) -> list[Path]:
        """Return the folders that a path in a file may be relative to: where it runs, its own, and those around."""
        around = [parent for parent in path.parents if self.tree.is_within(parent) or parent == path.parent]
        return list(dict.fromkeys((self.folder, *around))) if path.parent != self.folder else [self.folder]

    def _mentioned(self, path: Path) -> None:
        if not exists(path) or self.tree.is_ignored(path) or self.folder.is_relative_to(path) or is_passed_over(path):
            return
        # A module that is only called like something is imported, or it is none of the solution.
        if path.is_dir() and (path / "__init__.py").is_file():
            return
        self._add(path)

    def _any_module(self, root: Path) -> None:
        found = [path for path in self.tree.below(root, bounded=True) if path.suffix == ".py"] if root.is_dir() else []
        if len(found) > FILES_LIMIT or self.tree.is_too_large:
            self.unread[str(root)] = None
            found = [path for path in found if path.parent == root][:FILES_LIMIT]
        for path in found:
            self._add(path)

    def _is_local(self, path: Path) -> bool:
        return path.name == "-" or path in self.hashes


def _some(names: Iterable[str]) -> str:
    known = list(names)
    return ", ".join([*known[:_SHOWN], *([f"… {len(known) - _SHOWN} more"] if len(known) > _SHOWN else [])])
