"""The folders that are written to: recordings, results, and BenchBot's own."""

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchbot.cli.kit.preflight import Intent
from benchbot.core import resources
from benchbot.plugin import BenchbotError, Catalog, Finding, Level


def recorders(catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield whether each recorder is installed and can write."""
    for name, folder in intent.record.items():
        try:
            catalog.plugins.record("recorders", name)
        except BenchbotError as error:
            yield Finding(Level.BROKEN, error.title, error.why, error.fix)
            continue
        why = _unwritable(folder)
        if why is not None:
            title = f"The recorder '{name}' cannot write into {folder}."
            yield Finding(Level.BROKEN, title, why, f"Name another folder: --record {name}=FOLDER")
        else:
            yield Finding(Level.OK, "recorder", f"{name}, into {folder}")


def room(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield whether each folder can be written to, and has room."""
    own = (resources.state_dir(), Path(tempfile.gettempdir()))
    for folder in dict.fromkeys([*intent.folders, *own]):
        why = _unwritable(folder)
        if why is not None:
            yield Finding(
                Level.BROKEN, f"Nothing can be written into {folder}.", why, "Name another, or make it writable."
            )
            continue
        free = shutil.disk_usage(_existing(folder)).free
        needed = f"{intent.free_bytes >> 20} MiB are needed"
        if free < intent.free_bytes:
            title = f"There is no room in {folder}."
            yield Finding(Level.BROKEN, title, f"{free >> 20} MiB are free, {needed}.", "Free some disk space.")
        else:
            yield Finding(Level.OK, "disk", f"{folder}: {free / 2**30:.1f} GiB free")


def _unwritable(folder: Path) -> str | None:
    """Return why nothing can be written into a folder that is there or is to be made; None when it can be."""
    place = _existing(folder)
    if not place.is_dir():
        return f"{place} is not a folder."
    try:
        with tempfile.TemporaryFile(dir=place):
            return None
    except OSError as error:
        return f"{place}: {error.strerror}."


def _existing(path: Path) -> Path:
    """Return the nearest of a path and its parents that is there."""
    path = path.absolute()
    return next(place for place in (path, *path.parents) if place.exists())
