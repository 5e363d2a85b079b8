"""Folders of BenchBot v2's add-ons, copied into the environment, where they are found without `--addons`."""

import json
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchbot.core import atomic, resources
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import KINDS
from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.plan import Action, Change
from benchbot.plugins.installer.post_install_check import check
from benchbot.plugins.installer.sources import AddonFolder
from benchbot.plugins.v2 import addons, trust

_NOT_COPIED = (".git", "__pycache__")


def _folder(name: str) -> Path:
    return addons.installed_folder() / name


def _beside(folder: Path, suffix: str) -> Path:
    """Return a path beside an installed add-on.

    `json`: a note of its origin, `{"from": …, "revision": …}`; `old`: the copy that is being replaced; `new`: the copy
    that is not complete yet.
    """
    return folder.with_name(f".{folder.name}.{suffix}")


def change_of(folder: AddonFolder) -> Change | None:
    """Return the change that installing a folder would make, or None when it is installed with the same content.

    Raises BenchbotError when declarations in it are not valid.
    """
    addon = addons.find(folder.path)
    problems = _problems(addon)
    if problems:
        raise BenchbotError(
            f"The add-ons in {folder.origin} are not sound, so nothing was changed.",
            "\n".join(problems[:6]),
            "Mend them, or report this to their author: benchbot check FOLDER",
        )
    new, old = addon.content_hash(), digest_of(addon.name)
    if old == new:
        return None
    code = python_files(addon)
    action = Action.ADD if old is None else Action.REPLACE
    versions = (None if old is None else old[:12], new[:12])
    brings = "code" if code else "declarations"
    return Change(addon.name, action, "add-on", *versions, brings, tuple(code[:6]), new, folder.origin)


def _problems(addon: addons.Addon) -> list[str]:
    found = []
    for kind, noun in {**KINDS, "evaluation_methods": "evaluation_method"}.items():
        for path in resources.declaration_files(addon.sources(kind)):
            try:
                found += [str(problem) for problem in schema.problems(schema.read(path), noun, path)]
            except BenchbotError as error:
                found.append(error.title)
    return [text.replace(f"{addon.root}{os.sep}", "") for text in found]


def python_files(addon: addons.Addon) -> list[str]:
    """Return the paths of an add-on's Python files, relative to its folder."""
    return [path.relative_to(addon.root).as_posix() for path in addon.code.files if path.suffix == ".py"]


def digest_of(name: str) -> str | None:
    """Return the hash over all files of an installed add-on, or None when it is not installed."""
    folder = addons.installed().get(name)
    return None if folder is None else addons.find(folder).content_hash()


@contextmanager
def installing(folders: Sequence[AddonFolder], *, trusted: bool) -> Iterator[None]:
    """Copy folders into the environment; the copies are removed again if the body of the `with` statement fails.

    Raises BenchbotError when a name in them is already taken. `trusted` lets their code run, until it changes.
    """
    pairs = [(folder, _folder(addons.find(folder.path).name)) for folder in folders]
    added = [target for _, target in pairs if not target.exists()]
    try:
        for folder, target in pairs:
            _copy(folder, target)
        if folders:
            check([])
        yield
        for folder, target in pairs:
            note = {"from": folder.origin, **({"revision": folder.revision} if folder.revision else {})}
            atomic.write(_beside(target, "json"), json.dumps(note).encode())
    except BaseException:
        for target in added:
            _beside(target, "json").unlink(missing_ok=True)
        for _, target in pairs:
            _undo(target)
        raise
    for _, target in pairs:
        _delete(_beside(target, "old"))
        if trusted:
            trust.remember(addons.find(target))


def _copy(folder: AddonFolder, target: Path) -> None:
    new = _beside(target, "new")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _delete(new)
        # Links are followed, so that the copy depends on no other files.
        shutil.copytree(folder.path, new, ignore=shutil.ignore_patterns(*_NOT_COPIED))
        if target.exists():
            target.rename(_beside(target, "old"))
        new.rename(target)
    except OSError as error:
        raise BenchbotError(
            f"The add-ons of {folder.origin} cannot be copied.",
            f"{error.filename}: {error.strerror or error}.",
            "See that there is room, and that the environment is yours to write.",
        ) from error


def _undo(target: Path) -> None:
    """Restore the previous copy, or remove one that has no note, at whichever point its installation ended."""
    old = _beside(target, "old")
    _delete(_beside(target, "new"))
    if old.exists():
        _delete(target)
        old.rename(target)
    elif not _beside(target, "json").exists():
        _delete(target)
    for folder in (*target.parents,)[:4]:  # user, addons, benchbot, share
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()


def recover() -> None:
    """Undo installations that a process which is gone has begun."""
    for suffix in (".old", ".new"):
        for path in addons.installed_folder().glob(f"*/.*{suffix}"):
            _undo(path.with_name(path.name.removeprefix(".").removesuffix(suffix)))
    for name in addons.installed():
        _undo(_folder(name))


def remove(name: str) -> None:
    """Remove an installed add-on."""
    _beside(_folder(name), "json").unlink(missing_ok=True)
    _undo(_folder(name))


def origin_of(name: str) -> str:
    """Return the path or address that an installed add-on came from."""
    try:
        return str(json.loads(_beside(_folder(name), "json").read_text("utf-8"))["from"])
    except (OSError, ValueError, KeyError, TypeError):
        return "unknown"


def _delete(folder: Path) -> None:
    if folder.exists():
        shutil.rmtree(folder)
