"""The solution of a batch as it runs on this machine: natively, in a sandbox, or in a container."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from benchbot.cli.kit.holding import NATIVE
from benchbot.core.declarations.catalog import Catalog
from benchbot.plugins.batch.plan import Hold, Plan
from benchbot.plugins.batch.source_files import SourceFiles, find
from benchbot.submission.modes import SolutionSpec, holder_of, spec_of, split_words

IMAGE = "container"
"""The word for a container's command in a plan."""


@contextmanager
def prepared(plan: Plan, catalog: Catalog, tell: Callable[[str], object], gpus: int = 0) -> Iterator[SolutionSpec]:
    """Yield what is run in each episode of a plan, after proving that this machine can; `tell` hears of a build.

    Raises BenchbotError when its command is not there, or nothing here can hold it as the plan says.
    """
    mode, options = plan.solution.hold.in_mode(gpus)
    spec = unheld(plan, catalog)
    if mode == NATIVE:
        yield spec
    else:
        with holder_of(catalog.plugins, mode).prepared(spec, options, tell) as held:
            yield held


def unheld(plan: Plan, catalog: Catalog) -> SolutionSpec:
    """Return what a plan's solution runs, before a mode holds it; an image says itself what runs in its container."""
    solution, hold = plan.solution, plan.solution.hold
    if hold.context is not None:
        spec = SolutionSpec(list(solution.words), Path(solution.folder), timeout_s=plan.timeout_s)
    elif solution.native is None:
        spec = spec_of(catalog, None, solution.example, list(solution.words), plan.timeout_s)
    else:
        words = [*split_words("--native", solution.native), *solution.words]
        spec = SolutionSpec(words, Path(solution.folder), timeout_s=plan.timeout_s)
    return replace(spec, limits=hold.limits, log_limit_bytes=plan.policy.log_limit_bytes)


def files(command: list[str], folder: Path, hold: Hold, catalog: Catalog) -> SourceFiles:
    """Return the hashes of the files that make a solution what it is."""
    mode, options = hold.in_mode()
    found = None if mode == NATIVE else holder_of(catalog.plugins, mode).files(options)
    return find(command, folder) if found is None else SourceFiles(dict(found), ())
