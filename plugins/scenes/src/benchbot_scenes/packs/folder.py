"""The packs that users have installed: one folder each, in the user's data folder."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchbot.plugin import BenchbotError, data_dir, did_you_mean

CATALOGUE = "catalogue.json"


def installed() -> dict[str, Path]:
    """Return the packs that the user has installed: each name with its catalogue's file.

    None where there can be no data folder (benchbot doctor says why): that is no reason to fail for who wants no pack.
    """
    try:
        root = _root()
    except BenchbotError:
        return {}
    return {path.parent.name: path for path in sorted(root.glob(f"*/{CATALOGUE}")) if path.parent.name[0] != "."}


@contextmanager
def new(name: str) -> Iterator[Path]:
    """Yield an empty folder that becomes the pack's when all went well; nothing is left of it when not.

    Raises BenchbotError when the pack is there already.
    """
    final = _root() / name
    if final.exists():
        raise BenchbotError(
            f"The asset pack '{name}' is already installed.",
            f"It is in {final}.",
            f"To make it anew, remove it first: benchbot assets remove {name}",
        )
    _root().mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=_root(), prefix=f".{name}.", ignore_cleanup_errors=True) as folder:
        made = Path(folder) / name
        made.mkdir()
        yield made
        os.rename(made, final)  # noqa: PTH104


def remove(name: str) -> Path:
    """Remove a pack that the user has installed; returns where it was. Raises BenchbotError for any other."""
    packs = installed()
    if name not in packs:
        raise BenchbotError(
            f"'{name}' is not an asset pack that you have installed.",
            f"Those are: {', '.join(packs) or 'none'}.{did_you_mean(name, list(packs))}",
            "Packs that came with a distribution go with it: pip uninstall DISTRIBUTION (benchbot assets list).",
        )
    path = packs[name].parent
    shutil.rmtree(path)
    return path


def _root() -> Path:
    return data_dir() / "assets"
