"""Checks of files before they are used: declarations, documents, projects of plug-ins."""

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import KINDS, Catalog
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.findings import Problem
from benchbot.core.resources import YAML_SUFFIXES, declaration_files
from benchbot.plugins.authoring.checks import project
from benchbot.plugins.authoring.checks.documents import SUFFIXES, CheckTarget, Document, examine
from benchbot.plugins.authoring.checks.references import KnownNames, taken_names, unknown_names

_IGNORED_FOLDERS = {"build", "dist", "node_modules", "site-packages"}


@dataclass(frozen=True)
class Report:
    """The problems that were found, the number of checked files, and those in named folders that declare nothing."""

    problems: list[Problem]
    files: int
    left_out: list[Path]


def check_all(words: Sequence[str], kind: str | None = None) -> Report:
    """Check files, folders, projects or installed plug-ins, all as a `kind` if one is given.

    Problems come in the order of the files, those of one file in the order of its lines. Raises BenchbotError for a
    word that names nothing.
    """
    catalog = Catalog(plugin_manager.load())
    targets = _targets(words)
    found: list[Problem] = []
    readable: list[Document] = []
    left_out: list[Path] = []
    for target in targets:
        examined = examine(target, kind, catalog)
        if isinstance(examined, Problem):
            found.append(examined)
        elif examined is None:
            left_out.append(target.path)
        else:
            readable.append(examined)
    projects = [project.examine(folder, readable) for folder in _project_folders(words)]
    found += [problem for examined in projects for problem in examined.problems]
    names = KnownNames(catalog, readable, {text for examined in projects for text in examined.texts})
    for document in readable:
        found += [*document.problems, *unknown_names(document, names)]
    found += taken_names(readable, names, {examined.name for examined in projects})
    paths = [*(examined.folder / "pyproject.toml" for examined in projects), *(target.path for target in targets)]
    order = {path: number for number, path in enumerate(paths)}
    found.sort(key=lambda problem: (order.get(problem.path, 0), problem.line or 0))
    return Report(found, len(targets) - len(left_out) + len(projects), left_out)


def _targets(words: Iterable[str]) -> list[CheckTarget]:
    """Return the named files, each once; raises BenchbotError for a word that names nothing."""
    found: dict[Path, CheckTarget] = {}
    for word in words:
        for target in _named(word):
            path = target.path.absolute()
            if target.named or path not in found:
                found[path] = target
    return list(found.values())


def _project_folders(words: Iterable[str]) -> list[Path]:
    """Return the named folders that are projects, those with a pyproject.toml; also where that file is named."""
    paths = (Path(word) for word in words)
    folders = (path.parent if path.name == "pyproject.toml" else path for path in paths)
    return [folder for folder in dict.fromkeys(folders) if (folder / "pyproject.toml").is_file()]


def _named(word: str) -> Iterator[CheckTarget]:
    path = Path(word)
    if path.is_dir():
        found = sorted(_walk(path))
        if not found and not (path / "pyproject.toml").is_file():
            raise BenchbotError(
                f"There is nothing to check in {path}.",
                "The folder holds no .yaml, .yml or .json file.",
                "Name a file, or a folder that holds some.",
            )
        yield from map(CheckTarget, found)
    elif path.name == "pyproject.toml" and path.is_file():
        yield from _named(str(path.parent))
    elif path.exists() or os.sep in word or path.suffix in SUFFIXES:
        yield CheckTarget(path, named=True)
    else:
        yield from _files_of_distribution(word)


def _walk(root: Path) -> Iterator[Path]:
    for name, folders, files in os.walk(root):
        folder = Path(name)
        # Examples and add-ons keep what they need beside their declarations in folders whose names start with a dot.
        folders[:] = [
            child
            for child in folders
            if child not in _IGNORED_FOLDERS
            and not child.startswith(".")
            and not (folder / child / "pyvenv.cfg").exists()
        ]
        for child in files:
            if child.endswith(SUFFIXES) and not child.startswith(".") and (folder / child).is_file():
                yield folder / child


def _files_of_distribution(name: str) -> Iterator[CheckTarget]:
    installed = sorted({info.distribution for info in plugin_manager.installed()})
    if name not in installed:
        here = [path.name for path in Path().iterdir()]
        raise BenchbotError(
            f"There is no file, no folder and no installed plug-in '{name}'.",
            f"Installed plug-ins: {', '.join(installed)}.{did_you_mean(name, [*installed, *here])}",
            "Name a file or folder that exists, or the distribution of a plug-in: benchbot plugins list",
        )
    loaded = plugin_manager.load()
    kinds = {**KINDS, "ground_truths": "ground_truth"}
    sources = {kind: [source for source in loaded.sources(kind) if source.distribution == name] for kind in kinds}
    for broken in loaded.broken:
        if broken.info.distribution == name:
            raise BenchbotError(
                f"The plug-in '{name}' cannot be loaded.",
                f"{broken.cause}.",
                f"Mend it, or install it again: pip install --force-reinstall {name}",
            )
    for kind, declared in sources.items():
        suffixes = (".json",) if kind in ("episodes", "ground_truths") else YAML_SUFFIXES
        for path in declaration_files((source.value for source in declared), suffixes):
            yield CheckTarget(path, kind=kinds[kind])
