"""Errors that have an HTTP status of their own."""

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass


class RefusedError(BenchbotError):
    """A request that the supervisor does not carry out, with the HTTP status that says so."""

    def __init__(self, status: int, title: str, why: str, fix: str) -> None:
        super().__init__(title, why, fix)
        self.status = status


def status_of(error: BenchbotError) -> int:
    """Return the HTTP status of an error: 503 for the platform, 500 for what is not the client's fault, else 400."""
    if isinstance(error, RefusedError):
        return error.status
    if error.failure is FailureClass.PLATFORM:
        return 503
    return 500 if error.exit_code is ExitCode.INTERNAL else 400
