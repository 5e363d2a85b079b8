"""The formats of object maps and of their ground truths."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import hookimpl


@hookimpl
def benchbot_formats() -> Iterator[Path]:
    """Yield the formats beside this file."""
    yield Path(__file__).parent
