"""What no solution may see: ground truths, where things stand in environments, and BenchBot's own folders."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from benchbot.core import plugin_manager, resources
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.resources import YAML_SUFFIXES, declaration_files
from benchbot.supervisor.recording.host import recorded_folders
from benchbot.wire import run_state

KINDS = {"ground_truths": (".json",), "environments": YAML_SUFFIXES, "episodes": (".json",)}
"""The kinds of declarations that tell a solution what it is to find out, and how their files end."""


def hidden_paths(catalog: Catalog, folder: Path) -> tuple[Path, ...]:
    """Return the files and folders, links resolved, to hide from a solution that runs in `folder`.

    Those are the folders of every ground truth, environment and list of episodes; the whole packages of distributions
    that bring environments or ground truths, unless the solution itself is a part of one; what environments name as
    files of theirs; the folders of the user's runs, results, caches and assets, and those of recordings, which may tell
    where the robot really is.
    """
    inside = folder.resolve()
    found = {resources.state_dir(), resources.cache_dir(), resources.data_dir()}
    found.update(path for run in run_state.live() for path in recorded_folders(Path(run.folder)) if path.is_dir())
    found.update(package for package in _packages(catalog) if not inside.is_relative_to(package.resolve()))
    found.update(_declared(catalog, [path.resolve() for path in found]))
    return tuple(sorted({path.resolve() for path in found}))


def _declared(catalog: Catalog, hidden: Sequence[Path]) -> Iterator[Path]:
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
                    # One that cannot be read is nobody's environment.
                    with suppress(BenchbotError):
                        yield from _files_named(schema.read(file), file.parent)


def _packages(catalog: Catalog) -> Iterator[Path]:
    sources = [source for kind in ("ground_truths", "environments") for source in catalog.plugins.sources(kind)]
    distributions = {source.distribution for source in sources if source.folder is None} - {"benchbot"}
    for info in plugin_manager.installed():
        if info.distribution in distributions:
            spec = find_spec(info.module.partition(":")[0].partition(".")[0])
            yield from map(Path, (spec.submodule_search_locations if spec else None) or ())


def _files_named(value: Any, folder: Path) -> Iterator[Path]:
    """Yield what exists of the paths that a declaration holds; they are relative to its folder."""
    if isinstance(value, str) and ("/" in value or "." in value) and "\0" not in value and len(value) < 1024:
        path = folder / value
        if value.strip("./") and path.exists():
            yield path
    elif isinstance(value, dict | list):
        items: Iterable[Any] = value.values() if isinstance(value, dict) else value
        for item in items:
            yield from _files_named(item, folder)
