"""`benchbot stop`: the end of a run, and the emergency stop of a real robot."""

import os
import signal
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError, FailureClass

if TYPE_CHECKING:
    from benchbot.wire.run_state import Connection, RunState

ANSWER_TIMEOUT_S = 2.0


def stop(
    every: Annotated[bool, typer.Option("--all", help="End every run of this user, not only the newest.")] = False,
) -> None:
    """End the newest run, as Ctrl-C in its terminal would, in the middle of an action too: the emergency stop."""
    from concurrent.futures import ThreadPoolExecutor

    from benchbot.wire.run_state import find, live

    runs = {state.connection: state for state in live()}
    wanted = list(runs) if every and runs else [find()]
    # All at once: none waits for another one that hangs.
    with ThreadPoolExecutor(len(wanted)) as executor:
        outcomes = list(executor.map(lambda connection: _end(connection, runs.get(connection)), wanted))
    for outcome in outcomes:
        if isinstance(outcome, str):
            console.note(outcome)
    for outcome in outcomes:
        if isinstance(outcome, BenchbotError):
            raise outcome


def _end(connection: "Connection", state: "RunState | None") -> str | BenchbotError:
    """End a run, by force when it does not answer; return what was done, or why it could not be."""
    from benchbot.api.client import Client
    from benchbot.wire.run_state import live

    where = connection.url or connection.socket
    # With the solution's token it would be the solution that stops.
    ours = connection if state is None else replace(connection, token=state.operator_token)
    client = Client(ours, ANSWER_TIMEOUT_S)
    try:
        client.stop()
    except BenchbotError as error:
        # Only one that is still alive, as its lock says: by now its number may be another process's.
        hangs = error.failure is FailureClass.INFRASTRUCTURE and connection in [run.connection for run in live()]
        if state is None or not hangs:
            return error
        # The platform's process ends with the supervisor, however that one ends.
        os.kill(state.pid, signal.SIGKILL)
        return f"The back end at {where} did not answer, and was killed."
    finally:
        client.close()
    return f"The back end at {where} is ending."
