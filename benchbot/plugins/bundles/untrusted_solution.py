"""How `reproduce` runs the solution of a bundle: in a sandbox, in a container, or natively where its user consents."""

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers.options import check_options, in_container
from benchbot.plugins.sandbox.options import mode_of

if TYPE_CHECKING:
    from benchbot.plugins.bundles.reading import Bundle
    from benchbot.plugins.containers.context import Context
    from benchbot.submission.episode import Order
    from benchbot.submission.modes import ProcessLimits


@dataclass(frozen=True)
class Choice:
    """What the user has said about how the solution is run; what is not said is as it ran for its results."""

    limits: "ProcessLimits"
    timeout_s: float | None
    native: bool = False
    trust: bool = False
    readable: list[Path] | None = None
    cpus: float | None = None
    gpus: int = 0
    weak_limits: bool = False


@contextmanager
def unpacked(bundle: "Bundle", folder: Path, choice: Choice) -> Iterator["Order"]:
    """Unpack the solution into a new folder, and yield how it is run there.

    Raises BenchbotError when it cannot be held as it is to be, and natively without consent.
    """
    solution = bundle.manifest["solution"]
    timeout_s = choice.timeout_s if choice.timeout_s is not None else solution["timeout_s"]
    if choice.native and not choice.trust:
        _ask(bundle)
    folder.mkdir()
    bundle.extract_solution(folder)
    context = _context(bundle, folder, choice)
    check_options(context, choice.readable, choice.cpus, choice.gpus, choice.weak_limits)
    if context is not None:
        with in_container(
            context,
            solution["command"],
            timeout_s,
            choice.limits,
            cpus=choice.cpus,
            gpus=choice.gpus,
            weak_limits=choice.weak_limits,
        ) as order:
            yield order
        return
    from benchbot.submission.episode import Order
    from benchbot.submission.solution import python_first

    mode = mode_of(sandboxed=not choice.native, readable=choice.readable, limits=choice.limits)
    yield Order(solution["command"], folder, python_first(), timeout_s, mode, choice.limits)


def _context(bundle: "Bundle", folder: Path, choice: Choice) -> "Context | None":
    """Return what to build an image from; None where the solution did not run in a container."""
    from benchbot.plugins.bundles.command import CONTAINER
    from benchbot.plugins.containers import context

    ran_in_one = bundle.manifest["solution"]["mode"] == CONTAINER
    if choice.native and ran_in_one:
        raise BenchbotError(
            "It is not clear how to run the solution.",
            "It runs in a container, and --native was given.",
            "Leave --native out; or write the source to a folder with --unpack, and submit that.",
        )
    return context.find(folder) if ran_in_one else None


def _ask(bundle: "Bundle") -> None:
    """Return when the user lets the solution run with all their rights; raises BenchbotError otherwise."""
    files = sum(name.startswith("solution/") for name in bundle.manifest["files"])
    command = shlex.join(bundle.manifest["solution"]["command"])
    console.note(f"The bundle's solution ({files} files) would run with all your rights, as: {command}")
    if sys.stdin.isatty() and typer.confirm("Do you trust whoever wrote it?", err=True):
        return
    raise BenchbotError(
        "The solution in the bundle is not trusted.",
        "Run natively it could do whatever you can, and read the ground truth.",
        "Leave --native out: it then runs in a sandbox. If you have read it and trust it: --native --trust",
    )
