"""A measured room: its environments for everybody, their ground truths for evaluation only."""

from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable

from benchbot.plugin import hookimpl


@hookimpl
def benchbot_environments() -> Iterator[Traversable]:
    """Yield the folder of the environments."""
    yield files(__name__) / "environments"


@hookimpl
def benchbot_ground_truths() -> Iterator[Traversable]:
    """Yield the folder of the ground truths."""
    yield files(__name__) / "ground_truths"
