"""Diagnosis of a machine and of real robots."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "doctor",
        "benchbot.plugins.doctor.command:doctor",
        "Find what is broken on this machine, and how to mend it.",
        takes_sources=True,
    )
