"""How `submit` runs a solution: natively, or in the sandbox that its options ask for."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.submission.modes import Mode, ProcessLimits

SandboxCommand = Annotated[
    str | None, typer.Option("--sandbox", metavar="COMMAND", help="Run this command, held in a sandbox.")
]
Sandboxed = Annotated[bool, typer.Option("--sandboxed", help="Hold the example in a sandbox, too.")]
Readable = Annotated[
    list[Path] | None,
    typer.Option("--readable", metavar="PATH", help="Let it read this file or folder in the sandbox; repeatable."),
]


def mode_of(*, sandboxed: bool, readable: list[Path] | None, limits: "ProcessLimits") -> "Mode":
    """Return the way to run a solution, after proving that it works on this machine; says which it is.

    Raises BenchbotError when it does not work, or for options that need a sandbox without one.
    """
    from benchbot.submission.modes import DEFAULT_LIMITS
    from benchbot.submission.native import NATIVE

    if not sandboxed:
        if readable or limits != DEFAULT_LIMITS:
            raise BenchbotError(
                "A native solution cannot be limited.",
                "--memory, --processes, --cpu-time, --file-size and --readable are about what holds a solution, "
                "and nothing holds a native one.",
                "Run it in a sandbox: --sandbox COMMAND, or --example NAME --sandboxed",
            )
        return NATIVE
    from benchbot.plugins.sandbox.mode import Sandbox

    for path in readable or ():
        if not path.exists():
            raise BenchbotError(f"There is no {path}.", "--readable names it.", "Name a file or folder that is there.")
    sandbox = Sandbox(tuple(readable or ()))
    sandbox.check()
    console.note(f"The solution runs {sandbox.describe()}.")
    return sandbox
