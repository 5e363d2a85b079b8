"""The plug-in's hooks: tasks, and examples that solve them."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""

_FOLDER = Path(__file__).parent


@hookimpl
def benchbot_tasks() -> Iterator[Path]:
    """Yield semantic SLAM and scene change detection, with and without a perfect segmentation sensor."""
    yield _FOLDER / "tasks"


@hookimpl
def benchbot_examples() -> Iterator[Path]:
    """Yield a semantic mapper, an explorer and a finder of changes."""
    yield _FOLDER / "examples"
