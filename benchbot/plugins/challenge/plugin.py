"""Challenges."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the commands."""
    yield Command(
        "challenge",
        "benchbot.plugins.challenge.command:app",
        "Run a challenge, or take part in one: submissions, queue, leaderboard.",
        takes_sources=True,
    )
    yield Command("key", "benchbot.plugins.challenge.key_command:app", "Keys that submissions are signed with.")
