"""Making the screens that watch: with what their keys do beyond what they watch."""

from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.plugins.drawing.map_model import SceneMap
from benchbot.plugins.drawing.scene_maps import installed_map
from benchbot.plugins.tui import jobs, result_rows
from benchbot.plugins.tui.job_screen import JobScreen
from benchbot.plugins.tui.jobs import Job
from benchbot.plugins.tui.orders import RunOrder, run_words
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import EpisodeCell
from benchbot.wire.run_state import RunState

if TYPE_CHECKING:
    from benchbot.plugins.tui.app import BenchbotApp
    from benchbot.plugins.tui.batch_screen import BatchScreen
    from benchbot.plugins.tui.run_screen import RunScreen

START_TIMEOUT_S = 120.0
LOOK_PERIOD_S = 0.2


def run_screen(app: "BenchbotApp", state: RunState) -> "RunScreen":
    """Return the screen that watches a run."""
    from benchbot.plugins.tui.run_screen import RunScreen

    def surroundings(environment: str) -> SceneMap:
        return installed_map(app.catalog, environment)

    def again(ended: RunState) -> None:
        start_again(app, ended)

    def report(result: Path) -> None:
        make_report(app, [result])

    return RunScreen(RunFeed(state), again=again, report=report, surroundings=surroundings, images=app.images)


def batch_screen(app: "BenchbotApp", folder: Path) -> "BatchScreen":
    """Return the screen that watches a batch."""
    from benchbot.plugins.tui.batch_screen import BatchScreen

    def open_run(cell: EpisodeCell) -> None:
        wanted = (cell.environment, cell.robot, cell.seed)
        for state in app.alive.runs:
            if (state.environment, state.robot, state.seed) == wanted:
                app.watch_run(state)
                return
        app.notify(f"No run of {cell.name} is alive on this machine.")

    def go_on(going_on: Path) -> None:
        start(app, ["batch", "attach", "--detach", str(going_on)])

    return BatchScreen(BatchFeed(folder), open_run=open_run, go_on=go_on)


def start_again(app: "BenchbotApp", state: RunState) -> None:
    """Start what has made a run once more: the submission from here that it was of, or the run alone."""
    for each in app.alive.started:
        job = each.job
        if (
            job.words[0] == "submit"
            and f"--env={state.environment}" in job.words
            and f"--seed={state.seed}" in job.words
        ):
            start(app, list(job.words), job.result, watch=True)
            return
    start(app, run_words(RunOrder(state.task, state.robot, state.environment, state.seed)), watch=True)


def start(
    app: "BenchbotApp",
    words: list[str],
    result: Path | None = None,
    *,
    watch: bool = False,
    variables: dict[str, str] | None = None,
) -> None:
    """Start a command that goes on without the app, and watch the run that it begins."""

    def begin() -> tuple[Job, RunState | None]:
        job = jobs.start(words, result=result, variables=variables)
        app.begun.add(job.folder)
        return job, jobs.wait_for_run(job, START_TIMEOUT_S, LOOK_PERIOD_S) if watch else None

    def begun(found: tuple[Job, RunState | None]) -> None:
        job, state = found
        app.look()
        if state is not None:
            app.watch_run(state)
        elif watch:
            app.push_screen(JobScreen(job))

    app.notify("Starting …" if watch else "Begun.", timeout=3)
    app.in_thread(begin, begun)


def make_report(app: "BenchbotApp", paths: list[Path]) -> None:
    """Make the report of results, say where it is, and show it in a browser where there is one."""

    def written(path: Path) -> None:
        app.notify(str(path), title="The report is written.", timeout=10, markup=False)
        if app.is_web:
            app.deliver_text(path, open_method="browser", mime_type="text/html")
        elif app.has_browser:
            app.open_url(path.as_uri())

    app.notify("Making the report …", timeout=3)
    app.in_thread(lambda: result_rows.report(paths, app.catalog), written)
