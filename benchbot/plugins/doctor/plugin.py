"""Diagnosis of a machine and of real robots."""

from collections.abc import Iterator

from benchbot.plugin import Command, TuiScreen, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command."""
    yield Command(
        "doctor",
        "benchbot.plugins.doctor.command:doctor",
        "Find what is broken on this machine, and how to mend it.",
        takes_sources=True,
    )


@hookimpl
def benchbot_screens() -> Iterator[TuiScreen]:
    """Yield the screen."""
    yield TuiScreen(
        "robots and machine",
        "benchbot.plugins.doctor.screen:DoctorScreen",
        "What is broken on this machine or a robot, with its fix.",
        key="D",
    )
