"""The supervisor: one run behind HTTP on loopback, its platform in a process that may die, its files and its end."""

from benchbot.core.errors import BenchbotError


class RefusedError(BenchbotError):
    """A request that the supervisor does not carry out, with the HTTP status that says so."""

    def __init__(self, status: int, title: str, why: str, fix: str) -> None:
        super().__init__(title, why, fix)
        self.status = status
