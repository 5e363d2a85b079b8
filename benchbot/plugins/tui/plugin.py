"""Screens in a terminal or a browser."""

from collections.abc import Iterator

from benchbot.plugin import Command, TuiScreen, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "tui",
        "benchbot.plugins.tui.command:tui",
        "Choose, start, watch, submit and browse on screens, in any terminal.",
    )


@hookimpl
def benchbot_screens() -> Iterator[TuiScreen]:
    """Yield the screen of settings."""
    yield TuiScreen(
        "settings",
        "benchbot.plugins.tui.settings_screen:SettingsScreen",
        "Colours, the package index, and where everything is kept.",
        key="S",
    )
