"""The plug-in's hooks: a command, and an example that sees."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.plugin import Command, hookimpl

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield `benchbot collect`."""
    yield Command("collect", "benchbot_baselines.command:collect", "Collect labelled pictures of generated places.")


@hookimpl
def benchbot_examples() -> Iterator[Path]:
    """Yield a semantic mapper that needs no segmentation sensor."""
    yield Path(__file__).parent / "examples"
