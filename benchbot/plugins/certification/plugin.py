"""Certificates of simulators."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "certify",
        "benchbot.plugins.certification.command:certify",
        "Say whether scores in a simulator can be compared with the reference's.",
    )
