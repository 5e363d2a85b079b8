"""Certificates of simulators."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "certify",
        "benchbot.plugins.certification.command:certify",
        "Say how far a simulator's scores are from the reference's.",
    )
