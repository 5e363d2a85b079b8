"""What this distribution offers to BenchBot."""

from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable

from benchbot import hookimpl


@hookimpl
def benchbot_environments() -> Iterator[Traversable]:
    """Yield the folder of the environments' declarations."""
    yield files("benchbot_envs_bear") / "environments"


@hookimpl
def benchbot_ground_truths() -> Iterator[Traversable]:
    """Yield the folder of the environments' ground truths."""
    yield files("benchbot_envs_bear") / "ground_truths"
