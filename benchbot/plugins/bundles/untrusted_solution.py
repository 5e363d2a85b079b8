"""Runs the solution of a bundle for `reproduce`: in a sandbox, in a container, or natively if the user consents."""

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.cli.kit import console
from benchbot.cli.kit.holding import CONTAINER, NATIVE, SANDBOX, V2_CLIENT, check_options, held
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.bundles.bundle_file import Bundle
    from benchbot.submission.modes import ProcessLimits, SolutionSpec


@dataclass(frozen=True)
class Choice:
    """The user's choice of how the solution is run; by default it runs as it did for its results."""

    limits: "ProcessLimits"
    timeout_s: float | None
    native: bool = False
    trust: bool = False
    readable: list[Path] | None = None
    cpus: float | None = None
    gpus: int = 0
    weak_limits: bool = False


@contextmanager
def unpacked(catalog: "Catalog", bundle: "Bundle", folder: Path, choice: Choice) -> Iterator["SolutionSpec"]:
    """Unpack the solution into a new folder, and yield how it is run there.

    Raises BenchbotError when it cannot be confined as chosen, and when it is to run natively without consent.
    """
    from benchbot.submission.modes import SolutionSpec, holder_of
    from benchbot.submission.solution import python_first

    solution = bundle.manifest["solution"]
    timeout_s = choice.timeout_s if choice.timeout_s is not None else solution["timeout_s"]
    if choice.native and not choice.trust:
        _ask(bundle)
    folder.mkdir()
    bundle.extract_solution(folder)
    mode = _mode(solution["mode"], native=choice.native)
    check_options(mode, choice.readable, choice.limits, choice.weak_limits, choice.cpus, choice.gpus)
    spec = SolutionSpec(solution["command"], folder, timeout_s=timeout_s, limits=choice.limits)
    asked: dict[str, Any] = {}
    if mode == CONTAINER:
        asked = {"folder": str(folder), "processors": choice.cpus, "gpus": choice.gpus}
    else:
        asked = {"readable": choice.readable or ()}
        spec = replace(spec, variables=python_first())
    options = (
        {}
        if mode == NATIVE
        else holder_of(catalog.plugins, mode).resolved({**asked, "weak_limits": choice.weak_limits})
    )
    with held(catalog, spec, mode, options) as prepared:
        yield prepared


def _mode(ran_in: str, *, native: bool) -> str:
    """Return the submission mode: a container where the solution ran in one for its results, else a sandbox."""
    if native and ran_in == CONTAINER:
        raise BenchbotError(
            "It is not clear how to run the solution.",
            "It runs in a container, and --native was given.",
            "Leave --native out; or write the source to a folder with --unpack, and submit that.",
        )
    if ran_in == V2_CLIENT and not native:
        raise BenchbotError(
            "The solution in the bundle cannot run in a sandbox.",
            "It uses BenchBot v2's client, which needs a network, and there is none.",
            "Read it; if you trust it: --native --trust",
        )
    unheld = V2_CLIENT if ran_in == V2_CLIENT else NATIVE
    return CONTAINER if ran_in == CONTAINER else unheld if native else SANDBOX


def _ask(bundle: "Bundle") -> None:
    """Return when the user lets the solution run with all their rights; raises BenchbotError otherwise."""
    files = sum(name.startswith("solution/") for name in bundle.manifest["files"])
    command = shlex.join(bundle.manifest["solution"]["command"])
    console.note(f"The bundle's solution ({files} files) would run with all your rights, as: {command}")
    if sys.stdin.isatty() and console.confirmed("Do you trust whoever wrote it?"):
        return
    raise BenchbotError(
        "The solution in the bundle is not trusted.",
        "Run natively it could do whatever you can, and read the ground truth.",
        "Leave --native out: it then runs in a sandbox. If you have read it and trust it: --native --trust",
    )
