"""Figures and pictures of results."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the commands."""
    yield Command(
        "draw",
        "benchbot.plugins.drawing.draw_command:draw",
        "Draw frames, map or way of results, as figures for a paper.",
        takes_sources=True,
    )
    yield Command(
        "picture",
        "benchbot.plugins.drawing.picture_command:picture",
        "Draw a result beside the truth, with its score.",
        takes_sources=True,
    )
