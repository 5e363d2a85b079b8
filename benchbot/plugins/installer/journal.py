"""The way back: what a change of an environment replaces is kept beside it until the change has proved itself.

Before anything changes, the journal holds every file that will be replaced or removed (linked where the disk allows
it, else copied) and the paths of all that will come. To undo needs no network, may be broken off and done again, and is
done at the next start when the process that changed the environment is gone.
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
from benchbot.plugins.installer.distributions import Distribution, placed
from benchbot.plugins.installer.environment import Environment

_PAGE = "journal.json"
# What pip puts aside while it removes a distribution, and uv while it writes one.
_LEFTOVERS = ("~", ".tmp")


@dataclass(frozen=True)
class Journal:
    """The journal of one environment; there is at most one change at a time."""

    environment: Environment

    @property
    def folder(self) -> Path:
        """The folder of the change under way."""
        return self.environment.own / "journal"

    def open(self, what: str, going: Iterable[Distribution], coming: Iterable[Distribution]) -> None:
        """Keep what will be replaced, before the first change. Raises BenchbotError when that is impossible."""
        prefix, site = self.environment.prefix, self.environment.site
        leaving = {path for distribution in going for path in _installed_files(distribution)}
        arriving = {target for one in coming for path in one.files for target in _targets(site, prefix, path)}
        arriving |= {prefix / "bin" / name for distribution in coming for name in distribution.scripts}
        kept = sorted(path for path in leaving | arriving if path.is_file() or path.is_symlink())
        try:
            _start_afresh(self.folder.with_name("journal.new"))
            new = self.folder.with_name("journal.new")
            for number, path in enumerate(kept):
                _keep(path, new / str(number))
            page: dict[str, Any] = {
                "what": what,
                "kept": [str(path.relative_to(prefix)) for path in kept],
                "coming": sorted(str(path.relative_to(prefix)) for path in arriving - set(kept)),
                "new_folders": sorted(str(folder.relative_to(prefix)) for folder in _missing(arriving)),
                "watched": sorted(str(folder.relative_to(prefix)) for folder in {site, *_above(kept, prefix)}),
                "not_ours": [],
            }
            page["not_ours"] = sorted(map(str, _put_aside(prefix, page["watched"])))
            atomic.write(new / _PAGE, json.dumps(page).encode())
            new.rename(self.folder)
        except OSError as error:
            shutil.rmtree(self.folder.with_name("journal.new"), ignore_errors=True)
            raise BenchbotError(
                "The way back cannot be kept, so nothing was changed.",
                f"{self.folder}: {error.strerror or error}.",
                "Free some disk space, and see that the environment is yours to write.",
            ) from error

    def close(self) -> None:
        """The change has proved itself: forget the way back."""
        done = self.folder.with_name("journal.done")
        shutil.rmtree(done, ignore_errors=True)
        self.folder.rename(done)
        shutil.rmtree(done, ignore_errors=True)

    def left_over(self) -> str | None:
        """Return what a process that is gone was about to do, or None."""
        page = self._page()
        return None if page is None else str(page["what"])

    def undo(self) -> None:
        """Put the environment back to what it was; returns at once when no change is open.

        Raises BenchbotError for what cannot be put back; the journal then stays, to try again.
        """
        page = self._page()
        if page is None:
            return
        try:
            self._undo(page)
        except OSError as error:
            raise BenchbotError(
                "The environment could not be put back to what it was.",
                f"{error.filename or self.folder}: {error.strerror or error}.",
                "Mend that, then run any 'benchbot install' again: it goes on where this one stopped.",
                exit_code=ExitCode.INTERNAL,
            ) from error
        self.close()

    def _undo(self, page: dict[str, Any]) -> None:
        prefix = self.environment.prefix
        for name in page["new_folders"]:
            _remove(prefix / name)
        for name in page["coming"]:
            (prefix / name).unlink(missing_ok=True)
        for path in _put_aside(prefix, page["watched"]):
            if str(path) not in page["not_ours"]:
                _remove(path)
        for number, name in enumerate(page["kept"]):
            _put_back(self.folder / str(number), prefix / name)

    def _page(self) -> dict[str, Any] | None:
        try:
            page = json.loads((self.folder / _PAGE).read_text("utf-8"))
        except FileNotFoundError:
            return None
        except (OSError, ValueError) as error:
            raise BenchbotError(
                "The journal of a change that was broken off cannot be read.",
                f"{self.folder}: {error}.",
                "Make the environment anew; nothing says any more what it was.",
                exit_code=ExitCode.INTERNAL,
            ) from error
        return dict(page)


def _installed_files(distribution: Distribution) -> set[Path]:
    listed = {_resolved(distribution.info.parent / path) for path in distribution.files}
    return listed | {path for path in distribution.info.rglob("*") if path.is_file()}


def _targets(site: Path, prefix: Path, path: str) -> set[Path]:
    """Return where a file of an unpacked distribution may go: commands, data and headers are not among the packages."""
    place = placed(path)
    first = place.partition("/")[0]
    found = set() if path.startswith("../") else {site / place}
    if first not in ("bin", "share", "etc", "include"):
        return found or {prefix / place}
    return found | {prefix / place, prefix / "include" / "site" / "x"}


def _above(kept: Iterable[Path], prefix: Path) -> set[Path]:
    return {folder for path in kept for folder in path.parents if folder.is_relative_to(prefix) and folder != prefix}


def _put_aside(prefix: Path, watched: Iterable[str]) -> list[Path]:
    folders = (prefix / name for name in watched)
    return [
        entry
        for folder in folders
        if folder.is_dir()
        for entry in folder.iterdir()
        if entry.name.startswith(_LEFTOVERS)
    ]


def _resolved(path: Path) -> Path:
    # Without following links: what is to be kept is the link.
    return Path(os.path.normpath(path))


def _missing(paths: Iterable[Path]) -> set[Path]:
    """Return the topmost folders that are not there yet and that files will bring."""
    found = set()
    for path in paths:
        missing = [folder for folder in path.parents if not folder.exists()]
        if missing:
            found.add(missing[-1])
    return found


def _start_afresh(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)


def _keep(path: Path, keeper: Path) -> None:
    try:
        keeper.hardlink_to(path) if not path.is_symlink() else _copy(path, keeper)
    except OSError:
        _copy(path, keeper)


def _copy(path: Path, to: Path) -> None:
    shutil.copy2(path, to, follow_symlinks=False)


def _put_back(keeper: Path, path: Path) -> None:
    if path.exists() and not path.is_symlink() and path.samefile(keeper):
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    _keep(keeper, path)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
