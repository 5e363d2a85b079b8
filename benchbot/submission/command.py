"""What to run as a solution, from how people say it: a command, or the name of an example."""

import os
import shlex
import shutil
from pathlib import Path

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.submission.modes import SolutionSpec
from benchbot.submission.solution import cannot_start, python_first


def spec_of(
    catalog: Catalog,
    native: str | None,
    example: str | None,
    words: list[str],
    timeout_s: float | None,
    sandbox: str | None = None,
) -> SolutionSpec:
    """Return what to run, natively; raises BenchbotError unless exactly one was chosen and its command exists."""
    commands = {"--native": native, "--sandbox": sandbox}
    given = [name for name, value in {**commands, "--example": example}.items() if value is not None]
    if len(given) != 1:
        raise BenchbotError(
            "It is not clear what to submit.",
            f"{' and '.join(given)} were given." if given else "No solution was given.",
            "Give one: --native python my_solution.py, --sandbox python my_solution.py, "
            "or --example NAME (benchbot list examples).",
        )
    if example is None:
        spec = SolutionSpec([*split_words(given[0], commands[given[0]]), *words], Path.cwd(), timeout_s=timeout_s)
    else:
        found = catalog.get("examples", example)
        command = [*split_words("native_command", found.data["native_command"]), *words]
        spec = SolutionSpec(command, found.path.parent, python_first(), timeout_s)
    if not spec.command:
        raise cannot_start(["(nothing)"], "there is no command")
    path = spec.variables.get("PATH", os.environ.get("PATH"))
    if os.sep not in spec.command[0] and shutil.which(spec.command[0], path=path) is None:
        raise cannot_start(spec.command, "there is no such program on PATH")
    return spec


def split_words(origin: str, text: str | None) -> list[str]:
    """Return the words of a command, split as a shell would; raises BenchbotError for a quote that stays open."""
    try:
        return shlex.split(text or "")
    except ValueError as error:
        raise BenchbotError(
            f"The words of {origin} cannot be told apart.", f"{text!r}: {error}.", "Close the quote, or escape it."
        ) from error
