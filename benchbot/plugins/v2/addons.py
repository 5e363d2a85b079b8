"""Add-on folders of BenchBot v2: where they are, and the folders in them that hold declarations.

Named by `--addons FOLDER` or the environment variable `BENCHBOT_ADDONS`, which the back end's processes inherit; or
installed into the environment by `benchbot install`.
"""

import os
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.resources import declaration_files
from benchbot.plugins.v2.code import Code

VARIABLE = "BENCHBOT_ADDONS"
KINDS = (
    "batches",
    "environments",
    "episodes",
    "evaluation_methods",
    "examples",
    "formats",
    "ground_truths",
    "robots",
    "tasks",
)
_SKIPPED = {".git", "__pycache__"}


@dataclass(frozen=True)
class Addon:
    """A folder with v2's add-ons, one or many: its type folders may be anywhere in the tree."""

    root: Path
    folders: tuple[Path, ...]

    @property
    def name(self) -> str:
        """The name in results: the last two folders, which for v2's own add-ons are `user/repository`."""
        return "/".join(self.root.parts[-2:]).lstrip("/")

    def sources(self, kind: str) -> list[Path]:
        """Return the folders that declare things of a kind (`tasks`, `formats`, …)."""
        return [folder for folder in self.folders if _kind(folder) == kind]

    @cached_property
    def code(self) -> Code:
        """The Python files, and the declarations that name functions in them, as they are at first use."""
        python = (path for path in _walk(self.root) if path.suffix == ".py")
        named = [folder for folder in self.folders if folder.name in ("formats", "evaluation_methods")]
        naming = declaration_files(named)
        return Code.read(self.root, [*python, *naming])

    def content_hash(self) -> str:
        """Return the SHA-256 over the names and bytes of all its files."""
        digest = sha256()
        for path in sorted(_walk(self.root)):
            digest.update(f"{path.relative_to(self.root).as_posix()}\0".encode())
            digest.update(path.read_bytes())
        return digest.hexdigest()


def installed_folder() -> Path:
    """Return the folder of the add-ons that `benchbot install` has put into this environment; it may not be there."""
    return Path(sys.prefix, "share", "benchbot", "addons")


def find(path: Path) -> Addon:
    """Return the add-ons in a folder; raises BenchbotError when there are none."""
    root = path.expanduser().absolute()
    if not root.is_dir():
        raise BenchbotError(
            f"There are no add-ons in {path}.",
            "It is a file." if root.exists() else "There is no such folder.",
            "Name a folder that holds add-ons of BenchBot v2: --addons FOLDER",
        )
    folders = [Path(folder) for folder, _, _ in os.walk(root) if not _SKIPPED & set(Path(folder).parts)]
    declaring = tuple(sorted(folder for folder in folders if _declares(folder, root)))
    if not declaring:
        near = "".join(dict.fromkeys(did_you_mean(folder.name, list(KINDS)) for folder in folders))
        raise BenchbotError(
            f"There are no add-ons in {path}.",
            f"None of its folders is called {', '.join(KINDS[:-1])} or {KINDS[-1]}.{near}",
            "Name the folder above these, or rename its folders.",
        )
    return Addon(root, declaring)


def from_environment() -> list[Addon]:
    """Return the add-ons that `BENCHBOT_ADDONS` names, and those installed; raises BenchbotError for a folder without.

    `BENCHBOT_PLUGINS=user/repository` restricts the installed ones as it does plug-ins.
    """
    wanted = os.environ.get("BENCHBOT_PLUGINS")
    chosen = [path for name, path in installed().items() if wanted is None or name in wanted.split(",")]
    return [find(path) for path in dict.fromkeys([*_named(), *chosen])]


def installed() -> dict[str, Path]:
    """Return the folders of installed add-ons by name, `user/repository`."""
    root = installed_folder()
    found = sorted(path for path in root.glob("[!.]*/[!.]*") if path.is_dir())
    return {path.relative_to(root).as_posix(): path for path in found}


def use(paths: Iterable[Path]) -> None:
    """Add folders to `BENCHBOT_ADDONS` for this process and those that it starts."""
    wanted = [*_named(), *(path.expanduser().absolute() for path in paths)]
    os.environ[VARIABLE] = os.pathsep.join(dict.fromkeys(map(str, wanted)))


def _named() -> list[Path]:
    names = filter(None, os.environ.get(VARIABLE, "").split(os.pathsep))
    return list(dict.fromkeys(Path(name).expanduser().absolute() for name in names))


def _declares(folder: Path, root: Path) -> bool:
    # Folders whose names start with a dot hold requirements of an add-on, not declarations.
    hidden = any(part.startswith(".") for part in folder.relative_to(root).parts)
    return _kind(folder) in KINDS and not hidden


def _kind(folder: Path) -> str:
    """Return the kind of what a folder declares. Lists of episodes may be in folders of their tasks' names."""
    return folder.parent.name if folder.parent.name == "episodes" else folder.name


def _walk(root: Path) -> Iterator[Path]:
    for folder, subfolders, names in os.walk(root):
        subfolders[:] = [name for name in subfolders if name not in _SKIPPED]
        yield from (path for path in (Path(folder, name) for name in names) if path.is_file())
