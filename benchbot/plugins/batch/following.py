"""The commands of `benchbot batch` for a batch that was begun: its status, its logs, ending it, and going on."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.console import interruptible
from benchbot.cli.kit.options import Display, Json
from benchbot.core.errors import BenchbotError, ExitCode

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.batch.finalization import Products
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.plan import Plan
    from benchbot.plugins.batch.status import BatchStatus, Monitor
    from benchbot.plugins.batch.worker_pool import WorkerPool

Directory = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the batch.")]
Detach = Annotated[
    bool,
    typer.Option("--detach", help="Leave the batch to itself until it is scored; attach DIR comes back."),
]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", metavar="N", min=1, help="How many workers. [default: as many as there is room for]"),
]
Archive = Annotated[bool, typer.Option("--zip", "-z", help="Put the results into a ZIP archive, too.")]


def status(directory: Directory, as_json: Json = False) -> None:
    """Say where a batch stands."""
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch import status_lines
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.status import Monitor
    from benchbot.plugins.batch.worker_pool import count_alive

    folder = Folder(directory.absolute())
    found = Monitor(folder, plans.read(folder.plan)).look(count_alive(folder))
    if as_json:
        console.data_json(found.as_dict())
    else:
        console.data(*status_lines.page(found))


def logs(
    directory: Directory,
    episode: Annotated[
        str | None, typer.Argument(metavar="[EPISODE]", help="Print the log of these: any part of their names.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Name the logs of a batch's episodes, or print them."""
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.folder import Folder

    folder = Folder(directory.absolute())
    rows = []
    for planned in plans.read(folder.plan).episodes:
        if episode is not None and episode not in planned.name:
            continue
        attempts = folder.attempts(planned)
        finished = attempts.finished()
        state = "pending" if finished is None else finished.failure or "done"
        kept = sorted(attempts.folder.glob("attempt-*/log.txt")) + sorted(attempts.folder.glob("log.txt"))
        rows += [(planned.name, str(state), path) for path in kept]
    if episode is not None and not rows:
        raise BenchbotError(
            f"There is no log of '{episode}'.",
            "No episode that was begun has that in its name.",
            f"See what there is: benchbot batch logs {directory}",
        )
    if as_json:
        console.data_json([{"episode": name, "state": state, "log": str(path)} for name, state, path in rows])
    elif episode is None:
        console.table(("episode", "state", "log"), [(name, state, str(path)) for name, state, path in rows])
    else:
        for name, state, path in rows:
            console.note(f"{name} ({state}): {path}")
            console.data(*path.read_text("utf-8", "replace").expandtabs().splitlines())


def cancel(directory: Directory, as_json: Json = False) -> None:
    """End a batch's workers, wherever they run. What is finished stays."""
    from benchbot.plugins.batch import driver
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.worker_pool import count_alive

    folder = Folder(directory.absolute())
    driver.cancel(folder)
    if as_json:
        console.data_json({"folder": str(folder.path), "workers": count_alive(folder)})
    console.note(f"Ended. Go on with: benchbot batch attach {directory}")


def attach(
    directory: Directory,
    jobs: Jobs = None,
    archive: Archive = False,
    detach: Detach = False,
    display: Display = "auto",
    as_json: Json = False,
) -> None:
    """Look on at a batch that runs, or go on with one that does not."""
    go_on(directory, jobs, archive=archive, detach=detach, display=display, as_json=as_json)


def retry(
    directory: Directory,
    failed: Annotated[
        str | None,
        typer.Option(
            "--failed",
            metavar="CLASS,CLASS",
            help="Those that failed like this: platform, infrastructure, agent, … [default: the first two]",
        ),
    ] = None,
    jobs: Jobs = None,
    archive: Archive = False,
    detach: Detach = False,
    display: Display = "auto",
    as_json: Json = False,
) -> None:
    """Compute episodes that have failed once more, and go on with the batch; what they left is kept beside."""
    from benchbot.plugins.batch import driver
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.driver_lock import driver_lock
    from benchbot.plugins.batch.folder import Folder

    folder = Folder(directory.absolute())
    plans.read(folder.plan)
    with driver_lock(folder):
        count, others = driver.retry(folder, failed)
    console.note(f"{count} episode{' is' if count == 1 else 's are'} computed once more.")
    if others:
        said = ", ".join(f"{number} {name}" for name, number in sorted(others.items()))
        console.note(
            f"Failed in other ways, and left as they are: {said}. For these: --failed {','.join(sorted(others))}"
        )
    go_on(directory, jobs, archive=archive, detach=detach, display=display, as_json=as_json)


