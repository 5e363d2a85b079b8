"""How `batch` runs the solution: natively, in a sandbox or in a container, as `submit` does."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.cli.kit import console
from benchbot.cli.kit.limits import process_limits
from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers.options import check_options, context_of

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.batch.plan import Hold, Plan


def hold_of(catalog: "Catalog", wanted: Mapping[str, Any]) -> "Hold":
    """Return what is to hold the solution; raises BenchbotError when it is not clear what, or not possible."""
    from benchbot.plugins.batch.file import SOLUTIONS
    from benchbot.plugins.batch.plan import Hold
    from benchbot.submission.modes import DEFAULT_LIMITS

    given = [f"--{key}" for key in SOLUTIONS if wanted.get(key) is not None]
    if len(given) > 1:
        raise BenchbotError(
            "It is not clear what to submit.", f"{' and '.join(given)} were given.", "Give one of them."
        )
    sandboxed = bool(wanted.get("sandboxed")) or wanted.get("sandbox") is not None
    folder = wanted.get("containerised")
    context = context_of(
        catalog,
        None if folder is None else Path(folder),
        wanted.get("example"),
        (wanted.get("native"), wanted.get("sandbox")),
        bool(wanted.get("example_containerised")),
    )
    readable = [Path(path).absolute() for path in wanted.get("readable", ())]
    weak_limits = bool(wanted.get("weak_limits"))
    check_options(context, readable, weak_limits)
    limits = process_limits(
        wanted.get("memory"), wanted.get("processes"), wanted.get("cpu_time_s"), wanted.get("file_size")
    )
    if context is None and not sandboxed and (readable or limits != DEFAULT_LIMITS):
        raise BenchbotError(
            "A native solution cannot be limited.",
            "--memory, --processes, --cpu-time, --file-size and --readable are about what holds a solution.",
            "Hold it: --sandbox COMMAND, --example NAME --sandboxed, or --containerised FOLDER",
        )
    for path in readable:
        if not path.exists():
            raise BenchbotError(f"There is no {path}.", "--readable names it.", "Name a file or folder that is there.")
    return Hold(
        sandboxed=sandboxed,
        readable=tuple(map(str, readable)),
        context=None if context is None else str(context.folder),
        dockerfile=None if context is None else context.dockerfile,
        weak_limits=weak_limits,
        limits=limits,
    )


def check_here(plan: "Plan", catalog: "Catalog", gpus: int) -> None:
    """Prove that this machine can hold the solution as planned, its image built; raises BenchbotError."""
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.plugins.batch import solutions
    from benchbot.plugins.batch.plan import Hold

    if plan.solution.hold == Hold():
        return
    with StatusLine() as status:

        def tell(line: str) -> None:
            status.show(line, line, urgent=line.upper().startswith(("STEP ", "BUILDING ", "THE IMAGE ")))

        with solutions.prepared(plan, catalog, tell, gpus) as order:
            held = order.mode.name
    console.note(f"The solution is held: {held}.")
