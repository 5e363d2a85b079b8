"""The terminal: data on stdout, everything else on stderr, errors as title, why and fix; and Ctrl-C, in order."""

import errno
import os
import signal
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import typer

from benchbot.core.errors import BenchbotError, ExitCode


def data(text: str) -> None:
    """Print data on stdout; raises BenchbotError when it cannot take it (a full disk), never for a closed pipe."""
    try:
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader has seen enough (`benchbot list tasks | head -1`). Nothing may be flushed to it at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise BenchbotError(
            "Cannot write to the standard output.",
            error.strerror or errno.errorcode.get(error.errno or 0, "unknown reason"),
            "Free some disk space, or send the output elsewhere.",
            exit_code=ExitCode.INTERNAL,
        ) from error


def data_json(document: Any) -> None:
    """Print a document as JSON on stdout."""
    import json

    data(json.dumps(document, indent=2, ensure_ascii=False))


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print left-aligned columns on stdout; the header goes to stderr and only to a terminal, since it is not data."""
    lines = [tuple(header), *(tuple(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    texts = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]
    if sys.stdout.isatty():
        note(_styled("1", texts[0]))
    if texts[1:]:
        data("\n".join(texts[1:]))


def note(text: str = "") -> None:
    """Print a line for the person who watches, on stderr; a full disk, or nobody there, is no error."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def check_output(path: Path | None) -> None:
    """Raise BenchbotError when a file is not to be written to `path`: writing replaces what is there."""
    if path is not None and path.exists() and not (path.is_file() or path.is_dir()):
        raise BenchbotError(
            f"{path} is not a file.",
            "It is a device, a pipe or a socket, and would be replaced.",
            "Name a file; a path that does not exist yet is made.",
        )


def error(problem: BenchbotError, *, verbose: bool = False) -> None:
    """Print an error as title, why and fix, on stderr; `verbose` adds its traceback."""
    if verbose:
        _traceback(problem)
    lines = [_styled("1;31", "Error: ") + _styled("1", problem.title), ""]
    lines += [f"  {line}" for line in problem.why.splitlines()]
    fix, *more = problem.fix.splitlines() or [""]
    note("\n".join([*lines, "", f"  {_styled('32', 'Fix: ')}{fix}", *(f"{'':7}{line}" for line in more)]))


def internal_error(problem: Exception, *, verbose: bool = False) -> None:
    """Print what went wrong inside BenchBot and how to report it, on stderr; `verbose` adds the traceback."""
    error(
        BenchbotError(
            "Internal error: BenchBot itself failed.",
            f"{type(problem).__name__}: {problem}",
            "Run the command again with 'benchbot -v …' and report the traceback, with what 'benchbot doctor' prints.",
        )
    )
    if verbose:
        _traceback(problem)


@contextmanager
def interruptible(said: str) -> Iterator[None]:
    """Interrupt the block at the first SIGINT, SIGTERM or SIGHUP, then print `said` and exit with 130."""
    with interrupting():
        try:
            yield
        except KeyboardInterrupt:
            note(f"Interrupted: {said}")
            raise typer.Exit(ExitCode.INTERRUPTED) from None


@contextmanager
def interrupting() -> Iterator[None]:
    """Raise KeyboardInterrupt in the block at the first SIGINT, SIGTERM or SIGHUP; further ones are ignored."""
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


def _styled(code: str, text: str) -> str:
    coloured = sys.stderr.isatty() and "NO_COLOR" not in os.environ
    return f"\x1b[{code}m{text}\x1b[0m" if coloured else text


def _traceback(problem: Exception) -> None:
    import traceback

    note("".join(traceback.format_exception(problem)).rstrip())