def go_on(directory: Path, jobs: int | None, *, archive: bool, detach: bool, display: Display, as_json: bool) -> None:
    """Go on with the plan in a batch's folder, with its last pool of workers unless `jobs` says another number."""
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.batch import matrix
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.folder import Folder, first_line
    from benchbot.plugins.batch.worker_pool import WorkerPool

    folder, catalog = Folder(directory.absolute()), Catalog(load())
    plan = plans.read(folder.plan)
    pool = WorkerPool.read(folder)
    console.note(first_line(folder, plan, matrix.edited(plan, catalog)))
    pool = replace(pool, jobs=jobs or pool.jobs, archive=archive or pool.archive, detached=detach)
    exit_as_it_ended(drive(folder, pool, catalog, plan, display=display, as_json=as_json).status)


@dataclass(frozen=True)
class Ended:
    """The end of a batch: where it stood, None when it was detached, and what was made of its results."""

    status: "BatchStatus | None" = None
    products: "Products | None" = None


def drive(
    folder: "Folder", pool: "WorkerPool", catalog: "Catalog", plan: "Plan", *, as_json: bool, display: Display = "auto"
) -> Ended:
    """Drive a batch to its end and evaluate it, or detach it."""
    from benchbot.cli.kit import scoring
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.plugins.batch import driver, machine, status_lines
    from benchbot.plugins.batch.driver_lock import driver_lock
    from benchbot.plugins.batch.finalization import LiveScore, evaluate
    from benchbot.plugins.report import compare_command

    if pool.detached:
        count = driver.detach(folder, pool)
        console.note(f"{count} workers run by themselves. Look on: benchbot batch attach {folder.path}")
        console.data_json({"folder": str(folder.path), "workers": count}) if as_json else console.data(str(folder.path))
        return Ended()
    live = LiveScore(folder, plan.method, catalog)
    said = f"the workers have been ended. Go on with: benchbot batch attach {folder.path}"
    with driver_lock(folder), interruptible(said), StatusLine(display) as line:

        def look(status: "BatchStatus", monitor: "Monitor") -> None:
            # All results of a batch that is complete are scored below.
            with uninterrupted():
                score = live.value if status.is_complete else live.update(monitor)
            status_lines.show(line, replace(status, score=score))

        driver.begin(folder, pool)
        status = driver.drive(folder, pool, look)
    console.note(*status_lines.verdict(status))

    def wait(error: Exception) -> None:
        console.note(f"Waiting for room on the disk. {error}")

    try:
        products = machine.when_there_is_room(
            lambda: evaluate(folder, plan, catalog, archive=pool.archive), lambda: True, wait
        )
    except BenchbotError as error:
        if not status.failures:
            raise
        console.error(error)  # why there is nothing to score is in the failures: they say how this ends
        return Ended(status)
    for name, scores in products.scores_of.items():
        console.note(*([] if name is None else ["", name]), *scoring.table(scores))
    for problem in products.problems:
        console.error(problem)
    console.note(*map(str, products.costs))
    for path in products.files.values():
        console.note(f"Wrote {path}")
    if as_json:
        made = {"files": products.files, "costs": [asdict(cost) for cost in products.costs]}
        compared = {} if products.comparison is None else {"comparison": products.comparison}
        console.data_json({"status": status.as_dict(), **made, **compared})
    elif products.comparison is not None:
        compare_command.show(products.comparison)
    else:
        console.data(str(folder.path) if products.scores is None else scoring.headline(products.scores))
    return Ended(status, products)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold SIGINT, SIGTERM and SIGHUP back until the block has ended.

    NumPy and SciPy lose a KeyboardInterrupt that meets their import: the batch would go on, and could not be ended.
    """
    held: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, lambda received, _frame: held.append(received)) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if held:
        signal.raise_signal(held[0])


def exit_as_it_ended(status: "BatchStatus | None") -> None:
    """Exit with the code of the worst failure, as `submit` would; results that came of collisions are results."""
    from benchbot.core.errors import FailureClass
    from benchbot.plugins.batch.attempts import RETRIED

    failures = () if status is None else {FailureClass(name) for name in status.failures}
    if any(failure in RETRIED for failure in failures):
        raise typer.Exit(ExitCode.INTERNAL)
    if FailureClass.AGENT in failures or FailureClass.TIMEOUT in failures:
        raise typer.Exit(ExitCode.SUBMISSION_FAILED)
