"""`benchbot stop`: the end of a run, and the emergency stop of a real robot."""

from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError


def stop(
    every: Annotated[
        bool,
        typer.Option("--all", help="End every back end of this user, also those of batches, which then start others."),
    ] = False,
    run: Annotated[
        str | None,
        typer.Option("--run", metavar="ID", help="End this one: its robot, or a part of its own name."),
    ] = None,
) -> None:
    """End the newest run or submission, as Ctrl-C in its terminal would, in the middle of an action too: the emergency
    stop. What a batch has started goes on. `benchbot-stop` does the same.
    """
    from benchbot import emergency_stop

    try:
        console.note(*emergency_stop.stop(every=every, run=run, by="benchbot stop"))
    except emergency_stop.CannotStopError as error:
        raise BenchbotError(error.title, error.why, error.fix) from error
