"""`benchbot ready`: the operator confirms that they have done what the robot asked."""

from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.wire.run_state import RunState

ANSWER_TIMEOUT_S = 10.0


def ready(
    run: Annotated[
        str | None,
        typer.Option("--run", metavar="ID", help="The run that waits: a part of its name that no other has."),
    ] = None,
) -> None:
    """Say that you have done what a run asks you, such as carrying the robot to its start: the robot then moves on."""
    from dataclasses import replace

    from benchbot.api.client import Client
    from benchbot.wire import joining, run_state

    alive = run_state.live()
    waiting = [state for state in ([joining.named(run, alive)] if run else alive) if _waits(state)]
    if not waiting:
        raise BenchbotError(
            "No run waits for you.",
            "No run of this user has asked its operator for anything, or it has been confirmed already.",
            "Wait until one asks: its terminal says what is to be done.",
        )
    if len(waiting) > 1:
        raise BenchbotError(
            f"{len(waiting)} runs wait for you.",
            f"They are {'; '.join(state.about for state in waiting)}.",
            f"Name the one whose robot may move: benchbot ready --run {waiting[0].name}",
        )
    operator = Client(replace(waiting[0].connection, token=waiting[0].operator_token))
    console.note(f"Done: {operator.confirm()}")


def _waits(state: "RunState") -> bool:
    from benchbot.api.client import Client

    try:
        return Client(state.connection, ANSWER_TIMEOUT_S).session()["progress"]["waiting_for"] is not None
    except BenchbotError:
        return False  # a run that is just ending needs no confirmation
