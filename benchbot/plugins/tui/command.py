"""`benchbot tui`: screens in a terminal, in a browser, or the same as plain lines."""

import os
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.plugins.tui.jobs import Alive
    from benchbot.wire.run_state import RunState

SERVER_PID = "BENCHBOT_TUI_SERVER"
"""Names the process of the web server, in the environment of its children."""
SERVER_PERIOD_S = 0.5


def tui(
    run: Annotated[
        str | None, typer.Option("--run", metavar="ID", help="Watch this run: a part of its name that no other has.")
    ] = None,
    batch: Annotated[
        Path | None, typer.Option("--batch", metavar="DIR", help="Watch the batch in this folder.")
    ] = None,
    display: Annotated[
        Literal["auto", "screen", "plain", "json"],
        typer.Option(
            "--display",
            metavar="screen|plain|json",
            help="Screens, plain lines for screen readers and files, or JSON. [default: screens on a terminal]",
        ),
    ] = "auto",
    images: Annotated[
        Literal["auto", "halfcell", "sextant", "octant", "kitty", "sixel", "none"] | None,
        typer.Option(
            "--images",
            metavar="auto|halfcell|sextant|octant|kitty|sixel|none",
            help="How pictures are drawn: auto asks the terminal whether it shows kitty's or sixel graphics. "
            "[default: as the screen of settings has it, else auto]",
        ),
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Serve the screens to a browser of this machine.")] = False,
    port: Annotated[
        int, typer.Option("--port", metavar="PORT", min=0, max=65535, help="With --web: 0 is any free one.")
    ] = 0,
) -> None:
    """Choose, start, watch, submit, evaluate and browse; ends nothing that it has started or watched.

    It finds the runs and batches of this user by itself, wherever on this machine they were started.
    """
    if run is not None and batch is not None:
        raise BenchbotError("There are two things to watch.", "--run and --batch were given.", "Give one of them.")
    if batch is not None and not (batch / "plan.json").is_file():
        raise BenchbotError(
            f"{batch} is not the folder of a batch.",
            "It holds no plan.json.",
            "Name the folder that benchbot batch printed.",
        )
    state = None
    if run is not None:
        from benchbot.wire import joining, run_state

        state = joining.named(run, run_state.live())
    if web:
        _web(run, batch, images, port)
    elif display == "screen" or (display == "auto" and _can_show_screens()):
        from concurrent.futures import ThreadPoolExecutor

        from benchbot.plugins.tui import terminal_answers

        _end_with_server()
        # A terminal that never answers takes the whole time-out: the screens are imported meanwhile.
        with ThreadPoolExecutor(1) as beside:
            shown_as = beside.submit(terminal_answers.way_of_images, images)
            from benchbot.plugins.tui import app
        raise typer.Exit(
            app.show(run=state, batch=None if batch is None else batch.absolute(), images=shown_as.result())
        )
    else:
        _follow(state, batch, "json" if display == "json" else "plain")


def _can_show_screens() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def _end_with_server() -> None:
    """End this process soon after the web server that is its parent has ended; do nothing where there is none."""
    # Jobs that the app starts must not inherit the variable: they do not end with the server.
    server = os.environ.pop(SERVER_PID, "")

    def watch() -> None:
        with suppress(KeyboardInterrupt):
            while os.getppid() == int(server):
                time.sleep(SERVER_PERIOD_S)
        # Nothing reads the screen any more: there is nothing to restore.
        os._exit(0)

    if server:
        threading.Thread(target=watch, daemon=True, name="benchbot-server").start()


def _web(run: str | None, batch: Path | None, images: str | None, port: int) -> None:
    from importlib.util import find_spec

    if find_spec("textual_serve") is None:
        raise BenchbotError(
            "The screens cannot be served to a browser.",
            "That needs the package textual-serve, which is not installed.",
            "Install it: pip install benchbot[web]",
        )
    from benchbot.plugins.tui.web import serve

    words = ["tui", "--display=screen"]
    words += [] if images is None else [f"--images={images}"]
    words += [] if run is None else [f"--run={run}"]
    words += [] if batch is None else [f"--batch={batch.absolute()}"]
    serve(words, port, {SERVER_PID: str(os.getpid())})


def _follow(state: "RunState | None", batch: Path | None, display: Literal["plain", "json"]) -> None:
    from benchbot.plugins.watching.batch_feed import BatchFeed
    from benchbot.plugins.watching.plain import follow
    from benchbot.plugins.watching.run_feed import RunFeed

    if state is None and batch is None:
        from benchbot.plugins.tui.jobs import look

        _print(look(), as_json=display == "json")
        return
    feed = RunFeed(state) if state is not None else BatchFeed((batch or Path()).absolute())
    try:
        follow(feed, display)
    finally:
        feed.close()


def _print(now: "Alive", *, as_json: bool) -> None:
    """Print what is alive, as data."""
    if as_json:
        console.data_json(_as_dict(now))
        return
    for state in now.runs:
        console.data(
            f"run {state.name}: {state.task}, {state.robot}, {state.environment}, seed {state.seed}, of {state.owner}"
        )
    for entry in now.batches:
        activity = "alive" if entry.alive else "nobody works on it"
        failed = "".join(f", {count} failed ({name})" for name, count in entry.failures.items())
        console.data(f"batch {entry.folder}: {entry.finished} of {entry.episodes} episodes{failed}, {activity}")
    for each in now.jobs:
        kind = "submission" if each.job.is_submission else "job"
        console.data(f"{kind} {each.job.title}: {each.summary}")
    if not (now.runs or now.batches or now.jobs):
        console.note("No run and no batch of yours is alive on this machine.")


def _as_dict(now: "Alive") -> dict[str, Any]:
    names = ("task", "robot", "environment", "seed", "pid", "started_s", "owner")
    return {
        "runs": [{"run": state.name, **{name: getattr(state, name) for name in names}} for state in now.runs],
        "batches": [
            {
                "folder": str(entry.folder),
                "alive": entry.alive,
                "episodes": entry.episodes,
                "finished": entry.finished,
                "failures": dict(entry.failures),
            }
            for entry in now.batches
        ],
        "submissions": [
            {
                "submission": each.job.title,
                "state": each.state,
                "said": each.summary,
                "result": None if each.job.result is None else str(each.job.result),
                "command": each.job.command,
            }
            for each in now.jobs
            if each.job.is_submission
        ],
        "jobs": [
            {"state": each.state, "said": each.summary, "command": each.job.command}
            for each in now.jobs
            if not each.job.is_submission
        ],
    }
