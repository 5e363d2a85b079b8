"""`benchbot stop`: the end of a run, and the emergency stop of a real robot."""

import os
import signal
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError, FailureClass

if TYPE_CHECKING:
    from benchbot.wire.run_state import Connection, RunState

ANSWER_TIMEOUT_S = 2.0


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
    stop. What a batch has started goes on.
    """
    from concurrent.futures import ThreadPoolExecutor

    from benchbot.wire import joining
    from benchbot.wire.run_state import RUN, SUBMIT, live

    alive, there = live(), joining.given()
    if every or run is not None:
        ending = alive if run is None else [joining.named(run, alive)]
    elif there is not None:
        ending = [state for state in alive if state.connection == there]
    else:
        ending = [state for state in alive if state.owner in (RUN, SUBMIT)][:1]
    if not ending and there is None and alive:
        raise BenchbotError(
            "No run of yours is there to stop.",
            f"What is alive belongs to something else: {'; '.join(state.about for state in alive)}.",
            f"End that (of a batch: benchbot batch cancel FOLDER), one of them (benchbot stop --run {alive[0].name}), "
            "or all at once: benchbot stop --all",
        )
    wanted: list[tuple[Connection, RunState | None]] = [(state.connection, state) for state in ending]
    if not wanted:
        wanted = [(there or joining.chosen().connection, None)]
    # All at once: none waits for another one that hangs.
    with ThreadPoolExecutor(len(wanted)) as executor:
        outcomes = list(executor.map(lambda each: _end(*each), wanted))
    for outcome in outcomes:
        if isinstance(outcome, str):
            console.note(outcome)
    left = [state for state in alive if state not in ending]
    for line in dict.fromkeys(state.about if state.owner in (RUN, SUBMIT) else state.owner for state in left):
        console.note(f"It goes on: {line}")
    for outcome in outcomes:
        if isinstance(outcome, BenchbotError):
            raise outcome


def _end(connection: "Connection", state: "RunState | None") -> str | BenchbotError:
    """End a run, by force when it does not answer; return what was done, or why it could not be."""
    from benchbot.api.client import Client
    from benchbot.wire.run_state import live

    where = connection.url or connection.socket
    what = f"The back end at {where}" if state is None else f"The run {state.about},"
    # With the solution's token it would be the solution that stops.
    ours = connection if state is None else replace(connection, token=state.operator_token)
    client = Client(ours, ANSWER_TIMEOUT_S)
    began_s = time.monotonic()
    try:
        client.stop()
    except BenchbotError as error:
        if state is None or error.failure is not FailureClass.INFRASTRUCTURE:
            return error
        # Only one that is still alive, as its lock says: by now its number may be another process's.
        while connection in [run.connection for run in live()]:
            if time.monotonic() - began_s >= ANSWER_TIMEOUT_S:
                # The platform's process ends with the supervisor, however that one ends.
                os.kill(state.pid, signal.SIGKILL)
                return f"{what} did not answer, and was killed."
            time.sleep(0.05)  # one that is ending answers no more
        return f"{what} has ended."
    finally:
        client.close()
    return f"{what} is ending."
