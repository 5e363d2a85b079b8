"""What a recorder in the box says when a file cannot be written."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass


@contextmanager
def told(what: str, folder: Path) -> Iterator[None]:
    """Raise BenchbotError for an OSError within; `what` are the things in `folder`, in the plural."""
    try:
        yield
    except OSError as error:
        raise BenchbotError(
            f"The {what} in {folder} cannot be written.",
            f"{error.strerror or error}.",
            "Make room, or record into a folder on a disk that has some and that you may write to.",
            exit_code=ExitCode.INTERNAL,
            failure=FailureClass.INFRASTRUCTURE,
        ) from error
