"""The supervisor: one run behind HTTP on loopback, its platform in a process that may die, its files and its end."""

from dataclasses import dataclass

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass


class RefusedError(BenchbotError):
    """A request that the supervisor does not carry out, with the HTTP status that says so."""

    def __init__(self, status: int, title: str, why: str, fix: str) -> None:
        super().__init__(title, why, fix)
        self.status = status


@dataclass(eq=False)
class Caller:
    """The client of one request, who waits for the answer until it has disconnected and is `gone`.

    Requests of one `solution` have the same token; those of clients that need none have an empty one. `process` is the
    number of the client's process, where it came through a unix socket.
    """

    solution: str = ""
    process: int | None = None
    gone: bool = False


def ended() -> BenchbotError:
    """Return the error of a request that arrives when the run is over."""
    return BenchbotError(
        "The run has ended.",
        "The supervisor is shutting down.",
        "Start another run: benchbot run …",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )
