"""How `batch` runs the solution: natively, in a sandbox or in a container, as `submit` does."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.cli.kit.holding import (
    CONTAINER,
    NATIVE,
    SANDBOX,
    V2_CLIENT,
    check_options,
    container_options,
    held,
    process_limits,
)
from benchbot.cli.kit.preflight import Intent, Submission
from benchbot.core.errors import BenchbotError
from benchbot.core.records import WorkOrder

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog, Declaration
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.plan import Hold, Plan
    from benchbot.plugins.batch.request import BatchRequest
    from benchbot.plugins.batch.worker_pool import WorkerPool


def hold_of(catalog: "Catalog", wanted: Mapping[str, Any]) -> "Hold":
    """Return what is to hold the solution; raises BenchbotError when it is not clear what, or not possible."""
    from benchbot.plugins.batch.plan import Hold
    from benchbot.plugins.batch.request import SOLUTIONS
    from benchbot.submission.modes import holder_of

    given = [f"--{key}" for key in SOLUTIONS if wanted.get(key) is not None]
    if len(given) > 1:
        raise BenchbotError(
            "It is not clear what to submit.", f"{' and '.join(given)} were given.", "Give one of them."
        )
    sandboxed = bool(wanted.get("sandboxed")) or wanted.get("sandbox") is not None
    folder = wanted.get("containerised")
    contained = container_options(
        catalog,
        None if folder is None else Path(folder),
        wanted.get("example"),
        (wanted.get("native"), wanted.get("sandbox")),
        bool(wanted.get("example_containerised")),
    )
    readable = tuple(wanted.get("readable", ()))
    weak_limits = bool(wanted.get("weak_limits"))
    limits = process_limits(
        wanted.get("memory"), wanted.get("processes"), wanted.get("cpu_time_s"), wanted.get("file_size")
    )
    v2_client = bool(wanted.get("v2_client"))
    uncontained = SANDBOX if sandboxed else V2_CLIENT if v2_client else NATIVE
    mode = CONTAINER if contained is not None else uncontained
    check_options(mode, readable, limits, weak_limits)
    if mode == NATIVE:
        return Hold()
    asked = {**({"readable": readable} if contained is None else contained), "v2_client": v2_client}
    options = holder_of(catalog.plugins, mode).resolved(asked)
    return Hold(
        sandboxed=sandboxed,
        readable=tuple(options.get("readable", ())),
        context=options.get("context"),
        dockerfile=options.get("dockerfile"),
        weak_limits=weak_limits,
        limits=limits,
        v2_client=v2_client,
    )


def check_here(plan: "Plan", catalog: "Catalog", gpus: int) -> None:
    """Prove that this machine can hold the solution as planned, its image built; raises BenchbotError."""
    from benchbot.plugins.batch import solutions

    for alone in plan.each().values():
        mode, options = alone.solution.hold.in_mode(gpus)
        if mode != NATIVE:
            with held(catalog, solutions.unheld(alone, catalog), mode, options):
                pass


def intent(
    request: "BatchRequest",
    plan: "Plan | None",
    folder: "Folder",
    pool: "WorkerPool",
    catalog: "Catalog",
    scenes: "Sequence[Declaration]",
) -> Intent:
    """Return what a batch is about to start, for its preflight; without a plan, as far as the request says."""
    from benchbot.plugins.batch import solutions

    submissions = []
    for alone in () if plan is None else plan.each().values():
        mode, options = alone.solution.hold.in_mode(pool.resources.gpus)
        submissions.append(Submission(solutions.unheld(alone, catalog), mode, options))
    return Intent(
        scenes=scenes,
        submissions=submissions,
        method=request.method,
        record=dict.fromkeys(request.record, folder.episodes),
        folders=[folder.path],
        free_bytes=request.policy.minimum_free_bytes,
        executor=pool.executor,
        order=WorkOrder(folder.path, (), pool.jobs, pool.resources, dict(pool.options)),
    )
