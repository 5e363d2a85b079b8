"""Runs and batches that are alive: their feeds, the routes behind them, and the operator."""

from collections.abc import Iterator

from benchbot.plugin import Command, Routes, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "ready", "benchbot.plugins.watching.ready_command:ready", "Say that you have done what a real robot asked you."
    )


@hookimpl
def benchbot_routes() -> Iterator[Routes]:
    """Yield the routes of those who watch a run."""
    yield Routes("watching", "benchbot.plugins.watching.routes:routes")
