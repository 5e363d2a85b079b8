"""The plug-in's hooks: environments, ground truths and batches."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""

_FOLDER = Path(__file__).parent


@hookimpl
def benchbot_environments() -> Iterator[Path]:
    """Yield the folder of the environments' declarations."""
    yield _FOLDER / "environments"


@hookimpl
def benchbot_ground_truths() -> Iterator[Path]:
    """Yield the folder of the environments' ground truths."""
    yield _FOLDER / "ground_truths"


@hookimpl
def benchbot_batches() -> Iterator[Path]:
    """Yield the folder of the batches: BEAR's lists of environments to develop with and to be challenged by."""
    yield _FOLDER / "batches"
