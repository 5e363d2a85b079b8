"""The plug-in's hooks. The libraries that read recordings are imported when there is one to read."""

from collections.abc import Iterator

from benchbot.plugin import Check, Command, DeclarationSource, Simulator, hookimpl, target
from benchbot_replay import source

PLUGIN_API = 1
"""The major version of benchbot.plugin that this was made for."""


@hookimpl
def benchbot_simulators() -> Iterator[Simulator]:
    """Yield what robots of type `replay` run on."""
    yield Simulator("replay", target("benchbot_replay.platform:ReplayedRobot"))


@hookimpl
def benchbot_declaration_sources() -> Iterator[DeclarationSource]:
    """Yield the recordings that `--recording` names."""
    yield DeclarationSource("recordings", source.folders, list, source.take_options, source.HELP)


@hookimpl
def benchbot_checks() -> Iterator[Check]:
    """Yield the check that a held solution does not see what is replayed."""
    yield Check("recordings", target("benchbot_replay.check:find"))


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield `benchbot replay`."""
    help_text = "Run a solution on what a robot has recorded, without driving anew."
    yield Command("replay", "benchbot_replay.command:app", help_text, takes_sources=True)
