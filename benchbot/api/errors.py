"""BenchbotErrors that are also what BenchBot v2 raised, for solutions that catch those."""

from collections.abc import Iterator
from contextlib import contextmanager

from benchbot.core.errors import BenchbotError, FailureClass


class WrongValueError(BenchbotError, ValueError):
    """Something that a solution passed cannot be used: an action that is unavailable, an agent that is none."""


class WrongMomentError(BenchbotError, RuntimeError):
    """Something that a solution asked for is impossible as things stand."""


@contextmanager
def raised_as(kind: type[BenchbotError]) -> Iterator[None]:
    """Raise a BenchbotError that the solution has brought about as `kind`, others as they are."""
    try:
        yield
    except BenchbotError as error:
        if error.failure not in (FailureClass.AGENT, FailureClass.COLLISION):
            raise
        raise kind(
            error.title,
            error.why,
            error.fix,
            exit_code=error.exit_code,
            failure=error.failure,
            ends_run=error.ends_run,
        ) from error
