"""The rollback journal: all that a change of an environment replaces is kept beside it until the change is complete.

Before anything changes, the journal holds every file that will be replaced or removed (a hard link where possible,
else a copy) and the paths of all new files. Undoing a change needs no network, can be interrupted and repeated, and is
done by the next command when the process that changed the environment is gone.
"""

import json
import os
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.installer.distributions import Distribution, without_parents
from benchbot.plugins.installer.environment import Environment

_FILE = "journal.json"
# Names of pip's temporary files while it removes a distribution, and of uv's while it writes one.
_TEMPORARY_PREFIXES = ("~", ".tmp")


@dataclass(frozen=True)
class Journal:
    """The journal of one environment, in which at most one change is open."""

    environment: Environment

    @property
    def folder(self) -> Path:
        """The folder of the open change."""
        return self.environment.own / "journal"

    def open(self, command: str, leaving: Iterable[Distribution], coming: Iterable[Distribution]) -> None:
        """Keep all files that a change will replace, before it begins; raises BenchbotError when that is impossible.

        `coming` are unpacked distributions.
        """
        prefix, site = self.environment.prefix, self.environment.site
        new = self.folder.with_name("journal.new")
        try:
            removed = {path for one in leaving for path in _installed_files(one)}
            added = {target for one in coming for path in one.files for target in _targets(site, prefix, path)}
            added |= {prefix / "bin" / name for one in coming for name in one.scripts}
            kept = sorted(path for path in removed | added if path.is_file() or path.is_symlink())
            parents = {folder for path in kept for folder in path.parents if prefix in folder.parents}
            entry: dict[str, Any] = {
                "what": command,
                "kept": [str(path.relative_to(prefix)) for path in kept],
                "coming": _relative(added - set(kept), prefix),
                "new_folders": _relative(_missing_folders(added), prefix),
                "watched": _relative({site, *parents}, prefix),
            }
            entry["not_ours"] = sorted(map(str, _temporary_files(prefix, entry["watched"])))
            shutil.rmtree(new, ignore_errors=True)
            new.mkdir(parents=True)
            for number, path in enumerate(kept):
                _link_or_copy(path, new / str(number))
            atomic.write(new / _FILE, json.dumps(entry).encode())
            new.rename(self.folder)
        except OSError as error:
            shutil.rmtree(new, ignore_errors=True)
            raise BenchbotError(
                "The way back cannot be kept, so nothing was changed.",
                f"{self.folder}: {error.strerror or error}.",
                "Free some disk space, and see that the environment is yours to write.",
            ) from error

    def close(self) -> None:
        """Delete the journal of a change that is complete or undone."""
        done = self.folder.with_name("journal.done")
        shutil.rmtree(done, ignore_errors=True)
        self.folder.rename(done)
        shutil.rmtree(done, ignore_errors=True)

    def unfinished(self) -> str | None:
        """Return the command whose change is open, or None."""
        entry = self._read()
        return None if entry is None else str(entry["what"])

    def undo(self) -> None:
        """Restore the environment to its state before the open change, if there is one.

        Raises BenchbotError for files that cannot be restored; the journal is then kept, to try again.
        """
        entry = self._read()
        if entry is None:
            return
        prefix = self.environment.prefix
        try:
            for name in entry["new_folders"]:
                _remove(prefix / name)
            for name in entry["coming"]:
                (prefix / name).unlink(missing_ok=True)
            for path in _temporary_files(prefix, entry["watched"]):
                if str(path) not in entry["not_ours"]:
                    _remove(path)
            for number, name in enumerate(entry["kept"]):
                _restore(self.folder / str(number), prefix / name)
        except OSError as error:
            raise BenchbotError(
                "The environment could not be put back to what it was.",
                f"{error.filename or self.folder}: {error.strerror or error}.",
                "Mend that, then run any 'benchbot install' again: it goes on where this one stopped.",
                exit_code=ExitCode.INTERNAL,
            ) from error
        self.close()

    def _read(self) -> dict[str, Any] | None:
        try:
            return dict(json.loads((self.folder / _FILE).read_text("utf-8")))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            raise BenchbotError(
                "The journal of a change that was broken off cannot be read.",
                f"{self.folder}: {error}.",
                "Make the environment anew; nothing says any more what it was.",
                exit_code=ExitCode.INTERNAL,
            ) from error


def _installed_files(distribution: Distribution) -> set[Path]:
    # normpath does not follow links: what is to be kept is the link.
    listed = {Path(os.path.normpath(distribution.info.parent / path)) for path in distribution.files}
    return listed | {path for path in distribution.info.rglob("*") if path.is_file()}


def _targets(site: Path, prefix: Path, path: str) -> set[Path]:
    """Return the paths that a file of an unpacked distribution may be installed to.

    Commands, data and headers go below the prefix instead of the site.
    """
    place = without_parents(path)
    found = set() if path.startswith("../") else {site / place}
    if place.partition("/")[0] not in ("bin", "share", "etc", "include"):
        return found or {prefix / place}
    return found | {prefix / place, prefix / "include" / "site" / "x"}


def _relative(paths: Iterable[Path], prefix: Path) -> list[str]:
    return sorted(str(path.relative_to(prefix)) for path in paths)


def _temporary_files(prefix: Path, folders: Iterable[str]) -> list[Path]:
    existing = (prefix / name for name in folders if (prefix / name).is_dir())
    return [path for folder in existing for path in folder.iterdir() if path.name.startswith(_TEMPORARY_PREFIXES)]


def _missing_folders(paths: Iterable[Path]) -> set[Path]:
    """Return the topmost folders that do not exist yet and that files will need."""
    found = set()
    for path in paths:
        missing = [folder for folder in path.parents if not folder.exists()]
        found |= {*missing[-1:]}
    return found


def _link_or_copy(path: Path, target: Path) -> None:
    try:
        if path.is_symlink():
            shutil.copy2(path, target, follow_symlinks=False)
        else:
            target.hardlink_to(path)
    except OSError:
        shutil.copy2(path, target, follow_symlinks=False)


def _restore(kept: Path, path: Path) -> None:
    if path.exists() and not path.is_symlink() and path.samefile(kept):
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    _link_or_copy(kept, path)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
