"""Screens in a terminal or a browser."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "tui",
        "benchbot.plugins.tui.command:tui",
        "Choose, start, watch, submit and browse on screens, in any terminal.",
    )
