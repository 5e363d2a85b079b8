"""Plug-ins into an environment, and back out of it."""

from collections.abc import Iterator

from benchbot.plugin import Command, TuiScreen, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the commands."""
    yield Command(
        "install",
        "benchbot.plugins.installer.commands:install",
        "Install plug-ins, and undo it when they do not work.",
    )
    yield Command("uninstall", "benchbot.plugins.installer.commands:uninstall", "Uninstall plug-ins.")
    yield Command(
        "upgrade", "benchbot.plugins.installer.commands:upgrade", "Upgrade plug-ins to their newest versions."
    )
    yield Command(
        "plugins",
        "benchbot.plugins.installer.plugins_command:app",
        "List, show and search plug-ins; lock those of a project.",
    )


@hookimpl
def benchbot_screens() -> Iterator[TuiScreen]:
    """Yield the screen."""
    yield TuiScreen(
        "plug-ins",
        "benchbot.plugins.installer.screen:PluginsScreen",
        "Search, install, upgrade and uninstall plug-ins.",
        key="P",
    )
