"""Bundles: results with what made them in one file, made again elsewhere, or replayed."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the commands."""
    yield Command(
        "bundle",
        "benchbot.plugins.bundles.bundle_command:bundle",
        "Make one file of results and their solution, for others to repeat.",
        takes_sources=True,
    )
    yield Command(
        "pack",
        "benchbot.plugins.bundles.solution_archive:pack",
        "Pack a solution's folder for others to build and run, as BenchBot v2 does.",
    )
    yield Command(
        "reproduce",
        "benchbot.plugins.bundles.reproduce_command:reproduce",
        "Run a bundle's solution again: does the same come of it?",
        takes_sources=True,
    )
    yield Command(
        "verify",
        "benchbot.plugins.bundles.verify_command:verify",
        "Replay results in the simulator: is it what they say?",
        takes_sources=True,
    )
