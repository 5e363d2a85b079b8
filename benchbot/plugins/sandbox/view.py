"""The view of the file system that a sandboxed solution has: the paths that are shown, and those hidden in them.

Hidden are ground truths, the positions of objects in environments, the code and models that places are made of, and
BenchBot's own folders.
"""

import glob
import os
import shutil
import sys
from collections.abc import Iterable, Iterator, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from benchbot.core import entry_points, resources
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import GROUP, Plugins
from benchbot.core.provenance import is_file
from benchbot.core.resources import YAML_SUFFIXES, declaration_files
from benchbot.submission.solution import CODE
from benchbot.supervisor.recording.host import recorded_folders
from benchbot.wire import run_state
from benchbot.wire.run_state import Connection

SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/libx32")
SETTINGS = ("ld.so.cache", "localtime", "timezone", "alternatives", "fonts", "ssl", "ca-certificates", "mime.types")
LINKS = 40
KINDS = {"ground_truths": (".json",), "environments": YAML_SUFFIXES, "episodes": (".json",)}
"""The kinds of declarations that tell a solution what it is to find out, and how their files end."""

MAKES_PLACES = ("asset_packs", "environment_sets", "simulators")
"""The kinds of records of a plug-in by which a solution could work out what it is to find out."""


@dataclass(frozen=True)
class View:
    """Paths that are shown, read-only, and paths that are hidden within them; all absolute, as the solution sees them.

    `links` are symbolic links and what they name; `searched` are folders in which Python looks for some that are shown.
    """

    shown: tuple[Path, ...]
    hidden: tuple[Path, ...]
    links: tuple[tuple[Path, str], ...]
    searched: tuple[Path, ...]


def view_of(command: Sequence[str], folder: Path, path: str, readable: Iterable[Path], hidden: Sequence[Path]) -> View:
    """Return the view of a command that runs in `folder`, with programs looked up on `path`.

    That is the system's programs and libraries, the interpreter and its packages, the folder and the files that the
    command names, and `readable`; nothing that is `hidden` (paths without links). Raises BenchbotError when the folder
    holds the home folder, or is hidden itself.
    """
    folder = folder.absolute()
    _check_folder(folder, hidden)
    system = [Path(name) for name in SYSTEM]
    links = [(path, str(path.readlink())) for path in system if path.is_symlink()]
    shown = [path for path in system if path.is_dir() and not path.is_symlink()]
    shown += [path for path in (Path("/etc", name) for name in SETTINGS) if path.exists()]
    program = shutil.which(command[0], path=path)
    wanted = [
        *(_around(Path(sys.executable).resolve())),
        *(() if program is None else _around((folder / program).absolute())),
        *(path.absolute() for path in readable),
        *(named for named in (folder / word for word in command) if named.is_absolute() and is_file(named)),
        folder,
    ]
    linked = [package for prefix in wanted for package in _linked_packages(prefix)]
    for one in (*wanted, *linked):
        real = one.resolve()
        for seen in dict.fromkeys((one, real)):
            if not any(real.is_relative_to(path) for path in hidden) and not any(
                seen.is_relative_to(other) for other in shown
            ):
                shown.append(seen)
    searched = dict.fromkeys(package.parent for package in linked)
    return View(tuple(shown), tuple(_within(shown, hidden)), tuple(links), tuple(searched))


def _check_folder(folder: Path, hidden: Sequence[Path]) -> None:
    real = folder.resolve()
    if Path.home().resolve().is_relative_to(real):
        raise BenchbotError(
            "The sandbox would not keep the solution from what is yours.",
            f"It may read the folder that it runs in, {folder}, and that holds your home folder.",
            "Put the solution into a folder of its own and submit it from there.",
        )
    for path in hidden:
        if real.is_relative_to(path):
            raise BenchbotError(
                "The solution cannot see itself.",
                f"Its folder {folder} is in {path}, which is hidden from solutions: there is ground truth in it, "
                "or it is BenchBot's own.",
                "Put the solution into a folder of its own and submit it from there.",
            )


def _around(program: Path) -> Iterator[Path]:
    """Yield the prefixes that a program, and each target of its links, is installed in; else the program itself."""
    for _ in range(LINKS):
        prefix = program.parent.parent
        if program.parent.name == "bin" and not _is_too_much(prefix):
            yield prefix
            base = _base_of(prefix)
            if base is not None:
                yield base
        else:
            yield program
        if not program.is_symlink():
            return
        program = Path(os.path.normpath(program.parent / program.readlink()))


def _base_of(prefix: Path) -> Path | None:
    """Return the installation that a virtual environment was made from (PEP 405)."""
    settings = prefix / "pyvenv.cfg"
    if not settings.is_file():
        return None
    for line in settings.read_text("utf-8", "replace").splitlines():
        key, _, value = line.partition("=")
        home = Path(value.strip())
        if key.strip() == "home" and home.is_absolute() and not _is_too_much(home.parent):
            return home.parent
    return None


def _is_too_much(prefix: Path) -> bool:
    return Path.home().is_relative_to(prefix) or Path.home().resolve().is_relative_to(prefix.resolve())


