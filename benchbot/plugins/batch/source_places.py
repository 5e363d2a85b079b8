"""Where the files of a solution may be: what Python imports from, and what gathers in such folders beside."""

import os
from collections.abc import Iterable, Iterator
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path

from benchbot.core import plugin_manager
from benchbot.core.provenance import is_file

PASSED_OVER = frozenset({"__pycache__", "node_modules", "site-packages"})


def python_path(folder: Path) -> Iterator[Path]:
    """Yield the folders of PYTHONPATH."""
    for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep):
        path = Path(os.path.normpath(folder / entry))
        if entry and path.is_dir():
            yield path


def linked_folders(environment: Path) -> Iterator[Path]:
    """Yield the folders in which an environment finds packages that are being developed (`pip install -e`)."""
    for settings in sorted(environment.glob("lib/python3*/site-packages/*.pth")):
        for line in settings.read_text("utf-8", "replace").splitlines():
            if line.startswith("/") and Path(line).is_dir():
                yield Path(os.path.normpath(line))


def packages_known() -> set[str]:
    """Return the packages whose content is in the provenance of every result anyway: BenchBot and its plug-ins."""
    modules = {info.module.partition(".")[0].partition(":")[0] for info in plugin_manager.installed()}
    return {"benchbot", "benchbot_addons", "benchbot_api", "benchbot_eval", *modules}


def brings_own(folders: Iterable[Path], name: str) -> bool:
    """Say whether the first package of a name in folders is not the installed one, such as BenchBot v2's client."""
    found, installed = [file for folder in folders for file in module_files(folder, name)], find_spec(name)
    return bool(found) and (not installed or found[0].resolve() != Path(installed.origin or "").resolve())


def module_files(package: Path, name: str) -> list[Path]:
    """Return the file of a module or package of this name in a folder, if it is there."""
    endings = (".py", *EXTENSION_SUFFIXES)
    candidates = (package / name / "__init__.py", *(package / f"{name}{ending}" for ending in endings))
    return [path for path in candidates if is_file(path)][:1]


def is_python(path: Path) -> bool:
    """Say whether a file without the ending is Python code, by its first line."""
    if path.suffix or not is_file(path):
        return path.suffix == ".py"
    with path.open("rb") as file:
        first = file.read(256).partition(b"\n")[0]
    return first.startswith(b"#!") and b"python" in first


def is_passed_over(folder: Path) -> bool:
    """Say whether a folder holds no files of a solution: caches, environments, and what batches have computed."""
    if folder.name.startswith(".") or folder.name in PASSED_OVER:
        return folder.is_dir()
    return (folder / "pyvenv.cfg").exists() or ((folder / "plan.json").exists() and (folder / "episodes").is_dir())


def is_installed(program: Path) -> bool:
    """Say whether a program belongs to the system or to an environment, and not to a solution."""
    environment = program.parent.parent
    marks = ("pyvenv.cfg", "conda-meta")
    inside = program.parent.name == "bin" and any((environment / mark).exists() for mark in marks)
    return inside or program.name.startswith("python") or program.is_relative_to("/usr")


def exists(path: Path) -> bool:
    """Say whether a path, perhaps a text that was never meant as one, is there."""
    try:
        return path.exists()
    except OSError:  # a text may be longer than a name of a file can be
        return False
