"""The terminal: data on stdout, everything else on stderr, errors as title, why and fix; and Ctrl-C, in order.

Whatever is printed may hold foreign text, which cannot command the terminal, nor begin a line of its own.
"""

import errno
import math
import os
import shutil
import signal
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.cli.kit.solution_output import folded
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.text import one_line, visible

if TYPE_CHECKING:
    from benchbot.core.findings import Finding

_QUOTED = "  | "


def escape_unprintable() -> None:
    """Have stdout show a character that its encoding lacks as an escape, as Python has stderr do."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def data(*lines: str) -> None:
    """Print data on stdout, each argument as one line; raises as `document` does."""
    document("\n".join(map(one_line, lines)))


def document(text: str) -> None:
    """Print a whole text on stdout, as it is but for what commands a terminal.

    Raises BenchbotError when stdout cannot take it (a full disk), never for a closed pipe.
    """
    try:
        sys.stdout.write(f"{visible(text)}\n")
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


def data_json(content: Any) -> None:
    """Print a document as JSON on stdout, in escapes of its own where stdout is not in UTF-8."""
    import json

    document(json.dumps(content, indent=2, ensure_ascii=(sys.stdout.encoding or "").lower() != "utf-8"))


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print left-aligned columns on stdout; the header goes to stderr and only to a terminal, since it is not data."""
    lines = [tuple(map(one_line, line)) for line in (header, *rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    texts = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]
    if sys.stdout.isatty():
        _tell(_styled("1", texts[0]))
    if texts[1:]:
        data(*texts[1:])


def note(*lines: str) -> None:
    """Print lines for the person who watches, on stderr, each argument as one, or an empty one.

    A full disk, or nobody there, is no error.
    """
    _tell("\n".join(map(one_line, lines)))


def findings(found: "Iterable[Finding]", *, tell_all: bool = False) -> None:
    """Print what a check or a diagnosis has found, but for what is well, each with its fix."""
    for finding in found:
        if tell_all or finding.level != "ok":
            note(f"{finding.level:<13}{finding.subject}: {finding.detail}")
            note(*([f"{'':<13}{finding.fix}"] if finding.fix else []))


def confirmed(question: str) -> bool:
    """Ask on stderr, and return whether the answer is yes; raises typer.Abort at Ctrl-C."""
    import typer  # the processes of a run tell something, and ask nobody

    return typer.confirm(visible(question), err=True)


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
    ours, *others = map(one_line, problem.why.splitlines() or [""])
    # Lines after the first are often a program's own, none of which may pass for the fix.
    room = shutil.get_terminal_size().columns - len(_QUOTED) if sys.stderr.isatty() else math.inf
    why = [f"  {ours}", *(f"{_QUOTED}{part}" for line in others for part in folded(line, room))]
    fix, *more = map(one_line, problem.fix.splitlines() or [""])
    title = _styled("1;31", "Error: ") + _styled("1", one_line(problem.title))
    _tell("\n".join([title, "", *why, "", f"  {_styled('32', 'Fix: ')}{fix}", *(f"{'':7}{line}" for line in more)]))


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
            import typer

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

    _tell(visible("".join(traceback.format_exception(problem)).rstrip()))


def _tell(text: str) -> None:
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)