def _linked_packages(prefix: Path) -> Iterator[Path]:
    """Yield the packages and modules that are installed in a prefix as mere links to where they are developed."""
    for settings in prefix.glob("lib/python3*/site-packages/*.pth"):
        for line in settings.read_text("utf-8", "replace").splitlines():
            root = Path(line.strip())
            if root.is_absolute() and root.is_dir():
                yield from (path.parent for path in root.glob("*/__init__.py"))
                yield from root.glob("*.py")


def _within(shown: Sequence[Path], hidden: Sequence[Path]) -> Iterator[Path]:
    """Yield the hidden paths as they would be seen; the outermost of each."""
    found = [
        seen / path.relative_to(real)
        for seen, real in ((seen, seen.resolve()) for seen in shown)
        for path in hidden
        if path.is_relative_to(real) and path.exists()
    ]
    for path in sorted(set(found)):
        if not any(path != other and path.is_relative_to(other) for other in found):
            yield path


def hidden_paths(
    catalog: Catalog, folder: Path, readable: Iterable[Path] = (), connection: Connection | None = None
) -> tuple[Path, ...]:
    """Return the files and folders, links resolved, to hide from a solution that runs in `folder`.

    Those are the folders of every ground truth, environment and list of episodes; files that environments name; the
    folders of the user's runs, results, caches and assets, and those of recordings, which may hold the true pose of
    the robot. And, unless the solution or Python is in it or a `readable` path names it: the whole package of every
    installed plug-in that is neither for solutions nor named by the task of the run at `connection`, and the whole
    folder of add-ons with places.
    """
    named = [path.resolve() for path in (folder, Path(sys.prefix), *readable)]
    tasks = {run.task for run in run_state.live() if run.connection == connection} & catalog.pool("tasks").keys()
    shown = {name for task in tasks for name in catalog.get("tasks", task).data.get("readable", ())}
    found = {resources.state_dir(), resources.cache_dir(), resources.data_dir()}
    found.update(path for run in run_state.live() for path in recorded_folders(Path(run.folder)) if path.is_dir())
    wholes = (path.resolve() for path in (*_packages(catalog.plugins, shown, named[0]), *_addons(catalog.plugins)))
    found.update(path for path in wholes if not any(one.is_relative_to(path) for one in named))
    found.update(_declared_paths(catalog, [path.resolve() for path in found]))
    return tuple(sorted({path.resolve() for path in found}))


def _declared_paths(catalog: Catalog, hidden: Sequence[Path]) -> Iterator[Path]:
    """Yield the declared files and folders, and those that environments name, unless they are in hidden packages."""
    for kind, suffixes in KINDS.items():
        for source in catalog.plugins.sources(kind):
            path = Path(str(source.value))
            if any(path.resolve().is_relative_to(other) for other in hidden):
                continue
            yield path
            for file in declaration_files([path], suffixes):
                yield file
                if kind == "environments":
                    # A declaration that cannot be read is not in use.
                    with suppress(BenchbotError):
                        yield from _named_files(schema.read(file), file.parent)


def _packages(plugins: Plugins, shown: Set[str], folder: Path) -> Iterator[Path]:
    """Yield the packages of installed plug-ins, used or not, but BenchBot's own, those `shown` and those for solutions.

    A plug-in is for solutions when it declares tasks or examples and nothing of places: what it has besides is theirs
    to import. A package in the solution's `folder` is none that is installed, though Python may find it first.
    """
    offers = {source.distribution for kind in ("tasks", "examples") for source in plugins.sources(kind)}
    places = {source.distribution for kind in KINDS for source in plugins.sources(kind)}
    places.update(record.distribution for kind in MAKES_PLACES for record in plugins.pool(kind).values())
    for point in entry_points.find(GROUP):
        if point.distribution not in {"benchbot", *shown, *(offers - places)}:
            name = point.value.partition(":")[0].partition(".")[0]
            for spec in (find_spec(name), *(PathFinder.find_spec(name, [place]) for place in sys.path)):
                paths = map(Path, (spec.submodule_search_locations or filter(None, [spec.origin])) if spec else ())
                yield from (path for path in paths if path.parent.resolve() != folder)


def _addons(plugins: Plugins) -> Iterator[Path]:
    """Yield the folders of add-ons with places, and what is named after them beside, such as archives of them."""
    for root in {source.folder.root for kind in KINDS for source in plugins.sources(kind) if source.folder}:
        yield root
        yield from root.parent.glob(f"{glob.escape(root.name)}.*")


def _named_files(value: Any, folder: Path) -> Iterator[Path]:
    """Yield what exists of the paths that a declaration holds; they are relative to its folder."""
    if isinstance(value, str) and ("/" in value or "." in value) and "\0" not in value and len(value) < 1024:
        path = folder / value
        if value.strip("./") and path.exists():
            yield path
    elif isinstance(value, dict | list):
        items: Iterable[Any] = value.values() if isinstance(value, dict) else value
        for item in items:
            yield from _named_files(item, folder)


def code_needed() -> tuple[Path, ...]:
    """Return the files and folders of BenchBot that an init process needs."""
    package = CODE / "benchbot"
    inner = package / "submission"
    return package / "__init__.py", inner / "__init__.py", inner / "init"
