"""Ctrl-C, and what else ends a command, in order and once."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import ExitCode


@contextmanager
def interruptible(said: str) -> Iterator[None]:
    """Let SIGINT, SIGTERM and SIGHUP end what is done within, in order; while it ends, further ones change nothing.

    Then exits with 130, after a note that says so.
    """
    with interrupting():
        try:
            yield
        except KeyboardInterrupt:
            console.note(f"Interrupted: {said}")
            raise typer.Exit(ExitCode.INTERRUPTED) from None


@contextmanager
def interrupting() -> Iterator[None]:
    """Raise KeyboardInterrupt within at the first SIGINT, SIGTERM or SIGHUP; further ones change nothing."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def interrupt(_number: int, _frame: object) -> None:
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = {number: signal.signal(number, interrupt) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
