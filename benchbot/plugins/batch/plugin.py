"""Batches: many episodes, computed by workers that may die, in a folder that is the truth."""

from collections.abc import Iterator

from benchbot.plugin import Check, Command, TuiScreen, hookimpl, target


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "batch",
        "benchbot.plugins.batch.command:app",
        "Compute many episodes: robots, environments, seeds, settings; resumable.",
        takes_sources=True,
    )


@hookimpl
def benchbot_screens() -> Iterator[TuiScreen]:
    """Yield the screen."""
    yield TuiScreen(
        "new batch",
        "benchbot.plugins.batch.screen:NewBatchScreen",
        "Solutions × robots × environments × seeds: size, time, start.",
        key="B",
    )


@hookimpl
def benchbot_checks() -> Iterator[Check]:
    """Yield whether there is the executor."""
    yield Check("executor", target("benchbot.plugins.batch.worker_pool:check"))
