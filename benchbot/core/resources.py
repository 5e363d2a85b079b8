"""Folders of this machine: the user's cache, state and data, and files that plug-ins declare."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

YAML_SUFFIXES = (".yaml", ".yml")


def cache_dir() -> Path:
    """Return the folder for what may be computed again: `$BENCHBOT_CACHE_DIR` or the platform's own."""
    return _user_folder("BENCHBOT_CACHE_DIR", "user_cache_path")


def state_dir() -> Path:
    """Return the folder of run states, results and logs: `$BENCHBOT_STATE_DIR` or the platform's own."""
    return _user_folder("BENCHBOT_STATE_DIR", "user_state_path")


def data_dir() -> Path:
    """Return the folder of what the user has installed, such as asset packs: `$BENCHBOT_DATA_DIR` or the platform's."""
    return _user_folder("BENCHBOT_DATA_DIR", "user_data_path")


def _user_folder(variable: str, name: str) -> Path:
    override = os.environ.get(variable)
    if override:
        folder = Path(override).expanduser().absolute()
    else:
        import platformdirs

        folder = getattr(platformdirs, name)("benchbot", appauthor=False)
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise BenchbotError(
            f"The folder {folder} cannot be used.",
            f"{error.filename}: {error.strerror}",
            f"Make it writable for you, or name another one in the environment variable {variable}.",
        ) from error
    return folder


def declaration_files(
    sources: "Iterable[Traversable | Path]", suffixes: tuple[str, ...] = YAML_SUFFIXES
) -> Iterator[Path]:
    """Yield the files with one of `suffixes` among the sources, folders opened one level deep, sorted by name."""
    for source in sources:
        path = Path(str(source))
        if path.is_dir():
            yield from sorted(child for child in path.iterdir() if child.suffix in suffixes)
        else:
            yield path
