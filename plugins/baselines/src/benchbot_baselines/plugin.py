"""The plug-in's hooks: one command."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield `benchbot collect`."""
    yield Command("collect", "benchbot_baselines.command:collect", "Collect labelled pictures of generated places.")
