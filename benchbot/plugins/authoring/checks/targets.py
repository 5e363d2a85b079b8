"""What there is to check in what a person names: a file, a folder, a plug-in's project or an installed plug-in."""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError, did_you_mean

SUFFIXES = (".yaml", ".yml", ".json")
_PASSED_OVER = {"build", "dist", "node_modules", "site-packages"}


@dataclass(frozen=True)
class Target:
    """A file to check. `kind` is set where that is known, `named` where the person named this very file."""

    path: Path
    named: bool = False
    kind: str | None = None


def targets(words: Iterable[str]) -> list[Target]:
    """Return the files that are meant, each once; raises BenchbotError for a word that means nothing."""
    found: dict[Path, Target] = {}
    for word in words:
        for target in _meant(word):
            path = target.path.absolute()
            if target.named or path not in found:
                found[path] = target
    return list(found.values())


def projects(words: Iterable[str]) -> list[Path]:
    """Return the named folders that are projects, those with a pyproject.toml; also where that file is named."""
    paths = (Path(word) for word in words)
    folders = (path.parent if path.name == "pyproject.toml" else path for path in paths)
    return [folder for folder in dict.fromkeys(folders) if (folder / "pyproject.toml").is_file()]


def _meant(word: str) -> Iterator[Target]:
    path = Path(word)
    if path.is_dir():
        found = sorted(_walk(path))
        if not found and not (path / "pyproject.toml").is_file():
            raise BenchbotError(
                f"There is nothing to check in {path}.",
                "The folder holds no .yaml, .yml or .json file.",
                "Name a file, or a folder that holds some.",
            )
        yield from map(Target, found)
    elif path.name == "pyproject.toml" and path.is_file():
        yield from _meant(str(path.parent))
    elif path.exists() or os.sep in word or path.suffix in SUFFIXES:
        yield Target(path, named=True)
    else:
        yield from _of_distribution(word)


def _walk(root: Path) -> Iterator[Path]:
    for name, folders, files in os.walk(root):
        folder = Path(name)
        # What examples and add-ons need beside their declarations is in folders whose names start with a dot.
        folders[:] = [
            child
            for child in folders
            if child not in _PASSED_OVER and not child.startswith(".") and not (folder / child / "pyvenv.cfg").exists()
        ]
        for child in files:
            if child.endswith(SUFFIXES) and not child.startswith(".") and (folder / child).is_file():
                yield folder / child


def _of_distribution(name: str) -> Iterator[Target]:
    from benchbot.core import plugin_manager
    from benchbot.core.declarations.catalog import KINDS
    from benchbot.core.resources import YAML_SUFFIXES, declaration_files

    installed = sorted({info.distribution for info in plugin_manager.installed()})
    if name not in installed:
        raise BenchbotError(
            f"There is no file, no folder and no installed plug-in '{name}'.",
            f"Installed plug-ins: {', '.join(installed)}.{_near(name, installed)}",
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
            yield Target(path, kind=kinds[kind])


def _near(name: str, installed: list[str]) -> str:
    here = [path.name for path in Path().iterdir()]
    return did_you_mean(name, [*installed, *here])
