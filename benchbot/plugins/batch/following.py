"""Following a batch: where it stands, its logs, its end, and going on with it."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.interrupting import interruptible
from benchbot.cli.kit.options import Display, Json
from benchbot.core.errors import BenchbotError, ExitCode

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.batch.finishing import Profile
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.plan import Plan
    from benchbot.plugins.batch.status import BatchStatus, Monitor
    from benchbot.plugins.batch.worker_pool import Crew

Directory = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the batch.")]
Detach = Annotated[
    bool,
    typer.Option("--detach", help="Leave the batch to itself until it is scored; attach DIR comes back."),
]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", metavar="N", min=1, help="How many workers. [default: as many as there is room for]"),
]


def status(directory: Directory, as_json: Json = False) -> None:
    """Say where a batch stands."""
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.driver import count_alive
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.status import Monitor
    from benchbot.plugins.watching import batch_lines

    folder = Folder(directory.absolute())
    found = Monitor(folder, plans.read(folder.plan)).look(count_alive(folder))
    if as_json:
        console.data_json(found.as_dict())
    else:
        console.data(batch_lines.page(found))


def logs(
    directory: Directory,
    episode: Annotated[
        str | None, typer.Argument(metavar="[EPISODE]", help="Print the log of these: any part of their names.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Name the logs of a batch's episodes, or print them."""
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.attempts import Attempts
    from benchbot.plugins.batch.folder import Folder

    folder = Folder(directory.absolute())
    rows = []
    for planned in plans.read(folder.plan).episodes:
        if episode is not None and episode not in planned.name:
            continue
        place = folder.episode(planned.name)
        finished = Attempts(place).finished()
        state = "pending" if finished is None else finished.failure or "done"
        kept = sorted(place.glob("attempt-*/log.txt")) + sorted(place.glob("log.txt"))
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
            console.data(path.read_text("utf-8", "replace").rstrip("\n"))


def cancel(directory: Directory, as_json: Json = False) -> None:
    """End a batch's workers, wherever they run. What is finished stays."""
    from benchbot.plugins.batch import driver
    from benchbot.plugins.batch.folder import Folder

    folder = Folder(directory.absolute())
    driver.cancel(folder)
    if as_json:
        console.data_json({"folder": str(folder.path), "workers": driver.count_alive(folder)})
    console.note(f"Ended. Go on with: benchbot batch attach {directory}")


def attach(
    directory: Directory,
    jobs: Jobs = None,
    archive: Annotated[bool, typer.Option("--zip", "-z", help="Put the results into a ZIP archive, too.")] = False,
    detach: Detach = False,
    display: Display = "auto",
    as_json: Json = False,
) -> None:
    """Look on at a batch that runs, or go on with one that does not."""
    _go_on(directory, jobs, archive=archive, detach=detach, display=display, as_json=as_json)


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
    archive: Annotated[bool, typer.Option("--zip", "-z", help="Put the results into a ZIP archive, too.")] = False,
    detach: Detach = False,
    display: Display = "auto",
    as_json: Json = False,
) -> None:
    """Compute episodes that have failed once more, and go on with the batch; what they left is kept beside."""
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch import retrying
    from benchbot.plugins.batch.driver_lock import driving
    from benchbot.plugins.batch.folder import Folder

    folder = Folder(directory.absolute())
    plans.read(folder.plan)
    with driving(folder):
        count = retrying.begin_anew(folder, failed)
    console.note(f"{count} episodes are computed once more.")
    _go_on(directory, jobs, archive=archive, detach=detach, display=display, as_json=as_json)


def _go_on(directory: Path, jobs: int | None, *, archive: bool, detach: bool, display: Display, as_json: bool) -> None:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.folder import Folder
    from benchbot.plugins.batch.worker_pool import Crew

    folder = Folder(directory.absolute())
    plan = plans.read(folder.plan)
    crew = Crew.read(folder)
    crew = crew if jobs is None else replace(crew, jobs=jobs)
    archive = archive or crew.archive
    catalog = Catalog(load())
    drive(folder, crew, catalog, plan, archive=archive, detach=detach, display=display, as_json=as_json)
    exit_as_it_ended(folder, plan, detached=detach)


def drive(
    folder: "Folder",
    crew: "Crew",
    catalog: "Catalog",
    plan: "Plan",
    *,
    archive: bool,
    detach: bool,
    as_json: bool,
    display: Display = "auto",
) -> "Profile | None":
    """See a batch to its end and make its profile, or launch it and return None."""
    from benchbot.cli.kit import scoring
    from benchbot.cli.kit.status_line import StatusLine
    from benchbot.plugins.batch import detached, driver, finishing
    from benchbot.plugins.batch.driver_lock import driving
    from benchbot.plugins.batch.live_score import LiveScore
    from benchbot.plugins.watching import batch_lines

    crew = replace(crew, detached=detach, archive=archive)
    if detach:
        with driving(folder):
            driver.begin(folder, crew)
            count = driver.start_detached(folder, crew)
        detached.start(folder)
        console.note(f"{count} workers run by themselves. Look on: benchbot batch attach {folder.path}")
        console.data_json({"folder": str(folder.path), "workers": count}) if as_json else console.data(str(folder.path))
        return None
    live = LiveScore(folder, plan.method, catalog)
    said = f"the workers have been ended. Go on with: benchbot batch attach {folder.path}"
    with driving(folder), interruptible(said), StatusLine(display) as line:

        def look(status: "BatchStatus", monitor: "Monitor") -> None:
            status = replace(status, score=live.update(monitor))
            batch_lines.show(line, status)

        driver.begin(folder, crew)
        ended = driver.drive(folder, crew, look)
    console.note(batch_lines.verdict(ended))
    try:
        profile = finishing.finish(folder, plan, catalog, archive=archive)
    except BenchbotError as error:
        if not ended.failures:
            raise
        console.error(error)  # why there is nothing to score is in the failures: they say how this ends
        return None
    if profile.scores is not None:
        console.note(scoring.table(profile.scores))
    for path in profile.as_dict().values():
        console.note(f"Wrote {path}")
    if as_json:
        console.data_json({"status": ended.as_dict(), "files": profile.as_dict()})
    else:
        console.data(str(folder.path) if profile.scores is None else scoring.headline(profile.scores))
    return profile


def exit_as_it_ended(folder: "Folder", plan: "Plan", *, detached: bool) -> None:
    """Exit with what the worst failure means, as `submit` would; results that came of collisions are results."""
    from benchbot.core.errors import FailureClass
    from benchbot.plugins.batch.attempts import RETRIED, Attempts

    if detached:
        return
    finished = [Attempts(folder.episode(episode.name)).finished() for episode in plan.episodes]
    failures = {each.failure for each in finished if each is not None}
    if failures & set(RETRIED):
        raise typer.Exit(ExitCode.INTERNAL)
    if failures & {FailureClass.AGENT, FailureClass.TIMEOUT}:
        raise typer.Exit(ExitCode.SUBMISSION_FAILED)
