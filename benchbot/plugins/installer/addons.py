"""Folders of BenchBot v2's add-ons, installed: copied into the environment, where they are found without `--addons`."""

import json
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.checking import check, problems_in
from benchbot.plugins.installer.plan import Action, Change
from benchbot.plugins.installer.sources import Folder
from benchbot.plugins.v2 import addons, trust

_NOT_COPIED = (".git", "__pycache__")


@dataclass(frozen=True)
class Place:
    """Where an add-on is installed, and the file beside it that says where it came from."""

    name: str

    @property
    def folder(self) -> Path:
        """The installed copy."""
        return addons.installed_folder() / self.name

    @property
    def note(self) -> Path:
        """`{"from": …, "revision": …}`."""
        return self.folder.with_name(f".{self.folder.name}.json")

    @property
    def aside(self) -> Path:
        """Where the copy that is being replaced waits."""
        return self.folder.with_name(f".{self.folder.name}.old")

    @property
    def new(self) -> Path:
        """Where a copy is made before it is put into place."""
        return self.folder.with_name(f".{self.folder.name}.new")


def name_of(folder: Path) -> str:
    """Return what an add-on is called, as v2 does: `user/repository`, the last two folders of its path."""
    return "/".join(folder.parts[-2:]).lstrip("/")


def change_of(folder: Folder) -> Change | None:
    """Return what installing a folder would change, or None when it is there as it is."""
    addon = addons.find(folder.path)
    wrong = problems_in(folder.path)
    if wrong:
        raise BenchbotError(
            f"The add-ons in {folder.origin} are not sound, so nothing was changed.",
            "\n".join(wrong[:6]),
            "Mend them, or report this to their author: benchbot check FOLDER",
        )
    name = name_of(folder.path)
    digest = addon.content_hash()
    old = digest_of(name)
    if old == digest:
        return None
    code = tuple(path.relative_to(folder.path).as_posix() for path in addon.code.files if path.suffix == ".py")
    action = Action.ADD if old is None else Action.REPLACE
    versions = (None if old is None else old[:12], digest[:12])
    brings = "code" if code else "declarations"
    return Change(name, action, "add-on", *versions, brings, code[:6], digest, folder.origin)


def digest_of(name: str) -> str | None:
    """Return the hash over all files of an installed add-on, or None when there is no such."""
    folder = addons.installed().get(name)
    return None if folder is None else addons.find(folder).content_hash()


@contextmanager
def placing(folders: Sequence[Folder], *, trusted: bool) -> Iterator[None]:
    """Copy folders into the environment, to stay there if what is done within succeeds; else they are as before.

    It is checked that no name in them is somebody else's. `trusted` lets their code run, until it changes.
    """
    places = [Place(name_of(folder.path)) for folder in folders]
    new = [place for place in places if not place.folder.exists()]
    try:
        for folder, place in zip(folders, places, strict=True):
            _put(folder, place)
        if folders:
            check([])
        yield
        for folder, place in zip(folders, places, strict=True):
            _settle(folder, place)
    except BaseException:
        for place in new:
            place.note.unlink(missing_ok=True)
        for place in places:
            undo(place)
        raise
    for place in places:
        _clear(place.aside)
        if trusted:
            trust.remember(addons.find(place.folder))


def _put(folder: Folder, place: Place) -> None:
    try:
        place.folder.parent.mkdir(parents=True, exist_ok=True)
        _clear(place.new)
        # Links are followed, so that the copy needs nothing but itself.
        shutil.copytree(folder.path, place.new, ignore=shutil.ignore_patterns(*_NOT_COPIED))
        if place.folder.exists():
            place.folder.rename(place.aside)
        place.new.rename(place.folder)
    except OSError as error:
        raise BenchbotError(
            f"The add-ons of {folder.origin} cannot be copied.",
            f"{error.filename}: {error.strerror or error}.",
            "See that there is room, and that the environment is yours to write.",
        ) from error


def _settle(folder: Folder, place: Place) -> None:
    note = {"from": folder.origin, **({"revision": folder.revision} if folder.revision else {})}
    atomic.write(place.note, json.dumps(note).encode())


def undo(place: Place) -> None:
    """Put back what was there before, whenever placing was broken off."""
    _clear(place.new)
    if place.aside.exists():
        _clear(place.folder)
        place.aside.rename(place.folder)
    elif not place.note.exists():
        _clear(place.folder)
    for folder in (*place.folder.parents,)[:4]:  # user, addons, benchbot, share
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()


def recover() -> None:
    """Undo what a process that is gone had begun."""
    for path in addons.installed_folder().glob("*/.*.old"):
        undo(_place_of(path, ".old"))
    for path in addons.installed_folder().glob("*/.*.new"):
        undo(_place_of(path, ".new"))
    for name in addons.installed():
        undo(Place(name))


def remove(name: str) -> None:
    """Remove an installed add-on."""
    place = Place(name)
    place.note.unlink(missing_ok=True)
    undo(place)


def origin_of(name: str) -> str:
    """Return where an installed add-on came from."""
    try:
        return str(json.loads(Place(name).note.read_text("utf-8"))["from"])
    except (OSError, ValueError, KeyError, TypeError):
        return "unknown"


def _place_of(path: Path, ending: str) -> Place:
    return Place(f"{path.parent.name}/{path.name.removeprefix('.').removesuffix(ending)}")


def _clear(path: Path) -> None:
    if path.exists():
        shutil.rmtree(path)
