"""`benchbot ready`: the operator confirms that they have done what the robot asked."""

from benchbot.cli.kit import console

ANSWER_TIMEOUT_S = 10.0


def ready() -> None:
    """Say that you have done what a run asks you, such as carrying the robot to its start: the robot then moves on."""
    from dataclasses import replace

    from benchbot.api.client import Client
    from benchbot.core.errors import BenchbotError
    from benchbot.wire import run_state

    for state in run_state.live():
        try:
            request = Client(state.connection, ANSWER_TIMEOUT_S).session()["progress"]["waiting_for"]
        except BenchbotError:
            continue  # a run that is just ending needs no confirmation
        if request is not None:
            operator = replace(state.connection, token=state.operator_token)
            console.note(f"Done: {Client(operator, ANSWER_TIMEOUT_S).confirm()}")
            return
    raise BenchbotError(
        "No run waits for you.",
        "No run of this user has asked its operator for anything, or it has been confirmed already.",
        "Wait until one asks: its terminal says what is to be done.",
    )
