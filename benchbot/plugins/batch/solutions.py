"""The solution of a batch as it runs on this machine: natively, in a sandbox, or in a container."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.core.declarations.catalog import Catalog
from benchbot.plugins.batch.plan import Hold, Plan
from benchbot.plugins.batch.source_files import SourceFiles, find
from benchbot.submission.command import order_of, split_words
from benchbot.submission.episode import Order

if TYPE_CHECKING:
    from benchbot.plugins.containers.context import Context

IMAGE = "container"
"""What stands for a container's command, and for all files that its image is built from, in a plan."""


@contextmanager
def prepared(plan: Plan, catalog: Catalog, tell: Callable[[str], object], gpus: int = 0) -> Iterator[Order]:
    """Yield what is run in each episode of a plan, after proving that this machine can; `tell` hears of a build.

    Raises BenchbotError when its command is not there, or nothing here can hold it as the plan says.
    """
    solution, hold = plan.solution, plan.solution.hold
    context = _context(hold)
    if context is not None:
        from benchbot.plugins.containers import mode

        with mode.prepared(context, tell, weak_limits=hold.weak_limits, gpus=gpus) as held:
            words = [held.image, *solution.words]
            yield Order(words, context.folder, timeout_s=plan.timeout_s, mode=held, limits=hold.limits)
        return
    order = _command(plan, catalog)
    if hold.sandboxed:
        from benchbot.plugins.sandbox.mode import Sandbox

        sandbox = Sandbox(tuple(map(Path, hold.readable)))
        sandbox.check()
        order = replace(order, mode=sandbox, limits=hold.limits)
    yield order


def files(command: list[str], folder: Path, hold: Hold) -> SourceFiles:
    """Return the hashes of the files that make a solution what it is."""
    context = _context(hold)
    if context is None:
        return find(command, folder)
    # Which bases there are differs from machine to machine, and what they are called is in the Dockerfile.
    return SourceFiles({IMAGE: context.digest(lambda _name: None)}, ())


def _command(plan: Plan, catalog: Catalog) -> Order:
    solution = plan.solution
    if solution.native is None:
        return order_of(catalog, None, solution.example, list(solution.words), plan.timeout_s)
    words = [*split_words("--native", solution.native), *solution.words]
    return Order(words, Path(solution.folder), timeout_s=plan.timeout_s)


def _context(hold: Hold) -> "Context | None":
    if hold.context is None or hold.dockerfile is None:
        return None
    from benchbot.plugins.containers.context import Context

    return Context(Path(hold.context), hold.dockerfile)
