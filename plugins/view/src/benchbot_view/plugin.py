"""The plug-in's hook: one command."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield `benchbot view`."""
    yield Command(
        "view",
        "benchbot_view.command:view",
        "Look at runs, batches and episodes in the browser.",
        takes_sources=True,
    )
