"""The executor `local`: the workers of a batch as processes of this machine."""

from collections.abc import Iterator

from benchbot.plugin import Executor, hookimpl, target

_WORKERS = "benchbot.plugins.local_executor.workers"


@hookimpl
def benchbot_executors() -> Iterator[Executor]:
    """Yield the executor."""
    yield Executor("local", target(f"{_WORKERS}:launch"), target(f"{_WORKERS}:attach"), "Processes of this machine.")
